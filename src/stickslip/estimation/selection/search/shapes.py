"""Shapes of the terms: the best of a family, and the ripples that a residual shows."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from stickslip.estimation.selection.model import Model
from stickslip.estimation.selection.search.tuning import SearchTuning
from stickslip.estimation.selection.significance import Basis, Partial
from stickslip.estimation.selection.terms import Term, ripple_term
from stickslip.estimation.weak_form.rows import Shape

_SHAPE_STEPS = 15
"""Most evaluations in the search of a shape [-]: enough for the tolerance between neighbours."""

_SHAPE_TOLERANCE = 1e-3  # of the logarithm of a shape's value [-]: far below its standard error

_RIPPLE_SPAN = 0.5
"""Change of the waves along the travel within which a period is refined [-]: another peak of the
spectrum begins beyond it."""

_BEYOND_LAST = 2.0
"""Ratio up to which a shape may exceed the largest one that was tried [-]."""

_FEWEST_RIPPLE_ROWS = 50
"""Fewest windows for the search of a ripple [-]: among many waves, one fits the noise of fewer."""


def best_shape(model: Model, term: Term, basis: Basis) -> tuple[Shape, Partial] | None:
    """Return the shape that explains most; None if no shape has coefficients within its bounds."""
    best: tuple[Shape, Partial] | None = None
    largest = -1.0
    for shape in term.shapes:
        partial = basis.partial(model.term_columns(term, shape))
        if partial is None or not shape.allows(partial.values):
            continue
        explained = float(np.sum(partial.coordinates**2))
        if explained > largest:
            largest, best = explained, (shape, partial)
    return best


def refined(model: Model) -> Model:
    """Return the model with the shapes of its terms between those that were tried."""
    for place, (term, _) in enumerate(model.chosen):
        if term.family is not None:
            model = _refined_term(model, place, term.family)
        if term.proportional is not None:
            shape = term.proportional(*model.friction())
            chosen = (*model.chosen[:place], (term, shape), *model.chosen[place + 1 :])
            model = replace(model, chosen=chosen)
    return model


def _refined_term(model: Model, place: int, family: Callable[[float], Shape]) -> Model:
    """Return the model with the best value of one term's shape near the present one."""
    term, shape = model.chosen[place]

    def changed(logarithm: float) -> Model:
        chosen = list(model.chosen)
        chosen[place] = (term, family(float(np.exp(logarithm))))
        return replace(model, chosen=tuple(chosen))

    def left(logarithm: float) -> float:
        return float(np.sum(changed(logarithm).residual() ** 2))

    low, high = _around(model, term, shape)
    found = minimize_scalar(
        left,
        bounds=(float(np.log(low)), float(np.log(high))),
        method="bounded",
        options={"maxiter": _SHAPE_STEPS, "xatol": _SHAPE_TOLERANCE},
    )
    return changed(float(found.x)) if found.fun < left(float(np.log(shape.value))) else model


def _around(model: Model, term: Term, shape: Shape) -> tuple[float, float]:
    """Return the bounds of the search for the best shape of a family [SI]."""
    if term.name == "ripple":
        wave = 1.0 / shape.value
        half = _RIPPLE_SPAN / float(np.ptp(model.rows.position))
        return 1.0 / (wave + half), 1.0 / max(wave - half, 0.5 * wave)
    values = [other.value for other in term.shapes]
    ratio = values[1] / values[0]
    longer = ratio if shape.value < values[-1] else _BEYOND_LAST
    return max(shape.value / ratio, values[0]), shape.value * longer


def ripples(model: Model, basis: Basis, tuning: SearchTuning) -> list[Term]:
    """Return the term of the strongest waves of the residual along the travel."""
    place = model.rows.position - np.min(model.rows.position)
    extent = float(np.max(place))
    if extent == 0 or place.size < _FEWEST_RIPPLE_ROWS:
        return []
    # The mean over a window of one wave, the shortest in the search, has 0.6 of its amplitude
    slow = float(np.quantile(np.abs(model.rows.velocity), tuning.ripple_share))
    width = 2.0 * model.rows.weight.duration * slow
    most = min(tuning.most_periods, int(extent / max(width, extent / tuning.most_periods)))
    if most <= tuning.fewest_periods:
        return []
    # Quarters of a wave along the travel, from residuals summed over bins of an eighth of a wave
    bins = 8 * most
    at = np.minimum((place * (bins / extent)).astype(int), bins - 1)
    spectrum = np.fft.rfft(np.bincount(at, basis.residual, minlength=bins), 4 * bins)
    power = np.abs(spectrum[4 * tuning.fewest_periods : 4 * most]) ** 2
    if power.size < 3:
        return []
    peaks = np.flatnonzero((power[1:-1] > power[:-2]) & (power[1:-1] >= power[2:])) + 1
    strongest = peaks[np.argsort(power[peaks])[::-1][: tuning.ripple_peaks]]
    if strongest.size == 0:
        return []
    waves = tuning.fewest_periods + 0.25 * strongest
    # The peaks are the largest of all the waves that the travel resolves
    return [ripple_term((extent / waves).tolist(), power.size // 4, model.origin)]
