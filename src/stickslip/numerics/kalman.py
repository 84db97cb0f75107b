"""Kalman filter, smoother and whitening of a linear model with scalar measurements.

The model is

    z(k+1) = A z(k) + B u(k) + w(k),    y_c(k) = h_c' z(k) + n_c(k),

with white w of covariance Q and white n_c of variance R_c. Measurements are taken one by one, which
is exact for independent noise and needs no matrix inverse. All functions are compiled; `predict`
and `update` work in place, so that a kernel with more to carry along can call them step by step.
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled

__all__ = ["predict", "smooth", "update", "whiten"]


@compiled(inline=True)
def predict(
    A: Float[np.ndarray, "s s"],
    Q: Float[np.ndarray, "s s"],
    P: Float[np.ndarray, "s s"],
    work: Float[np.ndarray, "s s"],
    states: int = 0,
) -> None:
    """Advance a covariance over a sample in place: P <- A P A' + Q.

    Parameters
    ----------
    A, Q
        Transition and covariance of the process noise of the sample [any units].
    P
        Covariance of the states [any units].
    work
        Overwritten [any units].
    states
        Their number; a constant lets the compiler unroll the loops. 0 takes it from P.
    """
    s = states if states > 0 else P.shape[0]
    for i in range(s):
        for j in range(s):
            total = 0.0
            for h in range(s):
                total += A[i, h] * P[h, j]
            work[i, j] = total
    for i in range(s):
        for j in range(i, s):
            total = Q[i, j]
            for h in range(s):
                total += work[i, h] * A[j, h]
            P[i, j] = total
            P[j, i] = total


@compiled(inline=True)
def update(
    h: Float[np.ndarray, " s"],
    R: float,
    P: Float[np.ndarray, "s s"],
    gain: Float[np.ndarray, " s"],
    states: int = 0,
) -> float:
    """Condition a covariance on one measurement in place; return the innovation's variance.

    S = h' P h + R, K = P h / S, P <- P - K S K'. The gain K is left in ``gain``.

    Parameters
    ----------
    h
        Row that maps the states to the measurement [any units].
    R
        Variance of its noise [any units].
    P
        Covariance of the states [any units].
    gain
        Overwritten [any units].
    states
        As `predict` takes it.
    """
    s = states if states > 0 else P.shape[0]
    variance = R
    for i in range(s):
        total = 0.0
        for j in range(s):
            total += P[i, j] * h[j]
        gain[i] = total
        variance += h[i] * total
    for i in range(s):
        gain[i] /= variance
    for i in range(s):
        for j in range(i, s):
            P[i, j] -= gain[i] * gain[j] * variance
            P[j, i] = P[i, j]
    return variance


@compiled()
def whiten(
    A: Float[np.ndarray, "s s"],
    B: Float[np.ndarray, "s m"],
    Q: Float[np.ndarray, "s s"],
    H: Float[np.ndarray, "c s"],
    R: Float[np.ndarray, " c"],
    inputs: Float[np.ndarray, "n m q"],
    measured: Float[np.ndarray, "n c q"],
    first: Float[np.ndarray, "s q"],
    spread: Float[np.ndarray, "s s"],
) -> tuple[Float[np.ndarray, "n c q"], float]:
    """Return normalised innovations (y - h' z) / sqrt(S) of q signals, and the sum of log S.

    The filter is linear, so that signals that share its covariances (a measurement and the
    responses to regressors, for example) are whitened together.

    Parameters
    ----------
    A, B, Q
        Model over a sample [any units].
    H, R
        Rows of the measurements, and variances of their noise [any units].
    inputs, measured
        Of each sample and signal [any units].
    first, spread
        Mean of the first state of each signal, and its covariance, before the first measurement
        [any units].
    """
    n, channels, q = measured.shape
    s, m = B.shape
    z, moved = first.copy(), np.empty((s, q))
    P, work, gain = spread.copy(), np.empty((s, s)), np.empty(s)
    rows = np.empty((n, channels, q))
    logs = 0.0
    for k in range(n):
        for c in range(channels):
            S = update(H[c], R[c], P, gain)
            logs += np.log(S)
            for j in range(q):
                e = measured[k, c, j]
                for i in range(s):
                    e -= H[c, i] * z[i, j]
                rows[k, c, j] = e / np.sqrt(S)
                for i in range(s):
                    z[i, j] += gain[i] * e
        predict(A, Q, P, work)
        for j in range(q):
            for i in range(s):
                total = 0.0
                for h in range(s):
                    total += A[i, h] * z[h, j]
                for h in range(m):
                    total += B[i, h] * inputs[k, h, j]
                moved[i, j] = total
            for i in range(s):
                z[i, j] = moved[i, j]
    return rows, logs


@compiled()
def smooth(
    A: Float[np.ndarray, "s s"],
    B: Float[np.ndarray, "s m"],
    Q: Float[np.ndarray, "s s"],
    H: Float[np.ndarray, "c s"],
    R: Float[np.ndarray, " c"],
    inputs: Float[np.ndarray, "n m"],
    measured: Float[np.ndarray, "n c"],
    first: Float[np.ndarray, " s"],
    spread: Float[np.ndarray, "s s"],
) -> tuple[Float[np.ndarray, "n s"], Float[np.ndarray, "n s s"]]:
    """Return means and covariances of the states given all measurements.

    The adjoint l and its covariance L run backward through the updates of the filter, so that no
    covariance is inverted (modified Bryson-Frazier smoother, Bierman 1973):

        l <- l - h (K' l + e/S),  L <- (I - K h')' L (I - K h') + h h'/S  over an update,
        l <- A' l,                L <- A' L A                             over a sample,

    and the smoothed state is z - P l with covariance P - P L P.

    Parameters
    ----------
    A, B, Q, H, R
        Model over a sample; see `whiten` [any units].
    inputs, measured
        Of each sample [any units].
    first, spread
        Mean and covariance of the first state, before the first measurement [any units].
    """
    n, channels = measured.shape
    s = A.shape[0]
    z, P = first.copy(), spread.copy()
    work = np.empty((s, s))
    gains, variances = np.empty((n, channels, s)), np.empty((n, channels))
    errors = np.empty((n, channels))
    means, covariances = np.empty((n, s)), np.empty((n, s, s))
    for k in range(n):
        means[k], covariances[k] = z, P
        for c in range(channels):
            variances[k, c] = update(H[c], R[c], P, gains[k, c])
            errors[k, c] = measured[k, c] - np.sum(H[c] * z)
            z = z + gains[k, c] * errors[k, c]
        predict(A, Q, P, work)
        z = A @ z + B @ inputs[k]
    lam, lam_spread = np.zeros(s), np.zeros((s, s))
    for k in range(n - 1, -1, -1):
        for c in range(channels - 1, -1, -1):
            h, K, S = H[c], gains[k, c], variances[k, c]
            lam = lam - h * (np.sum(K * lam) + errors[k, c] / S)
            left = np.eye(s) - np.outer(K, h)
            lam_spread = left.T @ lam_spread @ left + np.outer(h, h) / S
        means[k] -= covariances[k] @ lam
        covariances[k] -= covariances[k] @ lam_spread @ covariances[k]
        lam = A.T @ lam
        lam_spread = A.T @ lam_spread @ A
    return means, covariances
