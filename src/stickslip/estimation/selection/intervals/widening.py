"""Errors of a selected model beyond the sampling error, which widen the intervals."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.special import chdtri

from stickslip.estimation.fit.rows import least_squares
from stickslip.estimation.selection.model import Model, smallest_ratio, testable
from stickslip.estimation.selection.model_rows import ModelRows
from stickslip.estimation.selection.significance import jackknife
from stickslip.estimation.selection.terms import (
    DELAY,
    DIRECTION,
    ELASTIC,
    SATURATION,
    Term,
)
from stickslip.estimation.weak_form.rows import FEWEST_FOLDS
from stickslip.records import FrictionEstimate


@dataclass(frozen=True, kw_only=True)
class IntervalTuning:
    """Tuning of the errors beyond the sampling error."""

    wide_windows: tuple[float, float] = (2.5, 4.0)
    """Widths of further windows over that of the fit [-]; the widest also models an elastic
    drive."""
    fewest_deviations: float = 2.0
    """Difference between windows, in standard deviations, that counts [-]."""
    largest_p_value: float = 0.1
    """p-value of a term that was not selected, below which its effect widens the intervals [-]."""
    smallest_ratio: float = 3e-3
    """Smallest over largest singular value of the columns of wide windows [-]: below it they do not
    determine the parameters."""
    moves_p_value: float = 0.01
    """p-value of the differences between moves [-], below which they widen the intervals."""
    unknown_delay: float = 0.3
    """Standard deviation of a delay of the effort that the log does not determine [samples]."""
    certain_delay: float = 0.1
    """Standard deviation of the delay [samples] below which the log determines it."""
    similar_share: float = 0.2
    """Share of the slope of the effort that no combination of the other columns explains [-], below
    which the estimate of the delay depends on missing terms."""
    similar_factor: float = 5.0  #: Factor of the standard deviation of the delay there [-].
    unknown_asymmetry: float = 0.1
    """Standard deviation of the difference of viscous friction per direction from their mean, over
    the mean [-], of an axis whose log does not determine it."""
    fewest_moves: float = 0.7
    """Share of the moves that wide windows must still fit into [-]: with fewer, the difference is
    one between moves and not between windows."""


_TINY = np.finfo(float).tiny
_EXACT = 1e-9  # share of a column [-] below which it is a combination of others
_ROWS_PER_PARAMETER = 4  # of wide windows [-]: fewer determine the difference too badly
_LEAST_CHANCE = 0.1  # variance of a difference over that of the parameter, at least [-]


def between_windows(
    model: Model,
    rows: ModelRows,
    estimate: FrictionEstimate,
    rows_of: Callable[[Model], ModelRows],
    tuning: IntervalTuning,
) -> Float[np.ndarray, " p"] | None:
    """Return the change of the parameters [SI] over wider windows; None if it is within chance.

    Wider windows attenuate fast effects: a drive that resonates, presliding, errors of the model in
    transients. An elastic drive still adds a share of the fourth derivative of the position, the
    first term in which its apparent inertia depends on frequency.

    ``rows_of`` returns the rows of a model.
    """
    shifts = np.zeros(len(rows.names))
    for k, factor in enumerate(tuning.wide_windows):
        wide = replace(model, rows=model.rows.widened(factor))
        too_few = wide.rows.size < _ROWS_PER_PARAMETER * len(rows.names)
        if too_few or wide.rows.moves < tuning.fewest_moves * model.rows.moves:
            continue
        other = rows_of(wide)
        if k > 0 and ELASTIC not in model.names:
            other = other.with_column("elastic", wide.scaled(wide.rows.snap))
        if smallest_ratio(other.columns) < tuning.smallest_ratio:
            continue
        values, stds = other.fitted()
        for place, (name, value) in enumerate(zip(rows.names, rows.values(), strict=True)):
            own = estimate.parameters[name].std
            if own is None:
                continue
            shift = float(values[place] - value)
            chance = float(np.sqrt(max(stds[place] ** 2 - own**2, _LEAST_CHANCE * own**2)))
            if abs(shift) > max(tuning.fewest_deviations * chance, abs(shifts[place])):
                shifts[place] = shift
    return shifts if np.any(shifts) else None


def between_moves(
    model: Model, rows: ModelRows, estimate: FrictionEstimate, tuning: IntervalTuning
) -> list[Float[np.ndarray, " p"]]:
    """Return the jackknife differences between moves [SI]; none if they are within chance.

    A missing term acts differently in different moves.
    """
    folds = model.rows.folds
    if folds.size == 0:
        return []
    differences = jackknife(rows.columns, rows.target, folds)
    count = differences.shape[0]
    if count < FEWEST_FOLDS:
        return []
    stds = [estimate.parameters[name].std for name in rows.names]
    own = np.array([np.inf if std is None else std for std in stds])
    most = chdtri(count - 1, tuning.moves_p_value) / (count - 1)
    if not np.any(np.sum(differences**2, axis=0) > most * own**2):
        return []
    return list(differences)


@dataclass(frozen=True, kw_only=True)
class DelayedRows:
    """Rows with a column of the delay, and its dependence on the others."""

    rows: ModelRows
    place: int  #: Of the column.
    #: Change of the other parameters per unit of the delay [SI per s, or per sample].
    change: Float[np.ndarray, " p"]
    independent: float  #: Share of the column that no combination of the others explains [-].


def delayed_rows(model: Model, rows: ModelRows) -> DelayedRows:
    """Return rows with a column of the delay: that of the model [s], or an added one [samples]."""
    delayed = rows if DELAY in model.names else rows.with_column("effort_delay", model.effort_slope)
    place = delayed.names.index("effort_delay")
    slope, others = delayed.columns[:, place], np.delete(delayed.columns, place, axis=1)
    change = least_squares(others, slope)
    independent = np.linalg.norm(slope - others @ change) / max(np.linalg.norm(slope), _TINY)
    return DelayedRows(rows=delayed, place=place, change=change, independent=float(independent))


def of_unknown_delay(
    model: Model, rows: ModelRows, tuning: IntervalTuning
) -> Float[np.ndarray, " p"] | None:
    """Return the change of the parameters by a delay that the log does not determine [SI].

    The delay has the prior N(0, s^2) with s the standard deviation of a uniform distribution
    over a sample: an effort that a faster controller changes between the samples acts up to a
    sample earlier than it is logged. The log adds the estimate d with standard deviation
    sigma. The change is that by the root mean square of the posterior. None if sigma is small and
    the search could select a delay.

    If the slope of the effort is nearly a combination of the other columns, sigma is taken several
    times as large: d then depends on missing terms. The uncertainty of a selected delay is
    then its size. Beside an elastic drive, a delay that its damping explains is not selected, and
    its change is returned for any sigma.
    """
    if not testable(model):
        return None
    selected = DELAY in model.names
    T = model.rows.weight.sampling_time if selected else 1.0  # s, or samples
    delayed = delayed_rows(model, rows)
    place, change = delayed.place, delayed.change
    delay, std = 0.0, np.inf
    if delayed.independent > _EXACT:
        values, stds = delayed.rows.fitted()
        delay, std = float(values[place]) / T, float(stds[place]) / T
    similar = delayed.independent < tuning.similar_share
    if not similar and (selected or std < tuning.certain_delay):
        lag = model.elastic_lag / model.rows.weight.sampling_time
        return None if selected or lag == 0.0 else min(abs(delay), lag) * change
    factor = tuning.similar_factor if similar else 1.0
    weight = 1.0 / (1.0 + (factor * std / tuning.unknown_delay) ** 2)
    size = tuning.unknown_delay * np.sqrt(1.0 - weight)
    if not selected:
        size = np.hypot(size, weight * delay)
    elif similar:  # it may replace a missing term
        size = max(size, abs(delay))
    shift = size * T * change
    return np.insert(shift, place, -size * T) if selected else shift


def of_unknown_asymmetry(
    model: Model, rows: ModelRows, terms: Sequence[Term], tuning: IntervalTuning
) -> Float[np.ndarray, " p"] | None:
    """Return the change of the parameters [SI] by an asymmetry of viscous friction not selected.

    Friction usually differs between the directions, and its viscous part moves the offset. The
    asymmetry has a normal prior of zero mean, and the log adds its estimate. The change is that by
    the larger of mean and standard deviation of the posterior. None if the model has this term, or
    must not have it.

    ``terms`` are those that may be selected.
    """
    term = next((term for term in terms if term.name == DIRECTION), None)
    if term is None or DIRECTION in model.names or not (model.offset and model.viscous):
        return None
    column = model.term_columns(term, term.shapes[0])[:, 0]
    asymmetric = rows.with_column("viscous_asymmetry", column)
    if smallest_ratio(asymmetric.columns) < _EXACT:
        return None
    values, stds = asymmetric.fitted()
    prior = tuning.unknown_asymmetry * abs(model.friction()[1])
    weight = prior**2 / max(prior**2 + float(stds[-1]) ** 2, _TINY)
    size = max(prior * np.sqrt(1.0 - weight), weight * abs(float(values[-1])))
    return np.asarray(-size * least_squares(rows.columns, column))


def of_other_terms(
    model: Model,
    rows: ModelRows,
    terms: Sequence[Term],
    selected_p_value: float,
    tuning: IntervalTuning,
) -> Float[np.ndarray, " p"] | None:
    """Return the largest change of the parameters by a term that is nearly significant [SI].

    A significant term that was not selected, as its columns are nearly a combination of the others,
    counts at any conditioning. Viscous friction changes down to zero at most.

    ``terms`` are those that were tried, significant below ``selected_p_value``.
    """
    least_ratios = {
        score.term: tuning.smallest_ratio if score.p_value > selected_p_value else _EXACT
        for score in model.scores
        if not score.selected and score.p_value < tuning.largest_p_value
    }
    own = rows.values()
    norms = np.linalg.norm(rows.columns, axis=0)
    largest, found = 0.0, None
    for term in terms:
        if term.name not in least_ratios or term.name in {SATURATION, DIRECTION}:
            continue
        shapes = (
            term.shapes[:: max(len(term.shapes) // 3, 1)]
            if term.proportional is None
            else (term.proportional(*model.friction()),)
        )
        for shape in shapes:
            more = np.column_stack([rows.columns, model.term_columns(term, shape)])
            if smallest_ratio(more) < least_ratios[term.name]:
                continue
            shift = least_squares(more, rows.target)[: own.size] - own
            shift *= _down_to_zero(rows.names, own, shift)
            size = float(np.linalg.norm(shift * norms))
            if size > largest:
                largest, found = size, shift
    return found


def _down_to_zero(
    names: Sequence[str], own: Float[np.ndarray, " p"], shift: Float[np.ndarray, " p"]
) -> float:
    """Return the share of a change of the parameters that keeps viscous friction positive [-]."""
    shares = [
        own[k] / -shift[k]
        for k, name in enumerate(names)
        if name.startswith("viscous_friction") and 0.0 < own[k] < -shift[k]
    ]
    return min(shares, default=1.0)
