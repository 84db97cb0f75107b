"""A log of one motion axis: what was sent to it and what was measured."""

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from jaxtyping import Bool, Float, Int

from stickslip.errors import InputError, finite_vector, one_of
from stickslip.records.quantities import AxisKind, EffortUnit, quantity_field, unit_of
from stickslip.records.record import Record

GAP_RATIO = 3.5
"""A time step longer than this many typical ones is a gap and starts a new segment; up to three are
jitter or a lost sample or two, of a bus or an operating system."""

_MINIMUM_SAMPLES = 2  # fewest that have a sampling time
_CHANNELS = (
    "effort",
    "measured_position",
    "measured_velocity",
    "measured_load_position",
    "measured_load_velocity",
    "model_effort",
)


@dataclass(frozen=True, kw_only=True)
class LogSource:
    """Where a log came from and what was assumed in reading it."""

    files: tuple[str, ...]  #: Names of the files read.
    sha256: str  #: Hash of their bytes, in that order.
    assumptions: tuple[str, ...] = ()  #: A sentence for everything inferred and not stated.
    unconverted: str = ""  #: The one of them on an effort that is left in A or %.
    #: Channels whose unit is stated nowhere, each with the SI unit that it was taken in.
    assumed_units: tuple[tuple[str, str], ...] = ()
    side: Literal["", "motor", "joint"] = ""  #: Of a gear that results refer to, if it is known.


@dataclass(frozen=True, kw_only=True)
class _Timing:
    """Steps of the time stamps of a log."""

    sampling_time: float  # s
    jitter: float  # largest deviation of a step over the sampling time [-]
    gaps: Int[np.ndarray, " gaps"]  # index of the sample before each gap


@dataclass(frozen=True, kw_only=True)
class AxisLog(Record):
    """One axis over time, validated, in SI units.

    ``effort[k]`` is held from ``time[k]`` to ``time[k+1]`` (zero-order hold).

    Raises
    ------
    InputError
        If lengths differ, a value is not finite, time does not increase, or there are fewer than
        two samples.

    Examples
    --------
    >>> log = AxisLog(name="stage", kind="linear", time=np.array([0.0, 0.1, 0.2]),
    ...               effort=np.ones(3), measured_position=np.array([0.0, 0.005, 0.02]))
    >>> round(log.sampling_time, 6), len(log)
    (0.1, 3)
    """

    json_form = ("name samples sampling_time duration",)

    name: str  #: Name of the axis.
    kind: AxisKind  #: ``"linear"`` or ``"rotary"``; decides the units.
    #: Time stamps, shape (n,), strictly increasing.
    time: Float[np.ndarray, " n"] = quantity_field("time")
    #: Force or torque on the (first) mass, shape (n,).
    effort: Float[np.ndarray, " n"] = quantity_field("effort")
    #: Position of the (first) mass, shape (n,).
    measured_position: Float[np.ndarray, " n"] = quantity_field("position")
    #: Its velocity, shape (n,), or None if it was not measured.
    measured_velocity: Float[np.ndarray, " n"] | None = quantity_field("velocity", default=None)
    #: Position of the second mass of a flexible arm, shape (n,), or None.
    measured_load_position: Float[np.ndarray, " n"] | None = quantity_field(
        "position", default=None
    )
    #: Its velocity, shape (n,), or None.
    measured_load_velocity: Float[np.ndarray, " n"] | None = quantity_field(
        "velocity", default=None
    )
    #: Effort at each time stamp, shape (n,), by which a model of the machine explains ``effort``
    #: beyond inertia and friction of the axis, as gravity and other joints cause it; or None. It
    #: does not contain the torque of a constant inertia.
    model_effort: Float[np.ndarray, " n"] | None = quantity_field("effort", default=None)
    #: ``"A"`` or ``"%"`` for an effort that is not converted to a force or torque: all results then
    #: have units made of it, such as A s/rad. Empty for SI.
    effort_unit: EffortUnit = ""
    source: LogSource | None = None  #: Where the log came from, or None if it was made in memory.

    def __post_init__(self) -> None:
        one_of("kind", self.kind, get_args(AxisKind))
        one_of("effort_unit", self.effort_unit, get_args(EffortUnit))
        time = self._store("time", self.time)
        if time.size < _MINIMUM_SAMPLES:
            raise InputError("too_few_samples", samples=time.size, least=_MINIMUM_SAMPLES)
        backward = np.flatnonzero(time[1:] <= time[:-1])
        if backward.size:
            k = int(backward[0])
            raise InputError("time_not_increasing", sample=k + 1, time=time[k], next=time[k + 1])
        for name in _CHANNELS:
            values, optional = getattr(self, name), self.__dataclass_fields__[name].default is None
            if values is None and optional:
                continue
            if (size := self._store(name, values).size) != time.size:
                raise InputError(
                    "unequal_lengths", name=name, samples=size, other="time", needed=time.size
                )

    def _store(self, name: str, values: Any) -> Float[np.ndarray, " n"]:
        quantity = self.__dataclass_fields__[name].metadata["quantity"]
        array = finite_vector(name, values, self.unit(quantity.name.replace(" ", "_")))
        object.__setattr__(self, name, array)
        return array

    def with_source(self, source: LogSource | None) -> "AxisLog":
        """Return the log with another source, and the same samples, which are read-only."""
        other = copy(self)
        object.__setattr__(other, "source", source)
        return other

    def __len__(self) -> int:
        """Return the number of samples."""
        return self.time.size

    @property
    def samples(self) -> int:
        """Number of samples."""
        return self.time.size

    @property
    def duration(self) -> float:
        """Time from the first sample to the last [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def sampling_time(self) -> float:
        """Span of the segments over the number of periods in it [s].

        A step of about two or three typical ones is one with samples missing, and counts as such.
        """
        return self._timing.sampling_time

    @property
    def timing_jitter(self) -> float:
        """Largest deviation of a step within the segments, as a fraction of the sampling time."""
        return self._timing.jitter

    @cached_property
    def _timing(self) -> _Timing:
        steps = np.diff(self.time)
        typical = float(np.median(steps))
        gaps = steps > GAP_RATIO * typical
        inside = steps[~gaps] if gaps.any() else steps
        periods = np.maximum(np.rint(inside / typical), 1.0)
        sampling_time = float(np.sum(inside) / np.sum(periods))
        jitter = float(np.max(np.abs(inside - sampling_time)) / sampling_time)
        return _Timing(sampling_time=sampling_time, jitter=jitter, gaps=np.flatnonzero(gaps))

    @cached_property
    def segment_starts(self) -> Int[np.ndarray, " segments"]:
        """Index of the first sample of each segment; a log without gaps has one, at 0."""
        return np.concatenate(([0], self._timing.gaps + 1))

    def segments(self) -> Iterator["AxisLog"]:
        """Yield the stretches between gaps, each as a log of its own (not single samples)."""
        bounds = [*self.segment_starts.tolist(), len(self)]
        for start, stop in pairwise(bounds):
            if stop - start >= _MINIMUM_SAMPLES:
                yield self.part(start, stop)

    def part(self, start: int, stop: int) -> "AxisLog":
        """Return samples ``start`` to ``stop`` (exclusive) as a log of its own."""
        return self.selected(slice(start, stop))

    def selected(self, samples: slice | Bool[np.ndarray, " n"]) -> "AxisLog":
        """Return some of the samples as a log of its own.

        Parameters
        ----------
        samples
            A slice of them, or whether each is taken.
        """
        columns = {name: getattr(self, name) for name in ("time", *_CHANNELS)}
        return replace(
            self,
            **{k: None if values is None else values[samples] for k, values in columns.items()},
        )

    def unit(self, quantity: str) -> str:
        """Return the unit of a quantity on this axis, such as ``log.unit("velocity")``."""
        return unit_of(quantity, self.kind, self.effort_unit)


class SensorSample(NamedTuple):
    """Sensor values that a controller receives at a sample instant, in SI units; never the truth.

    A channel without a sensor is NaN, as all are that are not given.
    """

    time: float = np.nan
    measured_position: float = np.nan
    measured_velocity: float = np.nan
    measured_load_position: float = np.nan
    measured_load_velocity: float = np.nan
