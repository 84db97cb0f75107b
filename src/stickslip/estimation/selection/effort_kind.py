"""Kind of a logged effort that a log shows: held, sampled, or a mean."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from stickslip.estimation.prepare import PreparedLog, prepare
from stickslip.estimation.selection.intervals.widening import delayed_rows
from stickslip.estimation.selection.model import Model, testable
from stickslip.estimation.selection.model_rows import model_rows
from stickslip.estimation.selection.search.windows import half_width
from stickslip.estimation.selection.summary import EFFORT_KINDS
from stickslip.estimation.selection.tuning import SelectionTuning
from stickslip.estimation.weak_form.motion import SlipMotions, slip_motions
from stickslip.records import AxisLog, mass_name

DelayedModel = Callable[[PreparedLog, SlipMotions], Model]
"""Returns the model of a log with no term but a delay, unless that is known or excluded."""


def kind_by_residual(
    log: AxisLog, held: PreparedLog, delayed: DelayedModel, tuning: SelectionTuning
) -> PreparedLog:
    """Return a log with uneven time stamps, with the kind of effort of the smallest residual."""

    def residual(prepared: PreparedLog) -> float:
        model = delayed(prepared, slip_motions(prepared, tuning.motion))
        return model.residual_share() if testable(model) else np.inf

    others = [prepare(log, effort_kind=kind) for kind in ("sampled", "mean")]
    without, *residuals = [residual(each) for each in (held, *others)]
    left = min(residuals)
    best = others[residuals.index(left)]
    if not left < (1.0 - tuning.effort_kind_gain) * without:
        return held
    note = (
        f"the effort is taken for {EFFORT_KINDS[best.effort_kind]}: with uneven time stamps "
        f"this leaves {100 * left:.3g} % of it unexplained instead of {100 * without:.3g} %"
    )
    return replace(best, notes=(*best.notes, note))


def kind_by_delay(
    log: AxisLog, held: PreparedLog, delayed: DelayedModel, tuning: SelectionTuning
) -> PreparedLog:
    """Return a log with even time stamps, with the kind of effort that the delay shows.

    Taken as held, a sampled effort acts half a sample before its time stamp, and a mean one a
    sample. The kind remains held where the slope of the effort is nearly a combination of the other
    columns: the delay then depends on missing terms.
    """
    T, fewest = held.sampling_time, tuning.fewest_samples
    if round(tuning.search.shortest_window / T) >= fewest:
        return held
    motions = slip_motions(held, tuning.motion)
    if half_width(motions, T, tuning.search) >= fewest:
        return held
    model = delayed(held, motions)
    slope = delayed_rows(model, model_rows(model, mass_name(log.kind)))
    if slope.independent < tuning.intervals.similar_share:
        return held
    delay = model.rows.delay
    if abs(delay + 0.5) < tuning.kind_delay:
        found = replace(held, effort_kind="sampled")
    elif abs(delay + 1.0) < tuning.kind_delay:
        found = prepare(log, effort_kind="mean")
    else:
        return held
    note = (
        f"the effort is taken for {EFFORT_KINDS[found.effort_kind]}: held to the next one, it "
        f"would act {-1e3 * T * delay:.3g} ms before it is logged"
    )
    return replace(found, notes=(*found.notes, note))
