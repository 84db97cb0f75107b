"""Estimators side by side: on one log, or over many runs of one simulated scenario."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

from stickslip.records.axis_log import AxisLog, LogSource
from stickslip.records.estimate import PARAMETER_NAMES, FrictionEstimate
from stickslip.records.identification import Resimulation
from stickslip.records.quantities import AxisKind, quantity_field, unit_of
from stickslip.records.record import Record, ScenarioTables, valued_tables

_SCHEMA = 1  # version of the JSON form

_LOG_LEGEND = {
    "why_not": "why an estimator does not apply to this log; empty if it does",
    "seconds_per_sample": "time of a whole fit over the samples of the log; of a fit below 0.5 s "
    "the second of two, as the first also loads compiled code",
    "unexplained_effort": "norm of effort less inertia force and friction over norm of the effort, "
    "both smoothed and decimated as for idim-ls, and alike for every estimator; null of an arm",
    "position_fit": "1 - norm(measured - simulated) / norm(measured - mean) of the position, when "
    "the identified axis is driven by the logged effort and restarts from the measured motion "
    "twenty times",
    "assumed_inertia": "mass or inertia that it was given, though it was not known: that "
    "of the energy estimator on the same log; null if it needed none",
    "contradictions": "parameters of which estimates of status ok have 95 % intervals that do not "
    "overlap, with these intervals: at least one of the methods is wrong on this log; alone is "
    "the one that overlaps no other, if all others overlap",
}

_STUDY_LEGEND = {
    "runs": "runs that gave a value; others were refused or left it undetermined",
    "bias": "mean of the estimates less the truth",
    "rmse": "root mean square of the estimates less the truth",
    "bound_ratio": "root mean square of the error over the Cramer-Rao bound, each run's own if "
    "inputs differ; null where the bound does not apply",
    "coverage": "share of the runs whose 95 % interval holds the truth; null without intervals",
    "trusted": "share of the runs whose status is ok",
    "delay_found": "share of the runs in which the delay of the effort was found; null where none "
    "was looked for",
    "seconds_per_sample": _LOG_LEGEND["seconds_per_sample"] + "; of the first run",
}


@dataclass(frozen=True, kw_only=True)
class ComparedEstimator(Record):
    """One estimator applied to a log."""

    json_form = (
        "name applies why_not seconds_per_sample unexplained_effort",
        "position_fit=resimulation.fit assumed_inertia estimate",
    )

    name: str  #: Of the estimator.
    estimate: FrictionEstimate | None = None  #: None if it does not apply to the log.
    why_not: str = ""  #: One sentence: why it does not apply; empty if it does.
    #: Time of a fit over the samples of the log [s]; None if it does not apply.
    seconds_per_sample: float | None = None
    #: Norm of effort less inertia force and friction over norm of the effort [-]; None where it is
    #: not known.
    unexplained_effort: float | None = None
    #: The identified axis under the logged effort; None where it cannot be simulated.
    resimulation: Resimulation | None = None
    #: Mass or inertia of the energy estimator, given to it in place of a known one; None if it
    #: needed none.
    assumed_inertia: float | None = quantity_field("inertia", default=None)

    @property
    def applies(self) -> bool:
        """Whether it applies to the log."""
        return self.estimate is not None


@dataclass(frozen=True, kw_only=True)
class Contradiction(Record):
    """Trusted estimates of one parameter whose 95 % intervals do not overlap."""

    json_form = ("parameter alone intervals",)

    parameter: str  #: One of `PARAMETER_NAMES`.
    #: 95 % intervals (low, high) by estimator [SI], each without overlap with at least one other.
    intervals: Mapping[str, tuple[float, float]]
    #: The estimator whose interval overlaps none of all trusted ones, where all others overlap each
    #: other; empty if there is none. Of two estimators neither is alone.
    alone: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain JSON types, null for no estimator that stands alone."""
        return super().to_dict() | {"alone": self.alone or None}


@dataclass(frozen=True, kw_only=True)
class EstimatorComparison(Record):
    """Estimators side by side on one log."""

    schema, comparison, legend = _SCHEMA, "log", _LOG_LEGEND
    json_form = (
        "schema comparison kind=log.kind legend log estimators=compared",
        "contradictions",
        {
            "provenance": (
                "stickslip_version files=source.files input_sha256=source.sha256",
                "assumptions=source.assumptions",
            )
        },
    )

    log: AxisLog  #: The measurement.
    compared: tuple[ComparedEstimator, ...]  #: One an estimator.
    stickslip_version: str  #: Version of this package.

    @property
    def source(self) -> LogSource:
        """Where the log came from."""
        return self.log.source or LogSource(files=(), sha256="")

    @property
    def applied(self) -> tuple[ComparedEstimator, ...]:
        """Those that apply to the log."""
        return tuple(each for each in self.compared if each.applies)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of every parameter that an estimator has a value for, in a common order."""
        return _in_order(
            name
            for each in self.applied
            if each.estimate is not None
            for name, parameter in each.estimate.parameters.items()
            if parameter.identified
        )

    @property
    def trusted(self) -> bool:
        """Whether at least one estimate can be trusted."""
        return any(
            each.estimate is not None and each.estimate.status.trusted for each in self.compared
        )

    @property
    def contradictions(self) -> tuple[Contradiction, ...]:
        """Parameters of which trusted estimates have intervals that do not overlap."""
        found: list[Contradiction] = []
        for name in self.parameters:
            intervals = self._trusted_intervals(name)
            apart = {
                key: own
                for key, own in intervals.items()
                if any(_apart(own, other) for other in intervals.values())
            }
            if apart:
                found.append(
                    Contradiction(parameter=name, intervals=apart, alone=_alone(intervals))
                )
        return tuple(found)

    @property
    def alone(self) -> frozenset[str]:
        """Estimators that contradict all others in a parameter and have no selected terms."""
        alone = {each.alone for each in self.contradictions if each.alone}
        return frozenset(name for name in alone if not self.selected_terms(name))

    def selected_terms(self, name: str) -> tuple[str, ...]:
        """Return the terms that an estimator selected, which the others may lack.

        Parameters
        ----------
        name
            Name of a compared estimator.

        Returns
        -------
        Names of the terms; empty without a selection.
        """
        estimate = next(each.estimate for each in self.compared if each.name == name)
        selection = None if estimate is None else estimate.selection
        return () if selection is None else tuple(selection.selected)

    def _trusted_intervals(self, name: str) -> dict[str, tuple[float, float]]:
        """Return the 95 % intervals of a parameter by trusted estimator [SI]."""
        return {
            each.name: parameter.ci95
            for each in self.compared
            if each.estimate is not None
            and each.estimate.status.trusted
            and (parameter := each.estimate.parameters.get(name)) is not None
            and parameter.ci95 is not None
        }


@dataclass(frozen=True, kw_only=True)
class ParameterScore(Record):
    """The accuracy of an estimator in one parameter, over many runs."""

    json_form = ("truth bias rmse runs bound_ratio coverage",)

    name: str  #: One of `PARAMETER_NAMES`.
    truth: float  #: True value [SI].
    bias: float  #: Mean error [SI].
    rmse: float  #: Root mean square error [SI].
    runs: int  #: Runs that gave a value.
    #: Root mean square of the error over the Cramer-Rao bound, of each run its own if inputs differ
    #: [-]; None where the bound does not apply.
    bound_ratio: float | None
    #: Share of the runs whose 95 % interval holds the truth [-]; None without intervals.
    coverage: float | None


@dataclass(frozen=True, kw_only=True)
class EstimatorScore(Record):
    """The accuracy of an estimator over many runs."""

    json_form = (
        "name applies why_not trusted seconds_per_sample assumes_inertia",
        "delay_found parameters=scores",
    )

    name: str  #: Of the estimator.
    why_not: str = ""  #: One sentence: why it applied to no run; empty if it did.
    trusted: float = 0.0  #: Share of the runs whose status is ok [-].
    #: Time of a fit over the samples of the log [s]; None if it does not apply.
    seconds_per_sample: float | None = None
    #: Whether it was given the mass or inertia that the energy estimator found.
    assumes_inertia: bool = False
    #: Share of the runs in which the delay of the effort was found [-]; None where none was looked
    #: for.
    delay_found: float | None = None
    scores: Mapping[str, ParameterScore] = field(default_factory=dict)  #: By parameter name.

    @property
    def applies(self) -> bool:
        """Whether it applied to a run."""
        return not self.why_not


@dataclass(frozen=True, kw_only=True)
class EstimatorStudy(Record):
    """Estimators side by side over many runs of one simulated scenario."""

    schema, comparison, legend = _SCHEMA, "scenario", _STUDY_LEGEND
    json_form = (
        "schema comparison name kind runs samples legend scenario",
        "truth bound estimators=scores notes",
        {"provenance": ("stickslip_version", "file", "input_sha256=sha256")},
    )

    name: str  #: Of the scenario.
    kind: AxisKind  #: Of its axis.
    runs: int  #: Number of runs.
    samples: int  #: Samples of each run.
    scenario: ScenarioTables  #: Contents of the scenario, by table and key, with units.
    truth: Mapping[str, float]  #: By parameter name [SI].
    #: Cramer-Rao bound by parameter name, as a standard deviation [SI], of inputs that differ the
    #: root mean square; empty where it does not apply.
    bound: Mapping[str, float]
    scores: tuple[EstimatorScore, ...]  #: One an estimator.
    notes: tuple[str, ...]  #: Anything else a user should know, one sentence each.
    file: str  #: The scenario file.
    sha256: str  #: Its hash.
    stickslip_version: str  #: Version of this package that ran it.

    def __post_init__(self) -> None:
        object.__setattr__(self, "scenario", valued_tables(self.scenario))
        super().__post_init__()

    @property
    def applied(self) -> tuple[EstimatorScore, ...]:
        """Those that apply to the scenario."""
        return tuple(each for each in self.scores if each.applies)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of every parameter that an estimator has a value for, in a common order."""
        return _in_order(name for each in self.applied for name in each.scores)

    @property
    def trusted(self) -> bool:
        """Whether at least one estimator can be trusted in a run."""
        return any(each.trusted > 0 for each in self.applied)

    def to_dict(self) -> dict[str, Any]:
        """Return the study as plain JSON types (schema 1), with the unit of each score."""
        document = super().to_dict()
        for each in document["estimators"]:
            for name, score in each["parameters"].items():
                score["unit"] = unit_of(name, self.kind)
        bounds = document["bound"].items()
        return document | {"bound": {n: None if math.isinf(std) else std for n, std in bounds}}


def _alone(intervals: Mapping[str, tuple[float, float]]) -> str:
    """Return the one interval that overlaps no other, where all others overlap; or empty."""
    pairs = [
        {one, other}
        for one, other in combinations(intervals, 2)
        if _apart(intervals[one], intervals[other])
    ]
    if len(pairs) != len(intervals) - 1:
        return ""
    against_all = [name for name in intervals if all(name in pair for pair in pairs)]
    return against_all[0] if len(against_all) == 1 else ""


def _apart(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """Return whether two intervals do not overlap."""
    return one[1] < other[0] or other[1] < one[0]


def _in_order(names: Iterable[str]) -> tuple[str, ...]:
    """Return names once each, in the order of `PARAMETER_NAMES`."""
    there = set(names)
    return tuple(name for name in PARAMETER_NAMES if name in there)
