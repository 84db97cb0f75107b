"""What a landing controller remembers from sample to sample, and what it leaves behind."""

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from stickslip.control.base import Phase
from stickslip.control.feedback.controller import FeedbackController
from stickslip.control.landing.belief import ArmBelief
from stickslip.control.pulses.exact import ExactPulseController
from stickslip.planning import PulseSeries
from stickslip.records import SensorSample, quantity_field

__all__ = [
    "AxisLandingState",
    "Flight",
    "LandingState",
    "Phase",
    "SupervisorState",
    "Window",
]


@dataclass(frozen=True, kw_only=True)
class Flight:
    """A series of pulses as planned and as it went.

    Attributes
    ----------
    start
        When it began [s].
    planned
        The series; its target may lie beyond that of the landing, to come back from.
    coulomb_friction, viscous_friction
        With which it was planned [N or N m, N s/m or N m s/rad].
    final_position
        Where mass 1 came to rest; None as long as it has not, or if the series was cut short.
    final_swing
        Amplitude of mass 2 about that place; None likewise.
    """

    start: float = quantity_field("time")
    planned: PulseSeries
    coulomb_friction: float = quantity_field("coulomb_friction")
    viscous_friction: float = quantity_field("viscous_friction")
    final_position: float | None = quantity_field("position", default=None)
    final_swing: float | None = quantity_field("position", default=None)


@dataclass(frozen=True, kw_only=True)
class Window:
    """The last samples, and since when mass 1 has rested.

    Attributes
    ----------
    samples
        Position, load position and load velocity of the last samples, shape (n, 3), a ring
        [m or rad, m or rad, m/s or rad/s].
    count
        Samples taken since mass 1 last moved.
    low, high
        Ends of the band that its measured position has stayed in since then [m or rad].
    """

    samples: Float[np.ndarray, "n 3"]
    count: int = 0
    low: float = np.inf
    high: float = -np.inf

    @classmethod
    def of(cls, samples: int) -> "Window":
        """Return an empty window with room for so many samples."""
        return cls(samples=np.zeros((samples, 3)))

    def after(self, sample: SensorSample, spread: float) -> "Window":
        """Return the window with one more sample; a position outside the band begins it anew.

        Parameters
        ----------
        sample
            What the sensors show.
        spread
            Largest width of the band at rest [m or rad].
        """
        x = sample.measured_position
        low, high, count = min(self.low, x), max(self.high, x), self.count + 1
        if high - low > spread:
            low = high = x
            count = 1
        samples = self.samples.copy()
        samples[(count - 1) % len(samples)] = (
            x,
            sample.measured_load_position,
            sample.measured_load_velocity,
        )
        return replace(self, samples=samples, count=count, low=low, high=high)

    def empty(self) -> "Window":
        """Return the window without samples."""
        return replace(self, count=0, low=np.inf, high=-np.inf)

    def seen(self) -> Float[np.ndarray, "k 3"]:
        """Return the samples since mass 1 last moved, the oldest first, as far as they fit."""
        if self.count <= len(self.samples):
            return self.samples[: self.count]
        return np.roll(self.samples, -(self.count % len(self.samples)), axis=0)


@dataclass(frozen=True, kw_only=True)
class SupervisorState:
    """State of a landing controller, of any axis.

    Attributes
    ----------
    target
        Where the axis shall rest.
    phases
        All so far, the last is the present one.
    feedback
        The controller of the feedback phase, whose time begins with that phase; None outside it.
    feedback_state
        Its state [as of the controller].
    estimator_state
        Of the estimator that runs along [its own units]; in a feedback phase that of its begin.
    window
        In which rest is looked for.
    renewed
        Whether the target is new, so that feedback begins with the next sample.
    """

    target: float = quantity_field("position")
    phases: tuple[Phase, ...] = ()
    feedback: FeedbackController | None = None
    feedback_state: Float[np.ndarray, " f"]
    estimator_state: Float[np.ndarray, " e"]
    window: Window
    renewed: bool = True

    @property
    def phase(self) -> Phase:
        """The present phase."""
        return self.phases[-1]


@dataclass(frozen=True, kw_only=True)
class LandingState(SupervisorState):
    """State of a landing controller of an arm.

    Attributes
    ----------
    flights
        All series so far.
    sent
        Samples of the present series that have been sent.
    track
        The samples of the last series, the one at its begin first; none once it has been judged, or
        if there is nothing to learn from it.
    static_ratio
        Static over Coulomb friction as it is believed to be [-].
    belief
        Masses, spring and friction as learned from the series; None if they are taken as given.
    """

    flights: tuple[Flight, ...] = ()
    sent: int = 0
    track: tuple[SensorSample, ...] = ()
    static_ratio: float
    belief: ArmBelief | None = None

    @property
    def series_since_target(self) -> int:
        """How many series have begun since the last feedback phase."""
        names = [phase.name for phase in self.phases]
        since = len(names) - 1 - names[::-1].index("feedback")
        return names[since:].count("series")


@dataclass(frozen=True, kw_only=True)
class AxisLandingState(SupervisorState):
    """State of a landing controller of a single mass.

    Attributes
    ----------
    pulses
        The controller of the pulses; None before the first of them.
    pulse_state
        Its state [as of the controller].
    still_since
        When the phase of pulses began, or since when there is no effort in it [s].
    """

    pulses: ExactPulseController | None = None
    pulse_state: Float[np.ndarray, " p"] = field(default_factory=lambda: np.empty(0))
    still_since: float = quantity_field("time", default=0.0)
