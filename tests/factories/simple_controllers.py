"""Controllers that several tests of guards move an axis by."""

from typing import Any

from stickslip.control import PIDController, PositionController
from stickslip.records import SensorSample

T = 0.01


class Push(PositionController[None]):
    """One effort for ever."""

    sampling_time = T

    def __init__(self, effort: float) -> None:
        self.effort = effort

    def init(self) -> None:
        return None

    def step(self, state: None, sample: SensorSample) -> tuple[None, float]:
        del sample
        return state, self.effort


def interrupted_kernel(interruption: type[KeyboardInterrupt] = KeyboardInterrupt) -> None:
    """Fail as a compiled call does during which Ctrl-C arrives."""
    raise SystemError("returned a result with an exception set") from interruption()


def pid_controller(**settings: Any) -> PIDController:
    """Return a controller of a measured velocity."""
    return PIDController(**{"sampling_time": T, "velocity": "measured"} | settings)
