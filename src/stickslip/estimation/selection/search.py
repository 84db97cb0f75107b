"""Forward search for the terms that a log supports."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize_scalar

from stickslip.estimation.fit.diagnostics import LEAST_SIGNAL_TO_NOISE
from stickslip.estimation.fit.rows import least_squares
from stickslip.estimation.prepare import PreparedLog
from stickslip.estimation.selection.model import (
    LARGEST_STEP,
    Model,
    smallest_ratio,
    testable,
)
from stickslip.estimation.selection.significance import (
    Basis,
    Partial,
    held_out_errors,
    significance,
)
from stickslip.estimation.selection.terms import DEAD_BAND, DELAY, SATURATION, Term, ripple_term
from stickslip.estimation.weak_form.motion import SlipMotions
from stickslip.estimation.weak_form.rows import Shape, WindowRows, window_rows
from stickslip.estimation.weak_form.windows import Weight
from stickslip.records import TermScore


@dataclass(frozen=True, kw_only=True)
class SearchTuning:
    """Tuning of the windows and of the search."""

    shortest_window: float = 0.01
    """Half of the narrowest window [s]: drives act on friction below 100 Hz."""
    fewest_samples: int = 3  #: The same in samples: the integrals over a window need them.
    widest_window: float = 0.1  #: Half of the widest window [s], which moves must outlast.
    widest_encoder_window: float = 0.15
    """Half of the widest window where noise of the positions makes most of the residual [s]."""
    largest_attenuation: float = 5e-4
    """Share of the inertia that noise of the position may take, above which windows widen [-]."""
    largest_p_value: float = 2e-3
    """p-value up to which a term is selected [-]: some ten terms give 2 % of false selections."""
    open_p_value: float = 0.1
    """p-value of a small delay [-] below which the delay that fits best is tested: a delay of many
    samples hides behind a wrong inertia."""
    unsettled_p_value: float = 1e-6
    """p-value of a delay that is not found within its bounds [-], above which it is not counted: in
    slow moves all delays fit nearly as well."""
    fewest_deviations: float = 1.0
    """Gain on moves left out of the fit, in its standard errors (one-standard-error rule) [-]."""
    smallest_gain: float = 0.02
    """The same relative to the squared error [-]: less is of no practical importance."""
    dead_band_gain: float = 0.8
    """The same for a dead band [-], whose column contains small efforts themselves: with a band
    only noise remains. 0.5 takes presliding for one in some logs; above 0.9 noise hides bands."""
    friction_beside: float = 0.5
    """Least Coulomb friction beside a dead band, over the band [-]: where friction builds up over
    much of the travel, a band takes its place."""
    smallest_share: float = 1e-3
    """Share of the effort that a term must explain [-]: errors of a sampled motion can be as
    large."""
    smallest_ratio: float = 0.015
    """Smallest over largest singular value of the columns with the term, scaled to unit norm [-]:
    below 0.01 parameters count as not identifiable, which a term must not cause."""
    reversed_viscous: float = 0.1
    """Negative viscous friction beside a bend of the curve, over that without it [-], from which
    the bend is not accepted: viscous friction that is absent is less than that by chance."""
    encoder_share: float = 0.5
    """Share of the residual's variance by noise of the positions from which windows are widened for
    it [-]: below one half, noise of the effort or a disturbance force is as large."""
    least_coverage: float = 0.8
    """Least share of the moves that wider windows must fit into, of that of narrower ones [-]."""
    most_terms: int = 6  #: Most terms in one model beyond the first four [-].
    largest_delay: float = 0.1  #: Largest delay of the effort, positive or negative [s].
    unexplained: float = 0.05
    """Unexplained share of the effort [-] from which delays are compared on a grid."""
    delay_gain: float = 0.5
    """Largest squared unexplained share with the best delay of the grid over that without it
    [-]."""
    scanned_step: float = 0.005  #: Step of that grid [s]: half of `shortest_window`.
    settled_delay: float = 0.005  #: Step of the delay below which it is found [samples].
    delay_steps: int = 40
    """Most Gauss-Newton steps to the delay [-]: noise of the effort shortens them."""
    fewest_rows: int = 20
    """Fewest windows of a log [-]: with fewer, wider ones leave too few for a fit."""
    paired: int = 4
    """Number of terms of which every pair is tried [-]: those that explain most."""
    fewest_periods: int = 3
    """Fewest periods of a ripple along the travel [-]: slower forces are springs and offsets."""
    most_periods: int = 3000
    """Most periods of a ripple along the travel [-]: bounds the memory of the search."""
    ripple_peaks: int = 2  #: Waves of the residual that are tried [-].
    ripple_share: float = 0.2
    """Share of the windows that hold one wave of the shortest ripple at most [-]: the mean over a
    faster window is close to zero."""


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

_WIDER = 1.3  # ratio of one half-width to the one before [-]


def window_weight(log: PreparedLog, motions: SlipMotions, tuning: SearchTuning) -> Weight:
    """Return the weight of the windows of a log, for its kind of effort."""
    return Weight(
        half_width=half_width(motions, log.sampling_time, tuning),
        sampling_time=log.sampling_time,
        lead=log.effort_lead,
        averaged=log.averaged_effort,
    )


def half_width(motions: SlipMotions, sampling_time: float, tuning: SearchTuning) -> int:
    """Return half of the width of windows that is wide enough for the noise of the positions.

    Noise of the position is noise of a regressor, worst at high frequencies. It attenuates the
    inertia by its share of the acceleration beyond the other columns and the position. If it also
    makes most of the residual, wider windows have smaller errors, as long as they cover the moves.
    """
    half = max(tuning.fewest_samples, round(tuning.shortest_window / sampling_time))
    quiet = 0.0  # time that the narrowest windows without attenuation cover
    kept = 0  # half of the widest of those that cover as much
    while True:
        weight = Weight(half_width=half, sampling_time=sampling_time)
        model = Model(rows=window_rows(motions.stretches, weight), inertia=None)
        wider = int(_WIDER * half) + 1
        if model.rows.size < tuning.fewest_rows:
            return kept or half
        # With a spring: in a sinusoidal motion its column is that of the inertia
        beside = np.column_stack([model.base()[:, 1:], model.rows.position])
        content = float(np.sum(Basis.of(beside, model.rows.acceleration).residual ** 2))
        noise = motions.noise_of(weight.second())
        if model.rows.size * noise**2 <= tuning.largest_attenuation * content:
            covered = model.rows.size * weight.duration
            quiet = quiet or covered
            if covered < tuning.least_coverage * quiet:
                return kept
            if not _encoder_bound(model, noise, tuning):
                return half
            kept = half
        widest = tuning.widest_encoder_window if quiet else tuning.widest_window
        if wider * sampling_time > widest:
            return half
        half = wider


def scanned_delay(plain: Model, found: Model, tuning: SearchTuning) -> float:
    """Return the delay at which the plain model explains much more than the one found [samples].

    0 if there is none. Over many samples the effort is not linear in the delay: the Gauss-Newton
    steps then converge to another delay, or do not converge.
    """
    left = _left(found if found.settled else plain)
    if left < tuning.unexplained**2:
        return 0.0
    steps = round(tuning.largest_delay / tuning.scanned_step)
    step = tuning.scanned_step / plain.rows.weight.sampling_time
    delays = [step * k for k in range(-steps, steps + 1) if k]
    trials = [(_left(plain.shifted(delay)), delay) for delay in delays]
    least, delay = min(trials)
    return delay if least < tuning.delay_gain * left else 0.0


def _left(model: Model) -> float:
    """Return the unexplained share of the squared effort [-]; 1 if the model is not testable."""
    return model.residual_share() ** 2 if testable(model) else 1.0


def noisy_elasticity(rows: WindowRows, motions: SlipMotions) -> bool:
    """Return whether the fourth derivative of the position is mostly noise."""
    noise = motions.noise_of(rows.weight.fourth())
    return float(np.sqrt(np.mean(rows.snap**2))) < LEAST_SIGNAL_TO_NOISE * noise


def _encoder_bound(model: Model, noise: float, tuning: SearchTuning) -> bool:
    """Return whether noise of the positions makes most of the residual of the plain model.

    ``model`` has no terms; ``noise`` is that of an acceleration [m/s^2 or rad/s^2].
    """
    base, target = model.base(), model.target()
    values = least_squares(base, target)
    left = float(np.sum((target - base @ values) ** 2))
    return bool(model.rows.size * (values[0] * noise) ** 2 > tuning.encoder_share * left)


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
        tried = [_tried(model, term, basis, columns, errors, tuning) for term in candidates]
        tried = [trial for trial in tried if trial is not None]
        others = tuple(trial.score for trial in tried)
        accepted = [trial for trial in tried if _accepted(trial, tuning)]
        accepted = [trial for trial in accepted if not _reverses_viscous(model, trial, tuning)]
        added = (_simplest(accepted),) if accepted else _pair(model, tried, tuning)
        if not added:
            return replace(model, scores=(*found, *others))
        found += [replace(trial.score, selected=True) for trial in added]
        for trial in added:
            model = refined(_with(model, trial))
            if trial.term.name == "two-thirds":
                model = _without_viscous(model, tuning)
            if DELAY in model.names:
                model = _settled(model, tuning)
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
            if _ratio(model, term, fits[0], tuning) < tuning.smallest_ratio:
                continue
            model = refined(replace(model, chosen=(*model.chosen, (term, fits[0]))))
            if DELAY in model.names:
                model = _settled(model, tuning)
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
    return [*offered, *_ripples(model, basis, tuning)] if ripple else offered


def _without_viscous(model: Model, tuning: SearchTuning) -> Model:
    """Return the model without viscous friction, unless that is significant in it."""
    without = replace(model, viscous=False)
    basis = without.basis()
    partial = basis.partial(model.scaled(model.rows.velocity[:, None]))
    if partial is None or significance(basis, partial) > tuning.largest_p_value:
        return without
    return model


@dataclass(frozen=True, kw_only=True)
class _Trial:
    """A term that was tried, in its best shape."""

    term: Term
    shape: Shape
    score: TermScore
    ratio: float

    @property
    def parameters(self) -> int:
        """Number of coefficients, with that of the shape."""
        return len(self.shape.names) + (self.term.family is not None)


def _tried(
    model: Model,
    term: Term,
    basis: Basis,
    columns: Float[np.ndarray, "n p"],
    errors: Float[np.ndarray, " folds"],
    tuning: SearchTuning,
) -> _Trial | None:
    """Return the best shape of a term with its score; None if no shape has the right sign."""
    best = best_shape(model, term, basis)
    if best is None:
        return None
    shape, partial = best
    own = model.term_columns(term, shape)
    p_value = significance(basis, partial, own)
    if term.name == DELAY and p_value < tuning.open_p_value:
        delayed = _settled(replace(model, chosen=(*model.chosen, (term, shape))), tuning)
        trial = _tried_delay(model, delayed, tuning) if testable(delayed) else None
        certain = trial is not None and trial.score.p_value < tuning.unsettled_p_value
        return trial if delayed.settled or certain else None
    more, folds = np.column_stack([columns, own]), model.rows.folds
    gains = errors - held_out_errors(more, basis.target, folds)
    if term.name == DEAD_BAND:
        banded = replace(model, chosen=(*model.chosen, (term, shape)))
        least = tuning.friction_beside * float(banded.coefficients(DEAD_BAND)[0])
        gain = float(np.sum(gains)) / max(float(np.sum(errors)), np.finfo(float).tiny)
        if gain < tuning.dead_band_gain or banded.friction()[0] < least:
            return None
    ratio = _ratio(model, term, shape, tuning)
    return _scored(term, shape, ratio, basis.share(partial), p_value, errors, gains)


def _tried_delay(model: Model, delayed: Model, tuning: SearchTuning) -> _Trial | None:
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
    ratio = _ratio(fixed, term, shape, tuning)
    return _scored(term, shape, ratio, basis.share(partial), p_value, errors, gains)


def _ratio(model: Model, term: Term, shape: Shape, tuning: SearchTuning) -> float:
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
    return _ratio(replace(model, offset=False), term, shape, tuning)


def _scored(
    term: Term,
    shape: Shape,
    ratio: float,
    share: float,
    p_value: float,
    errors: Float[np.ndarray, " folds"],
    gains: Float[np.ndarray, " folds"],
) -> _Trial:
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
    return _Trial(term=term, shape=shape, score=score, ratio=ratio)


def _simplest(accepted: Sequence[_Trial]) -> _Trial:
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


def _pair(model: Model, tried: Sequence[_Trial], tuning: SearchTuning) -> tuple[_Trial, ...]:
    """Return two terms of which each is accepted beside the other; none if there are no such two.

    Two missing terms hide each other: the effect of one is noise in the test of the other.
    """
    large = [
        t for t in tried if t.score.share > tuning.smallest_share and t.term.name != SATURATION
    ]
    large = sorted(large, key=lambda trial: trial.score.share)[-tuning.paired :]
    best: tuple[_Trial, ...] = ()
    for first, second in combinations(large, 2):
        if second.term.name in EXCLUSIVE.get(first.term.name, ()):
            continue
        pair = (_beside(model, second, first, tuning), _beside(model, first, second, tuning))
        accepted = [trial for trial in pair if trial is not None and _accepted(trial, tuning)]
        if len(accepted) == 2 and (not best or _gain(accepted) > _gain(best)):
            best = tuple(accepted)
    return best


def _gain(pair: Sequence[_Trial]) -> float:
    return min(trial.score.gain for trial in pair)


def _beside(model: Model, other: _Trial, trial: _Trial, tuning: SearchTuning) -> _Trial | None:
    """Return a term as tried in a model with another one."""
    larger = _with(model, other)
    columns, target = larger.columns(), larger.target()
    errors = held_out_errors(columns, target, larger.rows.folds)
    return _tried(larger, trial.term, larger.basis(), columns, errors, tuning)


def _with(model: Model, trial: _Trial) -> Model:
    return replace(model, chosen=(*model.chosen, (trial.term, trial.shape)))


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


def _reverses_viscous(model: Model, trial: _Trial, tuning: SearchTuning) -> bool:
    """Return whether viscous friction is negative beside a term that bends the friction curve.

    Such a bend replaces another one, as friction with the square of the speed does for the Stribeck
    effect.
    """
    if trial.term.name not in _BESIDE_VISCOUS or not model.viscous:
        return False
    least = -tuning.reversed_viscous * abs(model.friction()[1])
    return _with(model, trial).friction()[1] < least


def _accepted(trial: _Trial, tuning: SearchTuning) -> bool:
    score = trial.score
    return (
        trial.ratio > tuning.smallest_ratio
        and score.p_value < tuning.largest_p_value
        and score.gain > max(tuning.fewest_deviations * score.gain_std, tuning.smallest_gain)
        and score.share > tuning.smallest_share
    )


_SHAPE_STEPS = 15
"""Most evaluations in the search of a shape [-]: enough for the tolerance between neighbours."""

_SHAPE_TOLERANCE = 1e-3  # of the logarithm of a shape's value [-]: far below its standard error

_RIPPLE_SPAN = 0.5
"""Change of the waves along the travel within which a period is refined [-]: another peak of the
spectrum begins beyond it."""

_BEYOND_LAST = 2.0
"""Ratio up to which a shape may exceed the largest one that was tried [-]."""


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
        trial = changed(logarithm)
        columns, target = trial.columns(), trial.target()
        return float(np.sum((target - columns @ least_squares(columns, target)) ** 2))

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


_SLOWEST = 0.98
"""Ratio of one Gauss-Newton step to the one before up to which the steps are extrapolated [-]:
above it the extrapolation is longer than 49 steps, and uncertain."""

_FARTHEST = 5.0
"""Longest extrapolation over the largest step [-]: 15 samples, over which the effort may turn."""


def _settled(model: Model, tuning: SearchTuning) -> Model:
    """Return the model at the delay that fits best (Gauss-Newton).

    Noise of the effort shortens all steps by the same factor. Two of them therefore give the delay
    that they converge to (Aitken's extrapolation).
    """
    before: Float[np.ndarray, " k"] | None = None
    for _ in range(tuning.delay_steps):
        start = model.delays
        model, step = model.stepped(tuning.largest_delay)
        if step < tuning.settled_delay:
            return replace(model, settled=True)
        change = model.delays - start
        if before is None:
            before = change
            continue
        ratio = np.divide(change, before, out=np.zeros(change.size), where=before != 0.0)
        slow = (ratio > 0.0) & (ratio < _SLOWEST) & (np.abs(before) < LARGEST_STEP)
        ahead = np.where(slow, change * ratio / (1.0 - np.where(slow, ratio, 0.0)), 0.0)
        ahead = np.clip(ahead, -_FARTHEST * LARGEST_STEP, _FARTHEST * LARGEST_STEP)
        model, before = model.with_delays(model.delays + ahead), None
    return replace(model, settled=False)


_FEWEST_RIPPLE_ROWS = 50
"""Fewest windows for the search of a ripple [-]: among many waves, one fits the noise of fewer."""


def _ripples(model: Model, basis: Basis, tuning: SearchTuning) -> list[Term]:
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
