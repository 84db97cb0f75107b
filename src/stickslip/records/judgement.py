"""Verdict and value of each parameter of an estimate, for tables, pages and terminals."""

from dataclasses import dataclass
from enum import Enum

from stickslip.records.estimate import FrictionEstimate, ParameterEstimate, Status
from stickslip.records.quantities import AxisKind
from stickslip.records.wording import in_words, parameter_label, rounded, rounded_interval

__all__ = ["Judged", "Judgement", "judged", "missing_parameters", "value_texts"]


class Judgement(Enum):
    """Whether a value of an estimate can be used."""

    IDENTIFIED = "identified"
    NOT_IDENTIFIED = "not identified"
    UNPHYSICAL = "unphysical"
    UNUSABLE = "not to be used"


@dataclass(frozen=True, kw_only=True)
class Judged:
    """A judgement with its reason.

    Attributes
    ----------
    judgement
        Whether the value can be used.
    reason
        Why not, in words; empty if it can, or if the status of the estimate is the reason.
    """

    judgement: Judgement
    reason: str = ""


def judged(estimate: FrictionEstimate, name: str) -> Judged:
    """Return whether a parameter of an estimate can be used, and why not.

    Parameters
    ----------
    estimate
        Of any estimator.
    name
        One of its parameters.
    """
    parameter = estimate.parameters[name]
    verdicts = {each.parameter: each for each in estimate.diagnostics.verdicts}
    verdict = verdicts.get(name)
    negative = parameter.value is not None and parameter.value <= 0
    if estimate.status is Status.UNPHYSICAL and negative and not parameter.signed:
        return Judged(judgement=Judgement.UNPHYSICAL, reason="it cannot be negative")
    if parameter.identified and not estimate.status.usable:
        return Judged(judgement=Judgement.UNUSABLE)
    if parameter.identified and (verdict is None or verdict.identifiable):
        return Judged(judgement=Judgement.IDENTIFIED)
    reason = "" if verdict is None else in_words(verdict.reason)
    return Judged(judgement=Judgement.NOT_IDENTIFIED, reason=reason)


def missing_parameters(estimate: FrictionEstimate, kind: AxisKind = "linear") -> list[str]:
    """Return one sentence for each reason for which parameters are not identifiable.

    Parameters
    ----------
    estimate
        Of any estimator.
    kind
        Of the axis, for the labels of its parameters.
    """
    reasons: dict[str, list[str]] = {}
    for verdict in estimate.diagnostics.verdicts:
        if not verdict.identifiable:
            reasons.setdefault(verdict.reason, []).append(parameter_label(verdict.parameter, kind))
    return [f"{', '.join(names)}: {in_words(reason)}" for reason, names in reasons.items()]


def value_texts(parameter: ParameterEstimate) -> tuple[str, str]:
    """Return value and 95 % interval with their significant digits; a dash for a missing one.

    Parameters
    ----------
    parameter
        Of an estimate.
    """
    value, std, interval = parameter.value, parameter.std, parameter.ci95
    if value is None:
        return "–", "–"
    if std is None or interval is None:
        return f"{value:.5g}", "none"
    return rounded(value, std), rounded_interval(*interval, std)
