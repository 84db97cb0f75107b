"""Forward search for the terms that a log supports."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

from stickslip.estimation.selection.model import Model, testable
from stickslip.estimation.selection.search.delay import settled
from stickslip.estimation.selection.search.shapes import best_shape, refined, ripples
from stickslip.estimation.selection.search.trial import Trial, conditioning, tried_term
from stickslip.estimation.selection.search.tuning import SearchTuning
from stickslip.estimation.selection.significance import Basis, held_out_errors, significant_value
from stickslip.estimation.selection.terms import DELAY, SATURATION, Term
from stickslip.records import TermScore

EXCLUSIVE = {
    "two-thirds": ("quadratic", "direction", "stribeck", "low speed"),
    "quadratic": ("two-thirds",),
    "direction": ("two-thirds",),
    "stribeck": ("two-thirds", "low speed"),
    "low speed": ("two-thirds", "stribeck"),
}
"""Terms that are not tried beside a selected one: two bends of one curve."""

BENDS = ("quadratic", "two-thirds", "stribeck", "low speed")
"""Terms that bend the friction curve, of which one can stand for another."""

_BESIDE_VISCOUS = ("quadratic", "stribeck", "low speed")  # friction with the 2/3 power replaces it


def search(
    model: Model, terms: Sequence[Term], tuning: SearchTuning, *, ripple: bool = True
) -> Model:
    """Add terms one by one, the best first, as long as they are significant and predict better.

    ``ripple``: whether to look for forces that repeat along the travel.
    """
    found: list[TermScore] = []
    while len(model.chosen) < tuning.most_terms:
        if not testable(model):
            break
        columns, target = model.columns(), model.target()
        basis = model.basis()
        errors = held_out_errors(columns, target, model.rows.folds)
        taken = {name for chosen in model.names for name in (chosen, *EXCLUSIVE.get(chosen, ()))}
        candidates = [
            term
            for term in _offered(model, terms, basis, tuning, ripple=ripple)
            if term.name not in taken
        ]
        tried = [tried_term(model, term, basis, columns, errors, tuning) for term in candidates]
        tried = [trial for trial in tried if trial is not None]
        others = tuple(trial.score for trial in tried)
        accepted = [trial for trial in tried if trial.accepted(tuning)]
        accepted = [trial for trial in accepted if not _reverses_viscous(model, trial, tuning)]
        added = (_simplest(accepted),) if accepted else _pair(model, tried, tuning)
        if not added:
            return replace(model, scores=(*found, *others))
        found += [replace(trial.score, selected=True) for trial in added]
        for trial in added:
            model = refined(model.with_term(trial.term, trial.shape))
            if trial.term.name == "two-thirds":
                model = _without_viscous(model, tuning)
            if DELAY in model.names:
                model = settled(model, tuning)
        if SATURATION in model.names:
            break
    return replace(model, scores=tuple(found))


def with_terms(
    model: Model, terms: Sequence[Term], names: Sequence[str], tuning: SearchTuning
) -> Model:
    """Return the model with given terms, each in the shape that fits best.

    Terms that the motion does not determine are left out.
    """
    for name in names:
        basis = model.basis()
        offered = _offered(model, terms, basis, tuning, ripple=True)
        term = next((term for term in offered if term.name == name), None)
        fits = None if term is None else best_shape(model, term, basis)
        if term is not None and fits is not None:
            if conditioning(model, term, fits[0], tuning) < tuning.smallest_ratio:
                continue
            model = refined(model.with_term(term, fits[0]))
            if DELAY in model.names:
                model = settled(model, tuning)
    return model


def _offered(
    model: Model, terms: Sequence[Term], basis: Basis, tuning: SearchTuning, *, ripple: bool
) -> Sequence[Term]:
    """Return the terms, with the shapes that depend on the fit of the model."""
    offered = [
        term
        if term.proportional is None
        else replace(term, shapes=(term.proportional(*model.friction()),))
        for term in terms
    ]
    return [*offered, *ripples(model, basis, tuning)] if ripple else offered


def _without_viscous(model: Model, tuning: SearchTuning) -> Model:
    """Return the model without viscous friction, unless that is significant and positive in it."""
    without = replace(model, viscous=False)
    basis = without.basis()
    partial = basis.partial(model.scaled(model.rows.velocity[:, None]))
    kept = significant_value(basis, partial, tuning.largest_p_value)
    return without if kept is None or kept < 0.0 else model


def _simplest(accepted: Sequence[Trial]) -> Trial:
    """Return the term with the largest gain, or a bend with fewer parameters that predicts as well.

    A bend predicts as well if its gain is within one standard error of the largest gain.
    """
    best = max(accepted, key=lambda trial: trial.score.gain)
    if best.term.name not in BENDS:
        return best
    least = best.score.gain - best.score.gain_std
    simpler = [
        trial for trial in accepted if trial.term.name in BENDS and trial.score.gain >= least
    ]
    return min(simpler, key=lambda trial: (trial.parameters, -trial.score.gain))


def _pair(model: Model, tried: Sequence[Trial], tuning: SearchTuning) -> tuple[Trial, ...]:
    """Return two terms of which each is accepted beside the other; none if there are no such two.

    Two missing terms hide each other: the effect of one is noise in the test of the other.
    """
    large = [
        t for t in tried if t.score.share > tuning.smallest_share and t.term.name != SATURATION
    ]
    large = sorted(large, key=lambda trial: trial.score.share)[-tuning.paired :]
    best: tuple[Trial, ...] = ()
    for first, second in combinations(large, 2):
        if second.term.name in EXCLUSIVE.get(first.term.name, ()):
            continue
        pair = (_beside(model, second, first, tuning), _beside(model, first, second, tuning))
        accepted = [trial for trial in pair if trial is not None and trial.accepted(tuning)]
        if len(accepted) == 2 and (not best or _gain(accepted) > _gain(best)):
            best = tuple(accepted)
    return best


def _gain(pair: Sequence[Trial]) -> float:
    return min(trial.score.gain for trial in pair)


def _beside(model: Model, other: Trial, trial: Trial, tuning: SearchTuning) -> Trial | None:
    """Return a term as tried in a model with another one."""
    larger = model.with_term(other.term, other.shape)
    columns, target = larger.columns(), larger.target()
    errors = held_out_errors(columns, target, larger.rows.folds)
    return tried_term(larger, trial.term, larger.basis(), columns, errors, tuning)


def _reverses_viscous(model: Model, trial: Trial, tuning: SearchTuning) -> bool:
    """Return whether viscous friction is negative beside a term that bends the friction curve.

    Such a bend replaces another one, as friction with the square of the speed does for the Stribeck
    effect.
    """
    if trial.term.name not in _BESIDE_VISCOUS or not model.viscous:
        return False
    least = -tuning.reversed_viscous * abs(model.friction()[1])
    return model.with_term(trial.term, trial.shape).friction()[1] < least
