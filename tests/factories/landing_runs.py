"""Landings in the sampled loop, with new targets on the way."""

from typing import Any

import numpy as np

from stickslip.control import PlannedBeside, Supervisor
from stickslip.estimation import EnergyEstimator
from stickslip.plants import Plant
from stickslip.records import SensorSample
from stickslip.simulation import ClosedLoopRun, Sensors, simulate_closed_loop


def landing_settings(**settings: Any) -> dict[str, Any]:
    """Return settings of a landing of an arm, by default to 1 m and with its masses known."""
    arm = settings["arm"]
    usual: dict[str, Any] = {
        "target": 1.0,
        "estimator": EnergyEstimator(
            force_noise=0.0,
            inertia=arm.mass_1,
            load_inertia=arm.mass_2,
            stiffness=arm.stiffness,
            offset=False,
        ),
    }
    return usual | settings


class Pilot:
    """Sends a landing controller to new targets at given times."""

    def __init__(self, landing: Supervisor[Any], *targets: tuple[float, float]) -> None:
        self.landing = landing
        self.targets = list(targets)
        self.sampling_time = landing.sampling_time
        self.init = landing.init

    def step(self, state: Any, sample: SensorSample) -> tuple[Any, float]:
        if self.targets and sample.time >= self.targets[0][0] - self.sampling_time / 2:
            state = self.landing.retargeted(state, self.targets.pop(0)[1])
        return self.landing.step(state, sample)


class Waited:
    """A loop in which every plan beside it is there after some samples."""

    def __init__(self, landing: PlannedBeside, samples: int = 1) -> None:
        self.init = landing.init
        self._landing, self._samples, self._waited = landing, samples, 0

    def step(self, state: Any, sample: SensorSample) -> Any:
        pending = self._landing._pending
        self._waited += bool(pending)
        if state.request is not None and self._waited % self._samples == 0:
            for each in pending.values():
                each.result()
        return self._landing.step(state, sample)


def fly(
    plant: Plant,
    landing: Supervisor[Any],
    *targets: tuple[float, float],
    seconds: float,
    noise: tuple[float, float] = (0.0, 0.0),
    seed: int = 0,
) -> ClosedLoopRun[Any]:
    """Run a landing with deviations of position and velocity noise; targets are (time, place)."""
    run = simulate_closed_loop(
        plant,
        Pilot(landing, *targets),
        sampling_time=landing.sampling_time,
        samples=round(seconds / landing.sampling_time),
        sensors=Sensors(position_noise=noise[0], velocity_noise=noise[1]),
        generator=np.random.default_rng(seed),
    )
    assert np.abs(run.motion.commanded_effort).max() <= landing.effort_limit
    return run
