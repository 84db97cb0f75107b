"""Trials of a term in a model: its best shape, its significance and how well it predicts."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.selection.model import Model, smallest_ratio, testable
from stickslip.estimation.selection.search.delay import settled
from stickslip.estimation.selection.search.shapes import best_shape
from stickslip.estimation.selection.search.tuning import SearchTuning
from stickslip.estimation.selection.significance import Basis, held_out_errors, significance
from stickslip.estimation.selection.terms import DEAD_BAND, DELAY, Term
from stickslip.estimation.weak_form.rows import Shape
from stickslip.records import TermScore


@dataclass(frozen=True, kw_only=True)
class Trial:
    """A term that was tried, in its best shape."""

    term: Term
    shape: Shape
    score: TermScore
    ratio: float

    @property
    def parameters(self) -> int:
        """Number of coefficients, with that of the shape."""
        return len(self.shape.names) + (self.term.family is not None)

    def accepted(self, tuning: SearchTuning) -> bool:
        """Return whether the term is determined, significant, and predicts better."""
        score = self.score
        return (
            self.ratio > tuning.smallest_ratio
            and score.p_value < tuning.largest_p_value
            and score.gain > max(tuning.fewest_deviations * score.gain_std, tuning.smallest_gain)
            and score.share > tuning.smallest_share
        )


def tried_term(
    model: Model,
    term: Term,
    basis: Basis,
    columns: Float[np.ndarray, "n p"],
    errors: Float[np.ndarray, " folds"],
    tuning: SearchTuning,
) -> Trial | None:
    """Return the best shape of a term with its score; None if no shape has the right sign."""
    best = best_shape(model, term, basis)
    if best is None:
        return None
    shape, partial = best
    own = model.term_columns(term, shape)
    p_value = significance(basis, partial, own)
    if term.name == DELAY and p_value < tuning.open_p_value:
        delayed = settled(model.with_term(term, shape), tuning)
        trial = _tried_delay(model, delayed, tuning) if testable(delayed) else None
        certain = trial is not None and trial.score.p_value < tuning.unsettled_p_value
        return trial if delayed.settled or certain else None
    more, folds = np.column_stack([columns, own]), model.rows.folds
    gains = errors - held_out_errors(more, basis.target, folds)
    ratio = conditioning(model, term, shape, tuning)
    trial = _scored(term, shape, ratio, basis.share(partial), p_value, errors, gains)
    if term.name == DEAD_BAND:
        banded = model.with_term(term, shape)
        least = tuning.friction_beside * float(banded.coefficients(DEAD_BAND)[0])
        if trial.score.gain < tuning.dead_band_gain or banded.friction()[0] < least:
            return None
    return trial


def _tried_delay(model: Model, delayed: Model, tuning: SearchTuning) -> Trial | None:
    """Return the score of a delay, tested where it fits best.

    The coefficient of the effort's slope there is the change of the delay. None if the slope
    depends on the other columns.

    ``model`` has no such term; ``delayed`` has it at the delay that fits best.
    """
    term, shape = delayed.chosen[-1]
    own = delayed.term_columns(term, shape)
    fixed = replace(delayed, chosen=model.chosen)
    target = fixed.target() + own @ (delayed.delays - model.delays)
    basis = Basis.of(fixed.columns(), target, fixed.rows.log)
    partial = basis.partial(own)
    if partial is None:
        return None
    before = fixed.with_delays(model.delays)
    errors = held_out_errors(before.columns(), before.target(), before.rows.folds)
    gains = errors - held_out_errors(delayed.columns(), delayed.target(), delayed.rows.folds)
    p_value = significance(basis, partial, own)
    ratio = conditioning(fixed, term, shape, tuning)
    return _scored(term, shape, ratio, basis.share(partial), p_value, errors, gains)


def conditioning(model: Model, term: Term, shape: Shape, tuning: SearchTuning) -> float:
    """Return the smallest over the largest singular value of the columns with a term.

    In a motion in one direction offset and Coulomb friction have the same column. The offset is
    left out then: the term is determined nevertheless.
    """
    every = np.column_stack([model.columns(), model.term_columns(term, shape)])
    if term.name == "two-thirds":  # it may replace viscous friction
        every = np.delete(every, 0 if model.inertia is not None else 1, axis=1)
    ratio = smallest_ratio(every)
    determined = ratio >= tuning.smallest_ratio or not model.offset
    if determined or smallest_ratio(model.columns()) >= tuning.smallest_ratio:
        return ratio
    return conditioning(replace(model, offset=False), term, shape, tuning)


def _scored(
    term: Term,
    shape: Shape,
    ratio: float,
    share: float,
    p_value: float,
    errors: Float[np.ndarray, " folds"],
    gains: Float[np.ndarray, " folds"],
) -> Trial:
    """Return the score of a term, from the errors on rows left out of the fit."""
    total = max(float(np.sum(errors)), np.finfo(float).tiny)
    score = TermScore(
        term=term.name,
        text=term.text,
        selected=False,
        # One of several shapes is significant by chance more often (Bonferroni)
        p_value=min(p_value * term.trials, 1.0),
        gain=float(np.sum(gains)) / total,
        gain_std=float(np.std(gains, ddof=1)) * float(np.sqrt(gains.size)) / total,
        share=share,
    )
    return Trial(term=term, shape=shape, score=score, ratio=ratio)
