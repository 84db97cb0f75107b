"""Information per batch of samples, for intervals that allow for correlated residuals.

A recursive estimator that takes its residuals for white is too certain when they are correlated or
its model is not exact. The information that it gathers, J and eta = J theta, is therefore kept at
the ends of up to 8 batches of equal length. When all are used, neighbours are merged and the
length doubles, so that batches outgrow any finite correlation time (batch means). Leaving out one
batch at a time gives the covariance (delete-a-group jackknife):

    theta_(b) = (J - dJ_b)^-1 (eta - deta_b),
    var_i = (B - 1) / B sum_b (theta_(b),i - mean_i)^2 (1 + r_i) / (1 - r_i).

The last factor allows for neighbouring batches that are still correlated. r is the correlation of
neighbouring deviations, corrected for its bias -(1 + 3 r) / B. The degrees of freedom of the
Student factor are (B - 1) (1 - r) / (1 + r).

Friction that drifts correlates with what the moves are: if the fast ones come last, a fall of
Coulomb friction looks like less viscous friction, in all batches. With a linear drift
theta + tau beta over the log, tau_b in (-1/2, 1/2) at the middle of batch b, the estimates of a
model without it are off by J^-1 M_1 beta, where M_k = sum_b tau_b^k dJ_b. Least squares gives

    (M_2 - M_1 J^-1 M_1) beta = sum_b tau_b (deta_b - dJ_b theta).

A half width is at least 1.5 |J^-1 M_1 beta|: the interval is for the parameters at the middle of
the log, which are the means over it. Where both halves of the log hold the same moves, M_1 is
small, and noise changes the width little.

The first snapshot is the information J_0 of the first guess, which no batch holds. The error of the
first guess adds the variance J^-1 J_0 J^-1, at most J^-1: a motion in one direction, for instance,
does not distinguish Coulomb friction from the offset, and all batches agree on the first guess.

R. G. Miller (1974), "The jackknife: a review", Biometrika 61; P. W. Glynn and D. L. Iglehart
(1990), "Simulation output analysis using standardized time series", Math. Oper. Res. 15.

The batches are a field of the estimator's state.
"""

from typing import Any

import numpy as np
from jaxtyping import Float
from scipy import stats

from stickslip.compiled import compiled
from stickslip.estimation.point_estimate import NORMAL_95

FEWEST_BATCHES = 4
"""Batches below which there is no interval."""

_MOST = 8
"""Batches, an even number. More give a shorter Student factor but less independent batches: with an
AR(1) force of 0.998 in logs of 10 s, 16 cover 83 %, 8 cover 88 %, at equal coverage elsewhere."""
_FIRST_LENGTH = 32  # samples
_PROBABILITY = 0.975  # of one side of a 95 % interval
_MOST_CORRELATED = 0.7  # bound of r
_FEWEST_DEGREES = 2.0  # of freedom
_SINGULAR = 1e-9  # least eigenvalue of the information on a drift, over the largest
LEAST_WIDTH = 1.5
"""Least half width over the change of the estimate with a drift, or without a part of the log (the
slow or the accelerated samples). In `studies.online`, with an unknown inertia, 1.25 covers Coulomb
friction with a Stribeck effect in 90 %, 1.5 in 92 % and 1.75 in 95 %; white noise, over all
estimators, in 97.6 %, 97.9 % and 98.3 % (200 runs)."""


def batches_dtype(p: int) -> np.dtype[Any]:
    """Return the fields of the batches of p parameters."""
    snapshot = np.dtype([("eta", "f8", (p,)), ("information", "f8", (p, p))])
    return np.dtype(
        [
            ("samples", "i8"),  # in the current batch
            ("length", "i8"),  # samples of a batch
            ("closed", "i8"),  # number of snapshots
            ("snapshots", snapshot, (_MOST + 1,)),  # of J, the upper triangle
        ]
    )


@compiled(inline=True)
def clear_batches(batches: Any) -> None:
    """Begin with the first batch."""
    batches.samples, batches.length, batches.closed = 0, _FIRST_LENGTH, 0


@compiled(inline=True)
def count_sample(batches: Any) -> bool:
    """Count a sample; return whether a snapshot is due (the first one before any sample)."""
    if batches.closed == 0:
        return True
    batches.samples += 1
    return batches.samples >= batches.length


@compiled(inline=True)
def close_batch(
    batches: Any, information: Float[np.ndarray, "p p"], vector: Float[np.ndarray, " p"]
) -> None:
    """Store the current J and eta."""
    n = batches.closed
    if n == _MOST + 1:
        for k in range(1, _MOST // 2 + 1):
            even, kept = batches.snapshots[2 * k], batches.snapshots[k]
            kept.eta[:] = even.eta
            kept.information[:] = even.information
        n = _MOST // 2 + 1
        batches.length *= 2
        if batches.samples < batches.length:
            batches.closed = n
            return
    snapshot = batches.snapshots[n]
    for i in range(vector.size):
        snapshot.eta[i] = vector[i]
        for j in range(i, vector.size):
            snapshot.information[i, j] = information[i, j]
    batches.closed = n + 1
    batches.samples = 0


@compiled(inline=True)
def scale_information(parts: Any, factor: float) -> None:
    """Multiply eta and J of all parts by a factor, after a change of the estimated noise."""
    for k in range(parts.size):
        eta, information = parts[k].eta, parts[k].information
        for i in range(eta.size):
            eta[i] *= factor
            for j in range(i, eta.size):
                information[i, j] *= factor


def jackknife(
    batches: Any,
    p: int,
    information: Float[np.ndarray, "q q"],
    vector: Float[np.ndarray, " q"],
) -> Float[np.ndarray, " p"] | None:
    """Return the half widths of 95 % intervals of theta by leaving out one batch at a time.

    Theta are the first p parameters of the batches. ``information`` and ``vector`` are the
    current J and eta; the incomplete batch counts to the last complete one. None with fewer than
    `FEWEST_BATCHES`, or where the parameters are not identifiable without one.
    """
    count = int(batches.closed) - 1
    if count < FEWEST_BATCHES:
        return None
    information, vector = information[:p, :p], vector[:p]
    J = symmetric(batches.snapshots["information"][: count + 1, :p, :p])
    eta = batches.snapshots["eta"][: count + 1, :p].copy()
    J[-1], eta[-1] = information, vector
    parts, vectors = np.diff(J, axis=0), np.diff(eta, axis=0)
    theta = _without(information, vector, parts, vectors)
    if theta is None:
        return None
    deviations = theta - np.mean(theta, axis=0)
    squares = np.sum(deviations**2, axis=0)
    products = np.sum(deviations[1:] * deviations[:-1], axis=0)
    r = np.divide(products, squares, out=np.zeros(p), where=squares > 0.0)
    r = np.clip(r + (1.0 + 3.0 * r) / count, 0.0, _MOST_CORRELATED)
    inflation = (1.0 + r) / (1.0 - r)
    factor = stats.t.ppf(_PROBABILITY, np.maximum((count - 1) / inflation, _FEWEST_DEGREES))
    half = factor * np.sqrt((count - 1) / count * squares * inflation)
    half = np.hypot(half, NORMAL_95 * np.sqrt(_of_first_guess(information, J[0])))
    ends = float(batches.length) * np.arange(count + 1)
    ends[-1] += batches.samples
    tau = 0.5 * (ends[1:] + ends[:-1]) / ends[-1] - 0.5
    change = _change_by_drift(tau, information, vector, parts, vectors)
    return np.maximum(half, LEAST_WIDTH * np.abs(change))


def _of_first_guess(
    information: Float[np.ndarray, "p p"], first: Float[np.ndarray, "p p"]
) -> Float[np.ndarray, " p"]:
    """Return the variance J^-1 J_0 J^-1 of each parameter, at most J^-1 (see the module)."""
    scale = 1.0 / np.sqrt(np.diag(information))
    inverse = np.linalg.inv(information * np.outer(scale, scale))
    variance = np.diag(inverse @ (first * np.outer(scale, scale)) @ inverse)
    return np.clip(variance, 0.0, np.abs(np.diag(inverse))) * scale**2


def symmetric(upper: Float[np.ndarray, "*n p p"]) -> Float[np.ndarray, "*n p p"]:
    """Return the symmetric matrices with these upper triangles."""
    return np.triu(upper) + np.swapaxes(np.triu(upper, 1), -2, -1)


def _change_by_drift(
    tau: Float[np.ndarray, " b"],
    information: Float[np.ndarray, "p p"],
    vector: Float[np.ndarray, " p"],
    parts: Float[np.ndarray, "b p p"],
    vectors: Float[np.ndarray, "b p"],
) -> Float[np.ndarray, " p"]:
    """Return J^-1 M_1 beta, by which a linear drift changes theta (see the module)."""
    scale = 1.0 / np.sqrt(np.diag(information))
    units = np.outer(scale, scale)
    J = information * units
    first, second = np.tensordot([tau, tau**2], parts, 1) * units
    theta = np.linalg.solve(J, vector * scale)
    left = second - first @ np.linalg.solve(J, first)
    moment = (tau @ vectors) * scale - first @ theta
    # A drift that the log does not show at all is none
    beta = np.linalg.pinv(left, rcond=_SINGULAR, hermitian=True) @ moment
    return np.linalg.solve(J, first @ beta) * scale


def _without(
    information: Float[np.ndarray, "p p"],
    vector: Float[np.ndarray, " p"],
    parts: Float[np.ndarray, "b p p"],
    vectors: Float[np.ndarray, "b p"],
) -> Float[np.ndarray, "b p"] | None:
    """Return theta without each part; None if it is not identifiable with and without each."""
    diagonal = np.diag(information)
    if not np.all(diagonal > 0.0):
        return None
    scale = 1.0 / np.sqrt(diagonal)
    J = np.concatenate([information[None], information - parts]) * np.outer(scale, scale)
    if not np.all(np.isfinite(J)):
        return None
    eigenvalues = np.linalg.eigvalsh(J)
    # Of a singular matrix, rounding leaves one of either sign
    rounding = scale.size * np.finfo(float).eps * eigenvalues[:, -1:]
    if np.any(eigenvalues <= rounding):
        return None
    return np.linalg.solve(J[1:], ((vector - vectors) * scale)[..., None])[..., 0] * scale


def intervals_of(
    batches: Any, values: Float[np.ndarray, " p"], information: Float[np.ndarray, "q q"]
) -> Float[np.ndarray, "p 2"]:
    """Return the 95 % intervals of the jackknife [SI], infinite with fewer than `FEWEST_BATCHES`.

    ``information`` is J of all parameters that the batches are for, zero for those not estimated.
    """
    p = values.size
    vector = np.zeros(information.shape[0])
    vector[:p] = information[:p, :p] @ values
    half = jackknife(batches, p, information, vector)
    if half is None:
        return np.column_stack([np.full(p, -np.inf), np.full(p, np.inf)])
    return np.column_stack([values - half, values + half])
