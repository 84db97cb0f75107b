"""Base class of the pulse controllers."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from stickslip.control.base import PositionController
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

__all__ = ["PulseController"]

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
    """Compiled step."""

    def __post_init__(self) -> None:
        if self.kind not in ("linear", "rotary"):
            raise InputError(f"the kind is {self.kind!r}", remedy="give 'linear' or 'rotary'")
        for name in ("sampling_time", "tolerance"):
            self._check_positive(name)
        _finite_target(self.target, self.kind)
        object.__setattr__(self, "target", float(self.target))
        rest: type = type(self.rest)
        if not issubclass(rest, RestDetection):
            raise InputError(
                f"rest is a {rest.__name__}, it must be a RestDetection",
                remedy="give RestDetection(...) or RestDetection.for_encoder(...)",
            )

    def _unit(self, name: str) -> str:
        """Return the unit of one of the fields."""
        return self.__dataclass_fields__[name].metadata["quantity"].unit(self.kind)

    def _check_positive(self, name: str) -> None:
        object.__setattr__(self, name, positive(name, getattr(self, name), self._unit(name)))

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
        """Return what is estimated, by name.

        Parameters
        ----------
        state
            From `init`, a step, or a run's ``controller_state``.
        """

    @abstractmethod
    def learned(self, state: Float[np.ndarray, " s"]) -> LearnedPulses:
        """Return what was learned, for `resumed` of the next run.

        Parameters
        ----------
        state
            As for `estimates`.
        """

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
        """Return of how many pulses it is known what they did; one on its way is not counted.

        Parameters
        ----------
        state
            As for `estimates`.
        """
        s = at.head(state)
        return int(s.pulses - s.pending)

    def outcome(self, state: Float[np.ndarray, " s"]) -> PositioningOutcome:
        """Return how far positioning has come.

        Parameters
        ----------
        state
            As for `estimates`.
        """
        return _OUTCOMES[int(at.head(state).outcome)]

    def last_pulse(self, state: Float[np.ndarray, " s"]) -> PulseRecord | None:
        """Return the last pulse of which it is known what it did, or None.

        Parameters
        ----------
        state
            As for `estimates`.
        """
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
        """Return the state with another target; a pulse on its way is finished first.

        Parameters
        ----------
        state
            As for `estimates`.
        target
            The new one [m or rad].

        Raises
        ------
        InputError
            If it is not finite.
        """
        _finite_target(target, self.kind)
        vector = state.copy()
        s = at.head(vector)
        s.target, s.outcome = target, at.MOVING
        if s.phase == at.RESTING:
            s.phase = at.WAITING
        return vector

    def _first_state(self, method: int, own: int) -> Float[np.ndarray, " s"]:
        """Return the state before the first sample, with so many numbers of the method's own.

        ``method`` is the number by which the method's kernel knows it.
        """
        rest = self.rest
        vector = np.zeros(at.OWN + own + rest.samples)
        s = at.head(vector)
        s.method, s.length = method, vector.size
        s.target, s.tolerance = self.target, self.tolerance
        s.window, s.spread = rest.samples, rest.spread
        s.speed = inf if rest.speed is None else rest.speed
        s.least_motion = rest.spread if rest.least_motion is None else rest.least_motion
        s.delay = rest.delay
        s.rest = s.error = np.nan  # until the first rest
        return vector

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


def _finite_target(target: float, kind: AxisKind) -> None:
    if not isfinite(target):
        raise InputError(
            f"target is {target} {unit_of('position', kind)}, it must be finite",
            remedy="give where the axis is to rest",
        )
