"""Contents of a log and its proposed axes, without an identification."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from stickslip.records.quantities import AxisKind
from stickslip.records.record import Record


@dataclass(frozen=True, kw_only=True)
class LogColumn(Record):
    """One column of a log, as in the file."""

    name: str  #: Name of the column.
    origin: str  #: Topic or group in the file; empty if it is the name.
    group: str  #: Rate group; empty if the log has one.
    unit: str  #: As stated in the file; empty if it states none.
    samples: int  #: Number of samples.
    low: float | None  #: Smallest value [unit of the file]; None if no value is finite.
    high: float | None  #: Largest value [unit of the file].
    missing: int  #: Samples that are not finite.
    repeated: float  #: Largest share of the samples at the smallest or the largest value [-].
    meaning: str  #: Meaning by name; empty if it is no channel.


@dataclass(frozen=True, kw_only=True)
class ExpectedPrecision(Record):
    """Expected precision of a parameter from the motion of a log."""

    parameter: str  #: Name of the parameter.
    value: float | None  #: Rough estimate [SI]; None if the log does not determine it.
    half_width: float | None  #: Half of the expected 95 % interval [SI].
    relative: float | None  #: Half width over value [-].
    sufficient: bool  #: Whether it is within the limit.
    advice: str  #: What to record otherwise; empty if it is sufficient.


@dataclass(frozen=True, kw_only=True)
class AxisProposal(Record):
    """Columns of one axis as they would be read, and properties of their samples."""

    json_form = (
        "name columns kind units reasons problem samples duration sampling_time jitter segments",
        "clipped lag lag_resolution expected",
    )

    name: str  #: Name of the axis.
    columns: Mapping[str, str]  #: Column or expression of each channel.
    kind: AxisKind | None  #: ``"linear"`` or ``"rotary"``; None if it is not known.
    units: Mapping[str, str] = field(default_factory=dict[str, str])  #: SI units, by channel.
    reasons: tuple[str, ...] = ()  #: A sentence for everything that was inferred.
    problem: str = ""  #: Why the axis cannot be read; empty if it can be.
    samples: int = 0  #: Number of samples.
    duration: float = 0.0  #: From the first sample to the last [s].
    sampling_time: float = 0.0  #: [s]
    jitter: float = 0.0  #: Largest deviation of a step, as a fraction of the sampling time [-].
    segments: int = 0  #: Stretches between gaps.
    #: Share of the samples at the largest or smallest effort in a row [-]; 0 of an effort that is
    #: switched between a few levels.
    clipped: float = 0.0
    #: Time by which the effort acts later than it is logged [s]; None if not determined.
    lag: float | None = None
    lag_resolution: float | None = None  #: Standard error of the lag [s].
    expected: tuple[ExpectedPrecision, ...] = ()  #: Of each parameter, if a check is requested.

    @property
    def sufficient(self) -> bool:
        """Whether every parameter can be expected within the limit."""
        return not self.problem and all(each.sufficient for each in self.expected)


@dataclass(frozen=True, kw_only=True)
class Inspection(Record):
    """Contents of a log."""

    name: str  #: Name of the log.
    rates: Mapping[str, float]  #: Sampling frequency of each rate group [Hz]; 0 if it is not known.
    columns: tuple[LogColumn, ...]  #: Every column.
    axes: tuple[AxisProposal, ...]  #: The axes that the columns make.
    notes: tuple[str, ...] = ()  #: What was assumed to read the file.
    limit: float | None = None  #: Limit of the check [-]; None without a check.

    @property
    def trusted(self) -> bool:
        """Whether every axis can be read and, if checked, identified within the limit."""
        return bool(self.axes) and all(
            not each.problem and (self.limit is None or each.sufficient) for each in self.axes
        )
