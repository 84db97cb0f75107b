"""What a landing controller remembers from sample to sample, and what it leaves behind."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float

from stickslip.control.feedback import FeedbackController
from stickslip.planning import PulseSeries
from stickslip.records import SensorSample, quantity_field

__all__ = ["Flight", "LandingState", "Phase", "PhaseName", "Window"]

PhaseName = Literal["feedback", "resting", "series", "done", "stopped"]


@dataclass(frozen=True, kw_only=True)
class Phase:
    """A phase of a landing.

    Attributes
    ----------
    name
        ``"feedback"``: moved near the target; ``"resting"``: no effort, until mass 1 rests and the
        swing of mass 2 is known; ``"series"``: pulses; ``"done"``; ``"stopped"``.
    start
        When it began [s].
    reason
        The condition under which it was entered.
    """

    name: PhaseName
    start: float = quantity_field("time")
    reason: str


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
        Where mass 1 came to rest; None as long as it has not.
    final_swing
        Amplitude of mass 2 about that place; None as long as it is not known.
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
class LandingState:
    """State of a landing controller.

    Attributes
    ----------
    target
        Where both masses shall rest.
    phases
        All so far, the last is the present one.
    flights
        All series so far.
    feedback
        The controller of the feedback phase, whose time begins with that phase; None outside it.
    feedback_state
        Its state [as of the controller].
    estimator_state
        Of the estimator that runs along [its own units]; in a feedback phase that of its begin.
    window
        In which rest is looked for.
    sent
        Samples of the present series that have been sent.
    static_ratio
        Static over Coulomb friction as it is believed to be [-].
    renewed
        Whether the target is new, so that feedback begins with the next sample.
    """

    target: float = quantity_field("position")
    phases: tuple[Phase, ...] = ()
    flights: tuple[Flight, ...] = ()
    feedback: FeedbackController | None = None
    feedback_state: Float[np.ndarray, " f"]
    estimator_state: Float[np.ndarray, " e"]
    window: Window
    sent: int = 0
    static_ratio: float
    renewed: bool = True

    @property
    def phase(self) -> Phase:
        """The present phase."""
        return self.phases[-1]
