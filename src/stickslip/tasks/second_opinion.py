"""Check of an estimate without a model selection against the one with it."""

from dataclasses import replace

from stickslip.estimation import SelectedModelEstimator
from stickslip.estimation.base import EstimationTask
from stickslip.estimation.selection.judgement.status import judged
from stickslip.records import (
    FrictionEstimate,
    Identification,
    InputError,
    Status,
    in_words,
    unit_text,
)

_LEAST_DIFFERENCE = 0.02
"""Smallest relative difference of two values that matters [-], that of an offset relative to the
Coulomb friction: data sheets are as exact."""


def checked(found: Identification, task: EstimationTask) -> Identification:
    """Return an identification, with another status if it is `ok` and the default one contradicts.

    The default estimator tests for a delay of the effort, for missing terms of the force and for
    wrong units; the others take their model for true. Two estimates contradict each other if each
    value is outside the interval of the other. The identification is of one log of a rigid axis, by
    another estimator than the default one.
    """
    if found.estimate.status is not Status.OK:
        return found
    selecting = SelectedModelEstimator(inertia=task.inertia, effort_kind=task.effort_kind)
    try:
        other = selecting.fit(found.log)
    except InputError:
        return found
    cause = ""
    if other.status is Status.MODEL_MISMATCH:
        cause = f"the default estimator reports: {other.diagnostics.notes[0]}"
    elif other.status.trusted:
        cause = _contradiction(found.estimate, other)
    return replace(found, estimate=judged(found.estimate, [cause] if cause else []))


def _contradiction(estimate: FrictionEstimate, other: FrictionEstimate) -> str:
    """Return the first value that the other estimate contradicts, in a sentence; empty if none."""
    terms = other.selection.summary if other.selection is not None else ""
    coulomb = other.parameters.get("coulomb_friction")
    for name, own in estimate.parameters.items():
        its = other.parameters.get(name)
        if its is None or own.ci95 is None or its.ci95 is None:
            continue
        scale = coulomb if name == "offset" and coulomb is not None else its
        if own.value is None or its.value is None or scale.value is None:
            continue
        small = abs(own.value - its.value) <= _LEAST_DIFFERENCE * abs(scale.value)
        if small or not (_outside(own.value, its.ci95) and _outside(its.value, own.ci95)):
            continue
        unit = unit_text(its.unit)
        return (
            f"the default estimator finds {in_words(name)} of {its.value:.4g} {unit} (95 %: "
            f"{its.ci95[0]:.4g} to {its.ci95[1]:.4g}), this one {own.value:.4g} {unit} "
            f"({own.ci95[0]:.4g} to {own.ci95[1]:.4g}); use the default one, or compare them. "
            f"{terms}".strip()
        )
    return ""


def _outside(value: float, interval: tuple[float, float]) -> bool:
    return not interval[0] <= value <= interval[1]
