"""What a fit says about itself: conditioning, whiteness, cross-validation, identifiability."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from stickslip.estimation.regression import MotionSummary, Regression
from stickslip.records import ParameterEstimate, Status, Verdict

__all__ = [
    "condition_number",
    "cross_validation_residual",
    "identifiable_columns",
    "status_of",
    "unidentifiable_reason",
]

SMALLEST_SINGULAR_RATIO = 0.01
"""Columns of unit norm with a smaller singular value (relative to the largest) are told apart by
less than 1 % of their content, which sensor and model errors exceed."""

LEAST_SIGNAL_TO_NOISE = 3.0
"""A regressor less than three times its own noise is mostly noise, and would be biased to zero."""

INVOLVED = 0.3
"""Component of a null direction above which a parameter takes part in it."""

LEAST_SPEED_VARIATION = 0.05
"""Below 5 % variation of speed, Coulomb and viscous friction differ by less than model errors."""

LEAST_SHARE_OF_TRAVEL = 0.02
"""A direction with less than 2 % of the travel says nothing of its own."""

LEAST_TRAVEL = 30.0
"""Travel, in standard deviations of the position noise, below which nothing can be said."""

POOR_FIT = 0.5
"""Relative residual above which the model is not what moves the axis."""

FOLDS = 5
_LEAST_ROWS_PER_FOLD = 4


def condition_number(regressors: Float[np.ndarray, "n p"]) -> float:
    """Return the condition number [-] with columns scaled to unit norm; infinite if one is zero."""
    norms = np.linalg.norm(regressors, axis=0)
    if np.any(norms == 0):
        return float("inf")
    values = np.linalg.svd(regressors / norms, compute_uv=False)
    return float(values[0] / values[-1]) if values[-1] > 0 else float("inf")


def cross_validation_residual(
    target: Float[np.ndarray, " n"], regressors: Float[np.ndarray, "n p"]
) -> float | None:
    """Return the relative residual [-] on contiguous fifths of the rows left out in turn.

    Contiguous blocks, because neighbours of a left-out row would give it away. None if the log is
    too short to leave a fifth out.
    """
    n, p = regressors.shape
    if n < FOLDS * max(_LEAST_ROWS_PER_FOLD, p):
        return None
    left_out = 0.0
    for block in np.array_split(np.arange(n), FOLDS):
        kept = np.ones(n, dtype=bool)
        kept[block] = False
        values, *_ = np.linalg.lstsq(regressors[kept], target[kept], rcond=None)
        left_out += float(np.sum((target[block] - regressors[block] @ values) ** 2))
    return float(np.sqrt(left_out / np.sum(target**2)))


def identifiable_columns(
    regressors: Float[np.ndarray, "n p"],
    regressor_noise: Float[np.ndarray, " p"],
) -> tuple[Bool[np.ndarray, " p"], list[frozenset[int]]]:
    """Find which columns the rows determine, and which sets of others they cannot tell apart.

    Parameters
    ----------
    regressors
        With nuisance columns projected out [SI].
    regressor_noise
        Root mean square of the noise in each column [SI].

    Returns
    -------
    A mask of the determined columns, and the sets of column numbers that take part in each
    undetermined direction (sets of one: the column is empty or mostly noise).
    """
    p = regressors.shape[1]
    rms = np.linalg.norm(regressors, axis=0) / np.sqrt(regressors.shape[0])
    seen = (rms > LEAST_SIGNAL_TO_NOISE * regressor_noise) & (rms > 0)
    groups = [frozenset({k}) for k in range(p) if not seen[k]]
    columns = np.flatnonzero(seen)
    if columns.size:
        unit = regressors[:, columns] / np.linalg.norm(regressors[:, columns], axis=0)
        _, values, directions = np.linalg.svd(unit, full_matrices=False)
        for value, direction in zip(values, directions, strict=True):
            if value < SMALLEST_SINGULAR_RATIO * values[0]:
                involved = columns[np.abs(direction) > INVOLVED].tolist()
                groups.append(frozenset(involved))
    mask = np.ones(p, dtype=bool)
    for group in groups:
        mask[list(group)] = False
    return mask, groups


def unidentifiable_reason(name: str, group: Sequence[str], motion: MotionSummary) -> str:
    """Return one sentence on why a parameter cannot be found from this motion.

    Parameters
    ----------
    name
        The parameter.
    group
        The parameters that cannot be told apart, itself included.
    motion
        What the log excites.
    """
    base = name.removesuffix("_positive").removesuffix("_negative")
    others = [other for other in group if other != name]
    for side, travel in (
        ("positive", motion.forward_travel),
        ("negative", motion.backward_travel),
    ):
        if name.endswith(side) and travel < LEAST_SHARE_OF_TRAVEL * motion.travel:
            return f"the axis hardly moves in the {side} direction"
    if base in {"mass", "inertia"} and not others:
        return "the axis hardly accelerates, so its inertia leaves no trace in the effort"
    if not others:
        return "the motion that would show it is not larger than its noise"
    kinds = {other.split("_")[0] for other in group}
    if kinds >= {"coulomb", "offset"} and (
        min(motion.forward_travel, motion.backward_travel) < LEAST_SHARE_OF_TRAVEL * motion.travel
    ):
        return (
            "the axis moves one way only, so Coulomb friction and the offset cannot be told apart"
        )
    if kinds >= {"coulomb", "viscous"} and motion.speed_variation < LEAST_SPEED_VARIATION:
        return (
            f"the speed varies by {100 * motion.speed_variation:.2g} % only, so Coulomb and "
            "viscous friction cannot be told apart"
        )
    return f"it cannot be told apart from {' and '.join(others)} in this motion"


def verdicts_of(
    regression: Regression, mask: Bool[np.ndarray, " p"], groups: Sequence[frozenset[int]]
) -> tuple[Verdict, ...]:
    """Return one verdict a parameter, in the order of the columns."""
    verdicts: list[Verdict] = []
    for k, name in enumerate(regression.names):
        if mask[k]:
            verdicts.append(
                Verdict(parameter=name, identifiable=True, reason="the motion determines it")
            )
            continue
        group = max((g for g in groups if k in g), key=len)
        names = [regression.names[j] for j in sorted(group)]
        reason = unidentifiable_reason(name, names, regression.motion)
        verdicts.append(Verdict(parameter=name, identifiable=False, reason=reason))
    return tuple(verdicts)


def status_of(
    parameters: Sequence[ParameterEstimate], relative_residual: float, motion: MotionSummary
) -> Status:
    """Return whether an estimate can be trusted, and if not, the first reason why not.

    Parameters
    ----------
    parameters
        What was found.
    relative_residual
        Norm of the residual over norm of the target [-].
    motion
        What the log excites.
    """
    if motion.travel < LEAST_TRAVEL * motion.position_noise or not any(
        p.identified for p in parameters
    ):
        return Status.INSUFFICIENT_EXCITATION
    if not all(p.identified for p in parameters):
        return Status.NOT_IDENTIFIABLE
    for p in parameters:
        if p.name != "offset" and p.ci95 is not None and p.ci95[1] < 0:
            return Status.UNPHYSICAL
        if p.name in {"mass", "inertia"} and p.value is not None and p.value <= 0:
            return Status.UNPHYSICAL
    if relative_residual > POOR_FIT:
        return Status.POOR_FIT
    return Status.OK
