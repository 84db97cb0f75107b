"""Whether several logs of one axis show the same axis, and where they differ."""

from dataclasses import dataclass

from stickslip.records.record import Record
from stickslip.records.selection import EffortKind

__all__ = ["JointLog", "JointLogs", "LogDeviation"]


@dataclass(frozen=True, kw_only=True)
class JointLog(Record):
    """One of several logs that were fitted jointly.

    Attributes
    ----------
    name
        By which the parameters of this log are named, as in ``"offset[morning]"``.
    samples
        Number of its samples [-].
    duration, sampling_time
        [s].
    residual
        Root mean square of the residual of the common model [N or N m]. Each log is weighted by
        its inverse.
    effort_delay
        Time by which the effort of this log acts later than it is logged [s].
    reference_time
        Middle of the log [s], at which drifting parameters have the values given.
    effort_kind
        What its effort was taken for, as `ModelSelection` has it.
    """

    name: str
    samples: int
    duration: float
    sampling_time: float
    residual: float
    effort_delay: float = 0.0
    reference_time: float = 0.0
    effort_kind: EffortKind = "held"


@dataclass(frozen=True, kw_only=True)
class LogDeviation(Record):
    """A parameter that one log shows differently from the others.

    Attributes
    ----------
    log, parameter
        Names of both.
    difference, std
        Of that log from the others, and its standard deviation [SI].
    relative
        The difference over the value of the others [-].
    p_value
        Of no difference, times the number of differences that were tested [-].
    material
        Whether the difference is large enough to matter; one that does not matter widens the
        interval only.
    """

    log: str
    parameter: str
    difference: float
    std: float
    relative: float
    p_value: float
    material: bool


@dataclass(frozen=True, kw_only=True)
class JointLogs(Record):
    """The logs of a joint fit, and the test whether they show the same axis.

    Attributes
    ----------
    logs
        In the order given.
    p_value
        Of the hypothesis that all logs have the same common parameters [-]; None if no parameter
        can be compared.
    error_rate
        Share of consistent sets of logs that the test calls inconsistent [-], at the most.
    deviations
        What differs significantly, the clearest first.
    """

    json_form = ("logs p_value error_rate deviations consistent",)

    logs: tuple[JointLog, ...]
    p_value: float | None
    error_rate: float
    deviations: tuple[LogDeviation, ...] = ()

    @property
    def consistent(self) -> bool:
        """Whether no difference is both significant and large enough to matter."""
        return not any(each.material for each in self.deviations)

    @property
    def text(self) -> str:
        """One sentence on whether the logs are consistent."""
        if self.p_value is None:
            return "The logs have no parameter that can be compared."
        rate = f"p = {self.p_value:.2g}; consistent logs fail this test in {self.error_rate:.0%}"
        if self.consistent and self.deviations:
            return f"The logs differ by amounts that do not matter ({rate})."
        if self.consistent:
            return f"The logs are consistent: they share all common parameters ({rate})."
        return f"The logs are not consistent ({rate})."
