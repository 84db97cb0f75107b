"""Status of an estimate, and notes on terms that its model lacks or a log does not determine."""

from collections.abc import Collection, Sequence
from dataclasses import replace

from stickslip.estimation.prepare import PreparedLog
from stickslip.estimation.selection.faults.change import sudden_change
from stickslip.estimation.selection.faults.nonlinear_gain import nonlinear_gain
from stickslip.estimation.selection.judgement.plausibility import (
    PlausibilityTuning,
    coarse_effort,
    reversed_sign,
    too_slow_sampling,
    unexplained_effort,
    unsigned_effort,
    wrong_model,
)
from stickslip.estimation.selection.model import Model
from stickslip.estimation.selection.model_rows import ModelRows
from stickslip.estimation.selection.terms import DWELL
from stickslip.estimation.selection.tuning import SelectionTuning
from stickslip.estimation.weak_form.motion import SlipMotions
from stickslip.records import AxisLog, FrictionEstimate, Status, mass_name


def causes_of_fit(
    log: PreparedLog,
    motions: SlipMotions,
    model: Model,
    rows: ModelRows,
    estimate: FrictionEstimate,
    tuning: SelectionTuning,
    start: float = 0.0,
) -> list[str]:
    """Return the causes of a mismatch that the fit of one log shows; empty where there is none.

    The estimate may be that of several logs. ``start`` is the time in the log from which that of
    the model is counted [s].
    """
    plausible, unit = tuning.plausibility, log.log.unit("effort")
    return [
        too_slow_sampling(log, motions, plausible),
        unexplained_effort(log.log, motions, model, rows, plausible),
        coarse_effort(model, motions, unit, plausible),
        wrong_model(model, plausible),
        sudden_change(model, tuning.change, start),
        nonlinear_gain(model, estimate, tuning.gain),
    ]


def with_status(
    estimate: FrictionEstimate,
    log: AxisLog,
    driven: SlipMotions,
    model: Model,
    causes: Sequence[str],
    tuning: PlausibilityTuning,
) -> FrictionEstimate:
    """Return the estimate with the status that the causes of a mismatch give it.

    ``driven`` is the motion with the samples in which the drive saturates.
    """
    if estimate.status is Status.UNPHYSICAL:
        reverse = reversed_sign(model, mass_name(log.kind), tuning)
        estimate = judged(estimate, [reverse] if reverse else [], Status.UNPHYSICAL)
    estimate = judged(estimate, [cause for cause in causes if cause])
    if not estimate.status.trusted:
        unsigned = unsigned_effort(log, driven, tuning)
        estimate = judged(estimate, [unsigned] if unsigned else [], estimate.status)
    return estimate


def lacking_terms(selected: Model, include: Sequence[str]) -> str:
    """Return which terms of a selected model are not included; empty if none."""
    texts = [term.text for term, _ in selected.chosen if term.name not in include]
    if not texts:
        return ""
    return (
        "terms were not selected, and the log shows that the model lacks some "
        f"({'; '.join(texts)}); let them be selected, or include them"
    )


def judged(
    estimate: FrictionEstimate,
    causes: Sequence[str],
    status: Status = Status.MODEL_MISMATCH,
) -> FrictionEstimate:
    """Return the estimate with the causes of a mismatch, the most serious first.

    No causes leave the estimate as it is.
    """
    if not causes:
        return estimate
    diagnostics = replace(estimate.diagnostics, notes=(*causes, *estimate.diagnostics.notes))
    return replace(estimate, status=status, diagnostics=diagnostics)


def undetermined_terms(model: Model, include: Collection[str], subject: str) -> list[str]:
    """Return a note for each included term that the model does not have.

    ``subject`` begins the reason: "this log does not determine it, or gives".
    """
    return [
        f"the term {name!r} is left out: {subject} its coefficient the wrong sign"
        for name in include
        if name not in {*model.names, DWELL}
    ]
