"""Base class of the pulse controllers, and checks of their settings."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import floor, inf, isfinite
from typing import Any, ClassVar, Literal

import numpy as np
from jaxtyping import Float

from stickslip.control.base import PositionController
from stickslip.control.checks import check_fields, whole
from stickslip.control.pulses import kernel as at
from stickslip.control.rest_detection import RestDetection
from stickslip.records import (
    AxisKind,
    InputError,
    LearnedPulses,
    PositioningOutcome,
    PulseMethod,
    PulseRecord,
    SensorSample,
    positive,
    quantity_field,
    unit_of,
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

    Attributes
    ----------
    sampling_time
        That of the loop; pulses last whole samples.
    target
        Where the axis is to rest.
    tolerance
        How far from it at most.
    rest
        When the axis counts as being at rest.
    kind
        ``"linear"`` or ``"rotary"``.

    Raises
    ------
    InputError
        If a value is out of its range.
    """

    sampling_time: float = quantity_field("sampling_time")
    target: float = quantity_field("position")
    tolerance: float = quantity_field("position")
    rest: RestDetection
    kind: AxisKind = "linear"
    method: ClassVar[PulseMethod]
    """Name of the method, as in what it has learned."""
    _kernel: ClassVar[Any]

    def __post_init__(self) -> None:
        if self.kind not in ("linear", "rotary"):
            raise InputError(f"the kind is {self.kind!r}", remedy="give 'linear' or 'rotary'")
        self._check(positive, "sampling_time", "tolerance")
        object.__setattr__(self, "target", _finite_target(self.target, self.kind))
        rest: type = type(self.rest)
        if not issubclass(rest, RestDetection):
            raise InputError(
                f"rest is a {rest.__name__}, it must be a RestDetection",
                remedy="give RestDetection(...) or RestDetection.for_encoder(...)",
            )

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
        _finite_target(target, self.kind)
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
        given: type = type(learned)
        if not issubclass(given, LearnedPulses):
            raise InputError(
                f"what was learned is a {given.__name__}, it must be a LearnedPulses",
                remedy="give what learned returned, or LearnedPulses.from_dict of what was saved",
            )
        if learned.method != self.method:
            raise InputError(
                f"this was learned by {learned.method!r}, the controller is {self.method!r}",
                where="method",
                remedy="take that method, or begin with first guesses",
            )
        if learned.kind != self.kind:
            raise InputError(
                f"this was learned on a {learned.kind} axis, the controller is for a {self.kind} "
                "one",
                where="kind",
                remedy="resume with what was learned on the same axis, or begin with first guesses",
            )
        for name in names:
            if name not in learned.values:
                raise InputError(
                    f"{name} [{unit_of(name, self.kind)}] is missing",
                    where="values",
                    remedy=f"it needs {', '.join(names)}",
                )
        if learned.covariance.shape != (size, size):
            raise InputError(
                f"the covariance has shape {learned.covariance.shape}, this method's has "
                f"({size}, {size})",
                where="covariance",
                remedy="give it as it was saved",
            )


def _finite_target(target: float, kind: AxisKind) -> float:
    if not isfinite(target):
        raise InputError(
            f"target is {target} {unit_of('position', kind)}, it must be finite",
            remedy="give where the axis is to rest",
        )
    return float(target)


def checked_share(
    name: str, value: float, highest: float, *, ends: Literal["", "low", "high"], usual: float
) -> None:
    """Check a number without unit that must lie between 0 and ``highest``, an end included."""
    low = value >= 0.0 if ends == "low" else value > 0.0
    high = value <= highest if ends == "high" else value < highest
    if not (low and high):
        left = "[" if ends == "low" else "("
        right = "]" if ends == "high" else ")"
        raise InputError(
            f"{name} is {value:g}, it must lie in {left}0, {highest:g}{right}",
            remedy=f"give {usual:g} when in doubt",
        )


def check_idle_pulses(value: int, may_fail_to: str) -> None:
    """Check how many pulses in a row may fail to do something."""
    if not (whole(value) and value >= 1):
        raise InputError(
            f"max_idle_pulses is {value!r}, it must be a whole number of at least 1",
            remedy=f"give how many pulses in a row may fail to {may_fail_to}",
        )


def longest_samples(width: float | None, sampling_time: float) -> float:
    """Return how many whole samples a pulse may last at most."""
    if width is None:
        return inf
    samples = floor(positive("longest_width", width, "s") / sampling_time + at.ROUNDING)
    if samples < 1:
        raise InputError(
            f"longest_width is {width:g} s, a pulse lasts at least one sample of "
            f"{sampling_time:g} s",
            remedy="allow a longer pulse or sample faster",
        )
    return float(samples)
