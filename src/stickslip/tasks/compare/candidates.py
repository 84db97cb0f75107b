"""Fits of the estimators that are compared."""

from dataclasses import dataclass

from stickslip.estimation.base import EstimationTask
from stickslip.estimation.registry import ESTIMATORS, entry_of
from stickslip.records import (
    AxisKind,
    AxisLog,
    FrictionEstimate,
    InputError,
    StickslipError,
    count_of,
)

__all__ = ["Fitted", "chosen_names", "fitted", "inertia_of"]


@dataclass(frozen=True, kw_only=True)
class Fitted:
    """The result of a fit: an estimate, or the reason why there is none.

    Attributes
    ----------
    estimate, why_not
        One of them.
    assumed_inertia
        Mass or inertia that the estimator was given, although it is not known [kg or kg m^2].
    """

    estimate: FrictionEstimate | None = None
    why_not: str = ""
    assumed_inertia: float | None = None


def chosen_names(only: tuple[str, ...], task: EstimationTask, kind: AxisKind) -> tuple[str, ...]:
    """Return the names of the estimators to compare, in the order of the registry.

    Parameters
    ----------
    only
        Names of the estimators; empty for all.
    task
        What is known of the axis, and what to estimate.
    kind
        ``"linear"`` or ``"rotary"``.

    Raises
    ------
    InputError
        If the task cannot be used, a name is unknown, or no estimator that is compared uses one of
        the settings.
    """
    task.check(kind)
    for name in only:
        entry_of(name)
    names = tuple(name for name in ESTIMATORS if not only or name in only)
    if task.largest_delay and "maximum-likelihood" not in names:
        raise InputError(
            f"largest_delay is {count_of(task.largest_delay, 'sample')}, and only "
            "maximum-likelihood estimates a delay, which is not compared",
            remedy="compare maximum-likelihood too, or leave largest_delay out",
        )
    return names


def fitted(name: str, task: EstimationTask, energy_inertia: float | None, log: AxisLog) -> Fitted:
    """Return the estimate of a log, or why the estimator does not apply to it.

    Parameters
    ----------
    name
        In the registry.
    task
        What is known of the axis, and what to estimate; settings that the estimator does not have
        are left out.
    energy_inertia
        Mass or inertia from the energy estimator [kg or kg m^2], for estimators that need one.
    log
        The measurement.
    """
    entry = entry_of(name)
    try:
        estimator = entry.make(entry.usable(task), log.kind, energy_inertia)
        estimate = estimator.fit(log)
    except StickslipError as error:
        return Fitted(why_not=_reason(error, log.name))
    assumes = entry.needs_inertia and task.inertia is None
    return Fitted(estimate=estimate, assumed_inertia=energy_inertia if assumes else None)


def _reason(error: StickslipError, log: str) -> str:
    """Return why an estimator does not apply, without the name of the log."""
    text = error.what if isinstance(error, InputError) else str(error)
    return text.removeprefix(f"{log}: ")


def inertia_of(estimate: FrictionEstimate | None) -> float | None:
    """Return the positive mass or inertia of an estimate [kg or kg m^2]; None if it has none.

    Parameters
    ----------
    estimate
        Of the energy estimator; None if it does not apply.
    """
    if estimate is None:
        return None
    for name in ("mass", "inertia"):
        parameter = estimate.parameters.get(name)
        if parameter is not None and parameter.value is not None and parameter.value > 0:
            return parameter.value
    return None
