"""The result of an estimator: values, intervals, and what they are worth."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.errors import InputError
from stickslip.records.joint import JointLogs
from stickslip.records.quantities import QUANTITIES, AxisKind, quantity_name, shared_name
from stickslip.records.record import Record, Worded
from stickslip.records.selection import ModelSelection

__all__ = [
    "PARAMETER_NAMES",
    "SCHEMA_VERSION",
    "SIGNED_PARAMETERS",
    "Diagnostics",
    "FrictionEstimate",
    "ParameterEstimate",
    "Provenance",
    "Status",
    "Verdict",
]

SCHEMA_VERSION = 1

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
    """One parameter with its uncertainty.

    Attributes
    ----------
    name
        One of `PARAMETER_NAMES`; with the name of a log in brackets if several logs were fitted
        jointly and have their own value, as in ``"offset[morning]"``.
    value
        Estimate [SI, named by ``unit``]; None when the log cannot identify it.
    std, ci95
        Standard deviation and 95 % interval (low, high) [same unit]; None when the log cannot
        identify it, or the method gives no interval (an observer, say).
    unit
        Name of the SI unit.
    """

    json_form = ("value std ci95 unit",)

    name: str
    value: float | None
    std: float | None
    ci95: tuple[float, float] | None
    unit: str

    def __post_init__(self) -> None:
        if shared_name(self.name) not in PARAMETER_NAMES:
            raise InputError(
                f"{self.name!r} is not a parameter name", remedy=f"use one of {PARAMETER_NAMES}"
            )
        uncertain = self.std is not None
        if uncertain != (self.ci95 is not None) or (uncertain and self.value is None):
            raise InputError(
                f"{self.name} has an uncertainty without a value, or half an uncertainty",
                remedy="give std and ci95 together, and only with a value",
            )

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
    """What a log can say about one parameter, and why.

    Attributes
    ----------
    parameter
        One of `PARAMETER_NAMES`.
    identifiable
        Whether the log determines it.
    reason
        One sentence, such as "the axis moves one way only, so Coulomb friction and the offset force
        cannot be separated".
    """

    parameter: str
    identifiable: bool
    reason: str


@dataclass(frozen=True, kw_only=True)
class Diagnostics(Record):
    """What the result certifies about itself.

    Attributes
    ----------
    relative_residual
        Norm of the residual over norm of the fitted signal [-].
    cross_validation_residual
        The same on data left out of the fit [-], or None if the log is too short to leave any out.
    condition_number
        Of the regressor with columns scaled to unit norm [-].
    residual_autocorrelation
        First-lag autocorrelation of the residual the intervals are computed from [-].
    effective_samples
        Number of independent samples that the correlated residual is worth [-].
    classical_std
        Standard deviations under the assumption of white residuals, by parameter [SI] (for
        comparison with the literature; too small when residuals are correlated).
    samples
        Number of samples used.
    verdicts
        One a parameter.
    notes
        Anything else a user should know, one sentence each.
    effort_delay
        Samples that the effort was found to act late; None where none was looked for.
    """

    relative_residual: float
    cross_validation_residual: float | None
    condition_number: float
    residual_autocorrelation: float
    effective_samples: float
    classical_std: Mapping[str, float]
    samples: int
    verdicts: tuple[Verdict, ...]
    notes: tuple[str, ...] = ()
    effort_delay: int | None = None


@dataclass(frozen=True, kw_only=True)
class Provenance(Record):
    """What produced a result.

    Attributes
    ----------
    stickslip_version
        Version of this package.
    files, input_sha256
        Names and hash of the input; empty for a log made in memory.
    options
        Every option of the estimator, as plain values.
    assumptions
        What was inferred while reading the log.
    """

    stickslip_version: str
    files: tuple[str, ...]
    input_sha256: str
    options: Mapping[str, Any]
    assumptions: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class FrictionEstimate(Record):
    """Friction parameters of one axis, as an estimator found them.

    Attributes
    ----------
    estimator
        Name of the estimator, such as ``"energy"``.
    kind
        ``"linear"`` or ``"rotary"``.
    parameters
        By name, in the order of the regressor.
    covariance
        Covariance of the identified parameters, shape (p, p), in their order [SI].
    status
        Whether the result can be trusted.
    diagnostics, provenance
        What it certifies about itself and where it came from.
    selection
        Which terms the log supports; None for an estimator of given terms.
    joint
        The logs of a joint fit and whether they are consistent; None for a fit of one log.
    """

    schema = SCHEMA_VERSION
    json_form = (
        "schema estimator kind parameters covariance status",
        "status_text=status.text diagnostics provenance selection joint",
    )

    estimator: str
    kind: AxisKind
    parameters: Mapping[str, ParameterEstimate]
    covariance: Float[np.ndarray, "p p"]
    status: Status
    diagnostics: Diagnostics
    provenance: Provenance
    selection: ModelSelection | None = None
    joint: JointLogs | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        covariance = np.array(self.covariance, dtype=np.float64)
        covariance.flags.writeable = False
        object.__setattr__(self, "covariance", covariance)

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
            raise InputError(
                f"the estimate holds no value for {name!r}",
                remedy=f"it identified {', '.join(held) or 'nothing'}",
            )
        return parameter.value

    def of_log(self, log: str) -> "FrictionEstimate":
        """Return the estimate of one log of a joint fit, with the usual names of all parameters.

        Parameters
        ----------
        log
            Name of the log.

        Raises
        ------
        InputError
            If it is none of the logs that were fitted.
        """
        every = () if self.joint is None else self.joint.logs
        own = next((each for each in every if each.name == log), None)
        if own is None:
            raise InputError(
                f"the estimate is not of a log {log!r}",
                remedy=f"its logs are {', '.join(each.name for each in every) or 'not named'}",
            )
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
