"""Diagnostics of a fit: conditioning, cross-validation, identifiability and status."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from stickslip.estimation.fit.intervals import information_time
from stickslip.estimation.fit.rows import (
    SMALLEST_SINGULAR_RATIO,
    MotionSummary,
    Regression,
    least_squares,
)
from stickslip.records import ParameterEstimate, Status, Verdict, shared_name

LEAST_SIGNAL_TO_NOISE = 5.0
"""Least norm of a regressor over that of its noise [-]: below it, least squares is biased to zero
by more than 4 %."""

INVOLVED = 0.01
"""Component of a null direction [-] above which a parameter takes part in it."""

LEAST_SPEED_VARIATION = 0.05
"""Standard deviation over mean of the speed [-], below which the columns of Coulomb and viscous
friction differ by less than model errors."""

LEAST_SHARE_OF_TRAVEL = 0.02
"""Share of the travel [-] below which a direction holds no information of its own."""

LEAST_RANGE = 30.0
"""Range of positions over their noise or smallest step [-], below which the axis hardly moves:
noise alone spans less than 15 standard deviations in any log that fits into a memory."""

POOR_FIT = 0.5
"""Relative residual [-] above which the model does not describe the axis."""

FOLDS = 5  #: Blocks of the cross-validation [-].
_LEAST_ROWS_PER_FOLD = 4  # a fold with fewer rows has no meaningful error [-]


def condition_number(regressors: Float[np.ndarray, "n p"]) -> float:
    """Return the condition number [-] with columns scaled to unit norm; infinite if one is zero."""
    norms = np.linalg.norm(regressors, axis=0)
    if np.any(norms == 0):
        return float("inf")
    values = np.linalg.svd(regressors / norms, compute_uv=False)
    return float(values[0] / values[-1]) if values[-1] > 0 else float("inf")


def cross_validation_residual(regression: Regression) -> float | None:
    """Return the relative residual [-] on contiguous fifths of the information left out in turn.

    The blocks are contiguous, because a row is correlated with its neighbours. They have equal
    information and not equal length, because rests contain no information. Of several logs a fifth
    of each is left out. None if the log is too short.
    """
    target, regressors = regression.target, regression.regressors
    n, p = regressors.shape
    if n < FOLDS * max(_LEAST_ROWS_PER_FOLD, p):
        return None
    norms = np.linalg.norm(regressors, axis=0)
    leverage = np.sum((regressors / np.where(norms > 0, norms, 1.0)) ** 2, axis=1)
    log = np.zeros(n, dtype=np.int64) if regression.log is None else regression.log
    time = np.empty(n)
    for each in np.unique(log):
        time[log == each] = information_time(leverage[log == each])[0]
    fold = np.minimum((FOLDS * time).astype(int), FOLDS - 1)
    left_out = 0.0
    for k in range(FOLDS):
        block = fold == k
        if np.any(block) and not np.all(block):
            values = least_squares(regressors[~block], target[~block])
            left_out += float(np.sum((target[block] - regressors[block] @ values) ** 2))
    return float(np.sqrt(left_out)) / regression.scale


@dataclass(frozen=True, kw_only=True)
class Determined:
    """Columns and directions that a regression determines."""

    columns: Int[np.ndarray, " q"]  #: Numbers of the columns that hold more than noise, shape (q,).
    # Singular value decomposition of those columns, scaled to unit norm, in the directions that are
    # determined [-]
    left: Float[np.ndarray, "n d"]
    singular: Float[np.ndarray, " d"]
    right: Float[np.ndarray, "d q"]
    norms: Float[np.ndarray, " q"]  #: Of those columns [SI], shape (q,).
    #: Sets of column numbers that take part in each direction that is not determined; a set of one
    #: is a column that is empty or mostly noise.
    undetermined: tuple[frozenset[int], ...]

    def mask(self, size: int) -> Bool[np.ndarray, " p"]:
        """Return which of ``size`` columns take part in no undetermined direction."""
        mask = np.ones(size, dtype=bool)
        for group in self.undetermined:
            mask[list(group)] = False
        return mask


def determined(
    regressors: Float[np.ndarray, "n p"],
    regressor_noise: Float[np.ndarray, " p"],
    smallest_ratio: float = SMALLEST_SINGULAR_RATIO,
) -> Determined:
    """Return the directions of the parameter space that the rows determine.

    A direction is not determined if the columns, combined along it, are below the smallest ratio to
    the strongest combination, or below five times the combination of the root mean square noise in
    the columns, for which least squares is biased to zero.
    """
    n, p = regressors.shape
    all_norms = np.linalg.norm(regressors, axis=0)
    noise_norms = np.sqrt(n) * regressor_noise
    seen = (all_norms > LEAST_SIGNAL_TO_NOISE * noise_norms) & (all_norms > 0)
    groups = [frozenset({k}) for k in range(p) if not seen[k]]
    columns = np.flatnonzero(seen)
    norms = all_norms[columns]
    left, singular, right = np.linalg.svd(regressors[:, columns] / norms, full_matrices=False)
    noise = np.sqrt((right**2) @ (noise_norms[columns] / norms) ** 2)
    largest = float(np.max(singular, initial=0.0))
    kept = singular >= np.maximum(smallest_ratio * largest, LEAST_SIGNAL_TO_NOISE * noise)
    groups += [
        frozenset(columns[np.abs(direction) > INVOLVED].tolist()) for direction in right[~kept]
    ]
    return Determined(
        columns=columns,
        left=left[:, kept],
        singular=singular[kept],
        right=right[kept],
        norms=norms,
        undetermined=tuple(groups),
    )


def unidentifiable_reason(name: str, group: Sequence[str], motion: MotionSummary) -> str:
    """Return one sentence on why this motion does not determine a parameter.

    The group are the parameters that cannot be separated, itself included.
    """
    if hardly_moves(motion):
        return "the axis hardly moves in this log"
    base = name.removesuffix("_positive").removesuffix("_negative")
    share = LEAST_SHARE_OF_TRAVEL * motion.travel
    for side, travel in (("positive", motion.forward_travel), ("negative", motion.backward_travel)):
        if name.endswith(side) and travel < share:
            return f"the axis hardly moves in the {side} direction"
    others = [other for other in group if other != name]
    if not others:
        return (
            "the axis hardly accelerates, so its inertia leaves no trace in the effort"
            if base in {"mass", "inertia"}
            else "the motion that would show it is not larger than its noise"
        )
    return _inseparable_reason(base, group, others, motion)


def _inseparable_reason(
    base: str, group: Sequence[str], others: Sequence[str], motion: MotionSummary
) -> str:
    """Return why a parameter cannot be separated from others."""
    kinds = {shared_name(other).split("_")[0] for other in group}
    shorter = min(motion.forward_travel, motion.backward_travel)
    one_way = shorter < LEAST_SHARE_OF_TRAVEL * motion.travel
    if base in {"mass", "inertia"}:
        return "the acceleration hardly varies beyond its noise and what goes with the friction"
    if kinds >= {"coulomb", "offset"} and one_way and base != "viscous_friction":
        return "the axis moves one way only, so Coulomb friction and the offset cannot be separated"
    if kinds >= {"coulomb", "viscous"} and motion.speed_variation < LEAST_SPEED_VARIATION:
        return (
            f"the speed varies by {100 * motion.speed_variation:.2g} % only, so Coulomb and "
            "viscous friction cannot be separated"
        )
    return f"it cannot be separated from {' and '.join(others)}"


def hardly_moves(motion: MotionSummary) -> bool:
    """Return whether a log shows no more motion than noise or a few encoder counts."""
    return motion.position_range < LEAST_RANGE * motion.position_noise


def verdicts_of(regression: Regression, found: Determined) -> tuple[Verdict, ...]:
    """Return one verdict a parameter, in the order of the columns."""
    verdicts: list[Verdict] = []
    mask = found.mask(len(regression.names))
    for k, name in enumerate(regression.names):
        if mask[k]:
            verdicts.append(
                Verdict(parameter=name, identifiable=True, reason="the motion determines it")
            )
            continue
        group = max((g for g in found.undetermined if k in g), key=len)
        names = [regression.names[j] for j in sorted(group)]
        reason = unidentifiable_reason(name, names, regression.motion)
        verdicts.append(Verdict(parameter=name, identifiable=False, reason=reason))
    return tuple(verdicts)


def status_of(
    parameters: Sequence[ParameterEstimate],
    relative_residual: float,
    cross_validation: float | None,
    regression: Regression,
) -> Status:
    """Return the status of an estimate: the first reason against it, or ``ok``.

    The relative residual is its norm over the scale of the rows [-], that of the cross-validation
    the same on rows left out of the fit.
    """
    if hardly_moves(regression.motion):
        return Status.INSUFFICIENT_EXCITATION
    if max(relative_residual, cross_validation or 0.0) > POOR_FIT:
        return Status.POOR_FIT
    for p in parameters:
        if not p.signed and p.ci95 is not None and p.ci95[1] < 0:
            return Status.UNPHYSICAL
        if p.name in {"mass", "inertia"} and p.value is not None and p.value <= 0:
            return Status.UNPHYSICAL
    if not all(p.identified for p in parameters if p.name not in regression.nuisance):
        return Status.NOT_IDENTIFIABLE
    return Status.BIASED if regression.biased else Status.OK
