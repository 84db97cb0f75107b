"""A series of pulses that takes both masses of a flexible arm from rest to rest, and why not."""

from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Float

from stickslip.records import AxisKind, InputError, quantity_field

__all__ = ["NoPulseSeriesError", "PulseSeries", "SeriesLimit"]


class SeriesLimit(Enum):
    """What makes a series impossible; the text says what it means and what to do."""

    EFFORT = "effort"
    DIRECTION = "direction"
    BREAKAWAY = "breakaway"
    PULSES = "pulses"
    TOGETHER = "together"

    @property
    def text(self) -> str:
        """What to do about it, as an instruction."""
        return _REMEDIES[self]


_REMEDIES = {
    SeriesLimit.EFFORT: "allow more effort or more time",
    SeriesLimit.DIRECTION: (
        "allow more time, wait for mass 2 to swing less or the other way, or choose a target "
        "farther away, so that mass 1 need not turn back"
    ),
    SeriesLimit.BREAKAWAY: (
        "allow more time or more effort, wait until the spring helps to free mass 1, or choose a "
        "target farther away"
    ),
    SeriesLimit.PULSES: "allow at least 4 pulses, one for each of the four states to be met",
    SeriesLimit.TOGETHER: "allow more time and more effort, or choose another target",
}


class NoPulseSeriesError(InputError):
    """No series of pulses does what is asked for.

    Attributes
    ----------
    limit
        The limit without which there would be one; ``TOGETHER`` if there would be none without any
        single one of them.
    """

    def __init__(self, what: str, *, limit: SeriesLimit, remedy: str) -> None:
        self.limit = limit
        super().__init__(what, remedy=remedy)


@dataclass(frozen=True, kw_only=True)
class PulseSeries:
    """Efforts that bring both masses of a flexible arm to rest on a target, and what they do.

    ``effort[k]`` is held from ``time[k]`` to ``time[k+1]``; after the last the effort is 0, and
    mass 1 stays where it is. The motion is what the plant does if it is as believed.

    Attributes
    ----------
    kind
        ``"linear"`` or ``"rotary"``; decides the units.
    sampling_time
        [s].
    pulse_samples
        Samples in each pulse.
    target
        Where both masses shall rest.
    effort
        Of each sample, shape (n,).
    position, velocity
        Of mass 1 at each sample instant, shape (n+1,).
    load_position, load_velocity
        Of mass 2, shape (n+1,).
    effort_limit
        That none of the efforts exceeds.
    breakaway_margin
        By how much the first effort exceeds what frees mass 1; infinite if it moves already.
    slowest
        The least speed of mass 1 between begin and end, between samples too; it is positive
        unless mass 1 rests on the way.
    least_duration
        What no series of this effort limit takes less than, as far as proven [s]; the shortest
        series takes between this and its duration.
    least_impulse
        What the impulse of no series without a rest is less than, over this time [N s or N m s].
    rest
        From when until when mass 1 rests on the way; None if it does not.
    """

    kind: AxisKind
    sampling_time: float = quantity_field("sampling_time")
    pulse_samples: int
    target: float = quantity_field("position")
    effort: Float[np.ndarray, " n"] = quantity_field("effort")
    position: Float[np.ndarray, " n+1"] = quantity_field("position")
    velocity: Float[np.ndarray, " n+1"] = quantity_field("velocity")
    load_position: Float[np.ndarray, " n+1"] = quantity_field("position")
    load_velocity: Float[np.ndarray, " n+1"] = quantity_field("velocity")
    effort_limit: float = quantity_field("effort")
    breakaway_margin: float = quantity_field("effort")
    slowest: float = quantity_field("velocity")
    least_duration: float = quantity_field("time")
    least_impulse: float
    rest: tuple[float, float] | None = quantity_field("time", default=None)

    def __post_init__(self) -> None:
        for name in ("effort", "position", "velocity", "load_position", "load_velocity"):
            array = np.array(getattr(self, name), dtype=np.float64)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @cached_property
    def time(self) -> Float[np.ndarray, " samples"]:
        """Sample instants [s], shape (n+1,)."""
        time = np.arange(self.effort.size + 1) * self.sampling_time
        time.flags.writeable = False
        return time

    @property
    def duration(self) -> float:
        """From the begin of the first pulse to the end of the last [s]."""
        return self.effort.size * self.sampling_time

    @property
    def amplitudes(self) -> Float[np.ndarray, " pulses"]:
        """Effort of each pulse [N or N m]."""
        return self.effort[:: self.pulse_samples]

    @property
    def direction(self) -> Literal[1, -1]:
        """Which way mass 1 moves."""
        return 1 if self.target > self.position[0] else -1

    @property
    def peak_effort(self) -> float:
        """The largest magnitude of effort [N or N m]."""
        return float(np.abs(self.effort).max())

    @property
    def impulse(self) -> float:
        """Time integral of the effort's magnitude [N s or N m s], the smallest possible."""
        return float(np.abs(self.effort).sum()) * self.sampling_time
