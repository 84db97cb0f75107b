"""The result of an estimator: values, intervals, their worth, and the model they belong to."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from stickslip.errors import InputError, one_of
from stickslip.records.quantities import (
    QUANTITIES,
    AxisKind,
    EffortUnit,
    quantity_name,
    shared_name,
    unit_of,
)
from stickslip.records.record import Exportable, Record, Worded

SCHEMA_VERSION = 1  # of the JSON form

PARAMETER_NAMES: tuple[str, ...] = tuple(
    f"{name}{side}"
    for name, quantity in QUANTITIES.items()
    if quantity.sign is not None
    for side in (("", "_positive", "_negative") if quantity.directional else ("",))
)
"""Every name a parameter of an estimate can have."""

SIGNED_PARAMETERS = frozenset(
    name
    for name in PARAMETER_NAMES
    if (sign := QUANTITIES[quantity_name(name)].sign) == "any"
    or (sign == "any in a direction" and name != quantity_name(name))
)
"""Parameters whose true value may be negative."""

EffortKind = Literal["held", "sampled", "mean"]
"""Meaning of a logged effort: held from its time stamp to the next, the value at its time stamp, or
the mean since the time stamp before (or held since then)."""


class Status(Worded):
    """Whether an estimate can be trusted; the text names the reason and the remedy."""

    OK = ("ok", "Identified", "The parameters are identified.")
    NOT_IDENTIFIABLE = (
        "not_identifiable",
        "Not identifiable from this log",
        "This log does not separate some parameters; record a motion that excites them, or give "
        "the ones you know.",
    )
    INSUFFICIENT_EXCITATION = (
        "insufficient_excitation",
        "Not enough motion",
        "The axis moves too little in this log; record a motion with several speeds and reversals.",
    )
    UNPHYSICAL = (
        "unphysical",
        "Unphysical result",
        "The best fit needs a negative mass or friction; check units, signs and the effort's "
        "scale.",
    )
    POOR_FIT = (
        "poor_fit",
        "Poor fit",
        "The model leaves most of the effort unexplained; check the columns, their units, masses "
        "and stiffness if they are given, and whether gravity or a spring acts on the axis.",
    )
    BIASED = (
        "biased",
        "Biased estimate",
        "The method is known to be biased on such a log by more than its intervals allow for; use "
        "the default estimator of this kind of axis, and this one for comparison.",
    )
    MODEL_MISMATCH = (
        "model_mismatch",
        "Model mismatch",
        "The log violates the model in a way that cannot be modelled; the notes name the cause, "
        "its size and the remedy.",
    )
    NO_INTERVAL = (
        "no_interval",
        "Values without intervals",
        "The method gives no confidence intervals, so the errors of its values are unknown; "
        "confirm them with a method that gives intervals.",
    )

    @property
    def trusted(self) -> bool:
        """Whether the values can be used."""
        return self is Status.OK

    @property
    def usable(self) -> bool:
        """Whether the values that are given can be used, though others may be missing."""
        return self in {Status.OK, Status.NOT_IDENTIFIABLE}


@dataclass(frozen=True, kw_only=True)
class ParameterEstimate(Record):
    """One parameter with its uncertainty."""

    json_form = ("value std ci95 unit",)

    #: One of `PARAMETER_NAMES`; with the name of a log in brackets if several logs were fitted
    #: jointly and have their own value, as in ``"offset[morning]"``.
    name: str
    value: float | None  #: Estimate [SI, named by ``unit``]; None if it is not identifiable.
    std: float | None  #: Standard deviation [same unit]; None without a value or an interval.
    ci95: tuple[float, float] | None  #: 95 % interval (low, high) [same unit]; None as ``std``.
    unit: str  #: Name of the SI unit.

    def __post_init__(self) -> None:
        one_of("name", shared_name(self.name), PARAMETER_NAMES)
        uncertain = self.std is not None
        if uncertain != (self.ci95 is not None) or (uncertain and self.value is None):
            raise InputError("half_an_uncertainty", name=self.name)

    @property
    def identified(self) -> bool:
        """Whether the log determined this parameter."""
        return self.value is not None

    @property
    def signed(self) -> bool:
        """Whether the true value may be negative."""
        return shared_name(self.name) in SIGNED_PARAMETERS

    @property
    def quantile(self) -> float:
        """Half of the 95 % interval over the standard deviation [-]; NaN if there is neither."""
        if self.ci95 is None or not self.std:
            return math.nan
        return (self.ci95[1] - self.ci95[0]) / (2.0 * self.std)


@dataclass(frozen=True, kw_only=True)
class Verdict(Record):
    """Whether a log determines one parameter, and why."""

    parameter: str  #: One of `PARAMETER_NAMES`.
    identifiable: bool  #: Whether the log determines it.
    reason: str  #: One sentence, such as "the axis moves one way only, so Coulomb friction ...".


@dataclass(frozen=True, kw_only=True)
class Diagnostics(Record):
    """Measures of the quality of a result."""

    relative_residual: float  #: Norm of the residual over norm of the fitted signal [-].
    #: The same on data left out of the fit [-]; None if the log is too short to leave any out.
    cross_validation_residual: float | None
    condition_number: float  #: Of the regressor with columns scaled to unit norm [-].
    #: First-lag autocorrelation of the residual that the intervals are computed from [-].
    residual_autocorrelation: float
    effective_samples: float  #: Independent samples that the correlated residual is worth [-].
    #: Standard deviations under the assumption of white residuals, by parameter [SI]: for
    #: comparison with the literature; too small when residuals are correlated.
    classical_std: Mapping[str, float]
    samples: int  #: Number of samples used.
    verdicts: tuple[Verdict, ...]  #: One a parameter.
    notes: tuple[str, ...] = ()  #: Anything else a user should know, one sentence each.
    effort_delay: int | None = None  #: Estimated delay of the effort [samples]; None: not sought.


@dataclass(frozen=True, kw_only=True)
class Provenance(Record):
    """The origin of a result."""

    stickslip_version: str  #: Version of this package.
    files: tuple[str, ...]  #: Names of the input files; empty for a log made in memory.
    input_sha256: str  #: Hash of the input; empty for a log made in memory.
    options: Mapping[str, Any]  #: Every option of the estimator, as plain values.
    assumptions: tuple[str, ...] = ()  #: What was inferred while reading the log.
    #: Of the log: ``"A"`` or ``"%"`` if its effort is no force or torque.
    effort_unit: EffortUnit = ""
    side: Literal["", "motor", "joint"] = ""  #: Of a gear that the values refer to, if known.


@dataclass(frozen=True, kw_only=True)
class TermScore(Record):
    """The contribution of a term to the selected model, whether it is a part of it or not."""

    term: str  #: Name of the term, such as ``"stribeck"``.
    text: str  #: Its meaning for the axis, in words.
    selected: bool  #: Whether the model contains it.
    #: Of the hypothesis that its coefficients are zero, under correlated residuals [-].
    p_value: float
    gain: float  #: Relative decrease of the squared error on moves left out of the fit [-].
    gain_std: float  #: Standard error of the gain [-].
    #: Root mean square of what only this term explains, relative to that of the effort [-].
    share: float
    #: Parameter of its shape [SI]: the period of a ripple, the distance of presliding, the Stribeck
    #: velocity; 0 without one.
    shape: float = 0.0


@dataclass(frozen=True, kw_only=True)
class ModelSelection(Record):
    """Which terms a log supports beyond inertia, viscous friction, Coulomb friction and offset."""

    summary: str  #: One paragraph: what was selected and why.
    #: One a term: the selected ones in the order of their selection, then the others.
    scores: tuple[TermScore, ...]
    effort_delay: float = 0.0  #: Time by which the effort acts later than it is logged [s].
    reference_time: float = 0.0  #: Time at which drifting parameters have the values given [s].
    reference_position: float = 0.0  #: Position at which a spring has no effort [m or rad].
    effort_kind: EffortKind = "held"  #: Meaning of the logged effort.

    @property
    def selected(self) -> tuple[str, ...]:
        """Names of the selected terms, in the order of their selection."""
        return tuple(score.term for score in self.scores if score.selected)


@dataclass(frozen=True, kw_only=True)
class JointLog(Record):
    """One of several logs that were fitted jointly."""

    name: str  #: By which the parameters of this log are named, as in ``"offset[morning]"``.
    samples: int  #: Number of its samples [-].
    duration: float  #: From its first sample to its last [s].
    sampling_time: float  #: Its sampling time [s].
    #: Root mean square of the residual of the common model [N or N m]; each log is weighted by its
    #: inverse.
    residual: float
    effort_delay: float = 0.0  #: Time by which its effort acts later than it is logged [s].
    reference_time: float = 0.0  #: Its middle [s], at which drifting parameters are as given.
    effort_kind: EffortKind = "held"  #: Meaning of its effort.


@dataclass(frozen=True, kw_only=True)
class LogDeviation(Record):
    """A parameter that differs between one log and the others."""

    log: str  #: Name of the log.
    parameter: str  #: Name of the parameter.
    difference: float  #: Of that log from the others [SI].
    std: float  #: Standard deviation of the difference [SI].
    relative: float  #: The difference over the value of the others [-].
    p_value: float  #: Of no difference, times the number of differences that were tested [-].
    #: Whether it is large enough to matter; one that does not matter only widens the interval.
    material: bool


@dataclass(frozen=True, kw_only=True)
class JointLogs(Record):
    """The logs of a joint fit, and the test whether they show the same axis."""

    json_form = ("logs p_value error_rate deviations consistent",)

    logs: tuple[JointLog, ...]  #: In the order given.
    #: Of the hypothesis that all logs have the same common parameters [-]; None if no parameter can
    #: be compared.
    p_value: float | None
    error_rate: float  #: Share of consistent sets of logs that fail the test, at the most [-].
    deviations: tuple[LogDeviation, ...] = ()  #: What differs significantly, the clearest first.

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
        if not self.consistent:
            return f"The logs are not consistent ({rate})."
        if self.deviations:
            return f"The logs differ by amounts that do not matter ({rate})."
        return f"The logs are consistent: they share all common parameters ({rate})."


@dataclass(frozen=True, kw_only=True)
class FrictionEstimate(Record, Exportable):
    """Friction parameters of one axis, as an estimator found them."""

    schema = SCHEMA_VERSION
    json_form = (
        "schema estimator kind parameters covariance status",
        "status_text=status.text diagnostics provenance selection joint",
    )

    estimator: str  #: Name of the estimator, such as ``"energy"``.
    kind: AxisKind  #: ``"linear"`` or ``"rotary"``.
    parameters: Mapping[str, ParameterEstimate]  #: By name, in the order of the regressor.
    #: Covariance of the identified parameters, shape (p, p), in their order [SI].
    covariance: Float[np.ndarray, "p p"]
    status: Status  #: Whether the result can be trusted.
    diagnostics: Diagnostics  #: What it certifies about itself.
    provenance: Provenance  #: Where it came from.
    #: Which terms the log supports; None for an estimator of given terms.
    selection: ModelSelection | None = None
    #: The logs of a joint fit and whether they are consistent; None for a fit of one log.
    joint: JointLogs | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        covariance = np.array(self.covariance, dtype=np.float64)
        covariance.flags.writeable = False
        object.__setattr__(self, "covariance", covariance)

    def unit(self, quantity: str) -> str:
        """Return the unit of a quantity or parameter in this estimate."""
        return unit_of(quantity, self.kind, self.provenance.effort_unit)

    def value(self, name: str) -> float:
        """Return one identified parameter's value.

        Raises
        ------
        InputError
            If the estimate does not hold it or the log could not identify it.
        """
        parameter = self.parameters.get(name)
        if parameter is None or parameter.value is None:
            held = [key for key, p in self.parameters.items() if p.identified]
            raise InputError("not_identified", name=name, identified=held)
        return parameter.value

    def of_log(self, log: str) -> "FrictionEstimate":
        """Return the estimate of one log of a joint fit, with the usual names of all parameters.

        Raises
        ------
        InputError
            If no log of that name was fitted.
        """
        every = () if self.joint is None else self.joint.logs
        own = next((each for each in every if each.name == log), None)
        if own is None:
            raise InputError("unknown_log", log=log, logs=[each.name for each in every])
        suffix = f"[{log}]"
        names = [n for n in self.parameters if n == shared_name(n) or n.endswith(suffix)]
        identified = [name for name, p in self.parameters.items() if p.identified]
        keep = [identified.index(name) for name in names if name in identified]
        selection = self.selection
        if selection is not None:
            selection = replace(
                selection,
                effort_delay=own.effort_delay,
                reference_time=own.reference_time,
                effort_kind=own.effort_kind,
            )
        return replace(
            self,
            parameters={
                shared_name(n): replace(self.parameters[n], name=shared_name(n)) for n in names
            },
            covariance=self.covariance[np.ix_(keep, keep)],
            selection=selection,
            joint=None,
        )
