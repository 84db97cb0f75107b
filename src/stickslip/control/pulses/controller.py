"""Base class of the pulse controllers, and checks of their settings."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import floor, inf
from typing import Any, ClassVar, Literal

import numpy as np
from jaxtyping import Float

from stickslip.control.base import PositionController
from stickslip.control.checks import check_fields
from stickslip.control.pulses import kernel as at
from stickslip.control.rest_detection import RestDetection
from stickslip.errors import check_class
from stickslip.records import (
    AxisKind,
    InputError,
    LearnedPulses,
    PositioningOutcome,
    PulseMethod,
    PulseRecord,
    SensorSample,
    finite,
    one_of,
    positive,
    quantity_field,
)

_METHODS = {"pwc": at.PWC, "papwc": at.PAPWC, "exact": at.EXACT}
_OUTCOMES = {
    at.MOVING: PositioningOutcome.MOVING,
    at.REACHED: PositioningOutcome.REACHED,
    at.STOPPED: PositioningOutcome.STOPPED,
}


@dataclass(frozen=True, kw_only=True)
class PulseController(PositionController[Float[np.ndarray, " s"]], ABC):
    """A controller that moves an axis from rest to rest by pulses of effort.

    At rest outside the tolerance it fires a pulse and waits until the axis rests again; what the
    pulse did teaches it about the next one. Inside the tolerance it is silent, and begins anew when
    the axis is pushed out.

    All that it is and remembers is one vector, which `init` returns and `step` takes and leaves as
    it is. A sample that lacks what the controller needs gives the effort NaN and changes nothing; a
    vector that is not one of this method is a ValueError.

    Raises
    ------
    InputError
        If a value is out of its range.
    """

    #: That of the loop; pulses last whole samples.
    sampling_time: float = quantity_field("sampling_time")
    target: float = quantity_field("position")  #: Where the axis is to rest.
    tolerance: float = quantity_field("position")  #: How far from it at most.
    rest: RestDetection  #: When the axis counts as being at rest.
    kind: AxisKind = "linear"  #: ``"linear"`` or ``"rotary"``.
    method: ClassVar[PulseMethod]  #: Name of the method, as in what it has learned.
    _kernel: ClassVar[Any]

    def __post_init__(self) -> None:
        one_of("kind", self.kind, ("linear", "rotary"))
        self._check(positive, "sampling_time", "tolerance")
        object.__setattr__(self, "target", finite("target", self.target, self._unit("target")))
        check_class("rest", self.rest, RestDetection)

    def _unit(self, name: str) -> str:
        """Return the unit of one of the fields."""
        return self.__dataclass_fields__[name].metadata["quantity"].unit(self.kind)

    def _check(self, check: Callable[[str, float, str], float], *names: str) -> None:
        check_fields(self, check, {name: self._unit(name) for name in names})

    @property
    def step(
        self,
    ) -> Callable[[Float[np.ndarray, " s"], SensorSample], tuple[Float[np.ndarray, " s"], float]]:
        """The pure step ``step(state, sample) -> (state, effort)``, a compiled kernel.

        The effort is for the time from this sample to the next.
        """
        return type(self)._kernel

    @property
    def channels(self) -> tuple[str, ...]:
        """Position, and velocity if rest is judged by it."""
        velocity = () if self.rest.speed is None else ("measured_velocity",)
        return ("measured_position", *velocity)

    def blind(
        self,
        state: Float[np.ndarray, " s"],
        time: float,  # noqa: ARG002
    ) -> tuple[Float[np.ndarray, " s"], float]:
        """Go on with a pulse; from the positions after the lost sample nothing is learned."""
        return at.blind_step(state)

    @abstractmethod
    def init(self) -> Float[np.ndarray, " s"]:
        """Return the state before the first sample."""

    @abstractmethod
    def estimates(self, state: Float[np.ndarray, " s"]) -> dict[str, float]:
        """Return what is estimated, by name."""

    @abstractmethod
    def learned(self, state: Float[np.ndarray, " s"]) -> LearnedPulses:
        """Return what was learned, for `resumed` of the next run."""

    @abstractmethod
    def resumed(self, learned: LearnedPulses, *, keep_covariance: bool = True) -> "PulseController":
        """Return the same controller, beginning with what an earlier run has learned.

        Parameters
        ----------
        learned
            From `learned`, or read from a file.
        keep_covariance
            Whether the recursion goes on as if the runs were one; otherwise it begins anew from
            the estimates.

        Raises
        ------
        InputError
            If it was learned by another method, on another kind of axis, or cannot be.
        """

    def pulse_count(self, state: Float[np.ndarray, " s"]) -> int:
        """Return the number of pulses whose outcome is known; a current one is not counted."""
        s = at.head(state)
        return int(s.pulses - s.pending)

    def outcome(self, state: Float[np.ndarray, " s"]) -> PositioningOutcome:
        """Return how far positioning has come."""
        return _OUTCOMES[int(at.head(state).outcome)]

    def last_pulse(self, state: Float[np.ndarray, " s"]) -> PulseRecord | None:
        """Return the last pulse whose outcome is known, or None."""
        pulse = at.head(state).last
        count = int(pulse.level_count)
        if count == 0:
            return None
        return PulseRecord(
            time=float(pulse.time),
            levels=tuple(
                (effort, samples * self.sampling_time)
                for effort, samples in pulse.levels[:count].tolist()
            ),
            error=float(pulse.error),
            predicted_displacement=float(pulse.predicted),
            achieved_displacement=float(pulse.achieved),
            moved=bool(pulse.moved),
        )

    def retargeted(self, state: Float[np.ndarray, " s"], target: float) -> Float[np.ndarray, " s"]:
        """Return the state with another target [m or rad]; a current pulse is finished first."""
        finite("target", target, self._unit("target"))
        vector = state.copy()
        s = at.head(vector)
        s.target, s.outcome = target, at.MOVING
        if s.phase == at.RESTING:
            s.phase = at.WAITING
        return vector

    def _first_state(self, own: int) -> Float[np.ndarray, " s"]:
        """Return the state before the first sample, with so many zeros of the method's own."""
        rest = self.rest
        vector = np.zeros(at.OWN + own + rest.samples)
        s = at.head(vector)
        s.method, s.length = _METHODS[self.method], vector.size
        s.target, s.tolerance = self.target, self.tolerance
        s.window, s.spread = rest.samples, rest.spread
        s.speed = inf if rest.speed is None else rest.speed
        s.least_motion = rest.spread if rest.least_motion is None else rest.least_motion
        s.calm_width = rest.spread or at.CREEP * self.tolerance
        s.delay = rest.delay
        s.rest = s.error = np.nan  # until the first rest
        return vector

    def _learned(
        self, values: Mapping[str, float], covariance: Float[np.ndarray, "p p"]
    ) -> LearnedPulses:
        return LearnedPulses(
            method=self.method, kind=self.kind, values=values, covariance=covariance
        )

    def _check_learned(self, learned: LearnedPulses, names: tuple[str, ...], size: int) -> None:
        """Check that what was learned is of this method and axis, and holds what is needed."""
        check_class("experience", learned, LearnedPulses)
        learned.check(method=self.method, kind=self.kind, names=names, size=size)


def checked_share(
    name: str, value: float, highest: float, *, ends: Literal["", "low", "high"], usual: float
) -> None:
    """Check a number without unit that must lie between 0 and ``highest``, an end included."""
    low = value >= 0.0 if ends == "low" else value > 0.0
    high = value <= highest if ends == "high" else value < highest
    if not (low and high):
        interval = f"{'[' if ends == 'low' else '('}0, {highest:g}{']' if ends == 'high' else ')'}"
        raise InputError("not_in_interval", name=name, value=value, interval=interval, usual=usual)


def longest_samples(width: float | None, sampling_time: float) -> float:
    """Return how many whole samples a pulse may last at most."""
    if width is None:
        return inf
    samples = floor(positive("longest_width", width, "s") / sampling_time + at.ROUNDING)
    if samples < 1:
        raise InputError(
            "pulse_below_sample", name="longest_width", value=width, sampling_time=sampling_time
        )
    return float(samples)
