"""Contents of a log: extra terms of the effort law, judged on rows left out of the fit."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from studies.real_axes.reference import PLAIN_TERMS, FilteredLog, MotionRows, find_delay, fit_rows

CANDIDATES: Mapping[str, tuple[str, ...]] = {
    "gravity": ("gravity_sine", "gravity_cosine"),
    "spring": ("spring",),
    "Coulomb over position": ("coulomb_over_position",),
    "viscous per direction": ("viscous_asymmetry",),
    "quadratic": ("quadratic",),
    "2/3 power": ("two_thirds",),
    "Stribeck": ("stribeck",),
    "ripple": ("ripple_sine", "ripple_cosine"),
    "drift of offset": ("drift_offset",),
    "drift of Coulomb": ("drift_coulomb",),
    "drift of viscous": ("drift_viscous",),
}
"""Terms that are added one at a time; a delay of the effort is a candidate as well."""

DELAY = "delay"

_FOLDS = 4  # blocks of the cross-validation [-]
_WORTH = 0.02  # least decrease of the error by a term [-]
_MOST_STEPS = 4  # most terms that are added one after the other [-]
_LINES_PER_TRAVEL = 2  # lines of the spectrum for each wave along the travel [-]
_MOST_PERIODS = 150.0  # of a ripple along the travel [-]
_FEWEST_PERIODS = 1.5  # of a ripple along the travel [-]


@dataclass(frozen=True, kw_only=True)
class Contents:
    """Cross-validated effect of each term."""

    #: Relative error of the effort on rows left out, with the plain terms and without delay [-].
    plain_error: float
    effects: Mapping[str, float]  #: The same with one candidate added, by its name [-].
    #: Candidates that were added one after the other while each lowered the error by more than 2 %
    #: of itself, and the error after each [-].
    path: tuple[tuple[str, float], ...]
    delay: float  #: Delay of the effort that suits the plain terms best [s].
    #: Period over the position at which the plain residual is largest [m or rad].
    ripple_period: float


def contents_of(log: FilteredLog) -> Contents | None:
    """Return the effect of each candidate, or None if too few rows move.

    The rows are cut into four blocks in time; each is predicted by a fit to the other three.
    """
    plain = log.rows()
    whole = fit_rows(plain)
    if whole is None:
        return None
    moving = plain.part(plain.moving)
    period = _ripple_period(moving, moving.effort - whole.predict(moving))
    chosen: list[str] = []
    path: list[tuple[str, float]] = []
    plain_error = error = _left_out(log, (), period)
    effects: dict[str, float] = {}
    for _ in range(_MOST_STEPS):
        open_names = [name for name in (DELAY, *CANDIDATES) if name not in chosen]
        errors = {name: _left_out(log, (*chosen, name), period) for name in open_names}
        effects = effects or errors
        best = min(errors, key=lambda name: errors[name])
        if not errors[best] < (1.0 - _WORTH) * error:
            break
        chosen.append(best)
        error = errors[best]
        path.append((best, error))
    return Contents(
        plain_error=plain_error,
        effects=effects,
        path=tuple(path),
        delay=find_delay(log),
        ripple_period=period,
    )


def _left_out(log: FilteredLog, names: tuple[str, ...], period: float) -> float:
    """Return the relative error over the moving rows of all blocks, each left out in turn [-]."""
    terms = [*PLAIN_TERMS]
    for name in names:
        terms.extend(CANDIDATES.get(name, ()))
    linear = tuple(term for term in terms if not term.startswith(("stribeck", "ripple")))
    rows = log.rows(find_delay(log, linear) if DELAY in names else 0.0)
    moving = rows.part(rows.moving)
    block = np.minimum(np.arange(moving.time.size) * _FOLDS // moving.time.size, _FOLDS - 1)
    squared = 0.0
    for fold in range(_FOLDS):
        fit = fit_rows(moving.part(block != fold), terms, {"ripple": period})
        if fit is None:
            return np.inf
        held = moving.part(block == fold)
        squared += float(np.sum((held.effort - fit.predict(held)) ** 2))
    return float(np.sqrt(squared) / np.linalg.norm(moving.effort))


def _ripple_period(moving: MotionRows, residual: Float[np.ndarray, " n"]) -> float:
    position = moving.position
    travel = float(np.ptp(position))
    counts = np.arange(_FEWEST_PERIODS, _MOST_PERIODS, 1.0 / _LINES_PER_TRAVEL)
    power = [
        abs(np.sum(residual * np.exp(2j * np.pi * count * position / travel))) for count in counts
    ]
    return travel / float(counts[int(np.argmax(power))])
