"""The interface of all controllers towards what runs them."""

from dataclasses import dataclass
from math import nan
from typing import Any, Generic, TypeVar

from stickslip.records import (
    LandingPhaseName,
    LearnedPulses,
    PositioningOutcome,
    PulseRecord,
    SensorSample,
    quantity_field,
)

S = TypeVar("S")

LOADED = (
    "the axis accelerates without effort: a load is above friction, and the axis is held; balance "
    "the load"
)
"""Why an axis is stopped that a load moves."""


@dataclass(frozen=True, kw_only=True)
class Phase:
    """A phase of a landing."""

    #: ``"feedback"`` (moved near the target), ``"resting"`` (no effort, until mass 1 rests and the
    #: swing of mass 2 is known), ``"series"`` (pulses planned together), ``"pulses"`` (one after
    #: the other, of a single mass), ``"done"`` or ``"stopped"``.
    name: LandingPhaseName
    start: float = quantity_field("time")  #: When it began [s].
    reason: str  #: The condition under which it was entered.


class PositionController(Generic[S]):
    """A controller that moves an axis to targets; what it answers about a state.

    Each answer defaults to that of a controller without pulses, phases and estimates, whose targets
    are in its reference. A state is one from ``init``, a step, or a run's ``controller_state``.
    """

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels of a sample without which a step has no effort."""
        return ("measured_position",)

    def blind(self, state: S, time: float) -> tuple[S, float]:
        """Take a sample at a time [s] of which nothing else is known.

        Returns the state and the effort that continues what has begun, such as a pulse; NaN if
        nothing has.
        """
        return state, nan

    def warm_up(self) -> None:
        """Compile and load all that a step uses, so that none takes longer than the others."""
        controller: Any = self
        state = controller.init()
        for k in range(2):
            sample = SensorSample(k * controller.sampling_time, 0.0, 0.0, 0.0, 0.0)
            state, _ = controller.step(state, sample)
            state, _ = controller.blind(state, k * controller.sampling_time)

    def retargeted(self, state: S, target: float) -> S:
        """Return the state with another target."""
        return state

    def outcome(self, state: S) -> PositioningOutcome | None:
        """Return how far positioning has come; None if the controller does not judge it."""
        return None

    def why(self, state: S) -> str | None:
        """Return why the controller has stopped short of the target; None if it has not."""
        return None

    def estimates(self, state: S) -> dict[str, float]:
        """Return what is estimated, by name [SI]."""
        return {}

    def deviations(self, state: S) -> dict[str, float]:
        """Return standard deviations of estimates, by name [SI]; infinite while unknown."""
        return {}

    def learned(self, state: S) -> LearnedPulses | None:
        """Return what was learned, for the first guesses of the next run; None if nothing is."""
        return None

    def integrates(self, tolerance: float) -> bool:
        """Return whether the effort grows while the axis rests outside a tolerance [m or rad]."""
        return False

    def phases(self, state: S) -> tuple[Phase, ...]:
        """Return the phases so far, the last is the present one."""
        return ()

    def pulse_count(self, state: S) -> int:
        """Return the number of pulses whose outcome is known."""
        return 0

    def last_pulse(self, state: S) -> PulseRecord | None:
        """Return the last pulse whose outcome is known, or None."""
        return None
