"""Kalman filter, smoother and whitening of a linear model with scalar measurements.

The model is

    z(k+1) = A z(k) + B u(k) + w(k),    y_c(k) = h_c' z(k) + n_c(k),

with white w of covariance f(k) Q and white n_c of variance R_c. Measurements are taken one by one,
which is exact for independent noise and needs no matrix inverse. All functions are compiled;
`predict`, `update` and `measure` work in place, so that a kernel with a larger state can call them
step by step. In the functions for whole logs each measurement is that of one state, and the first
state has a mean and a covariance: measurements follow the first step. ``s`` is the number of
states; a constant lets the compiler unroll the loops over them.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from stickslip.compiled import compiled

Vector = Float[np.ndarray, " s"]
Matrix = Float[np.ndarray, "s s"]
Inputs = Float[np.ndarray, "n m"]
Measured = Float[np.ndarray, "n c"]


class LinearModel(NamedTuple):
    """A model over each of n samples, and its sensors."""

    A: Matrix  # transition
    B: Float[np.ndarray, "s m"]  # of the inputs, held over a sample
    Q: Matrix  # covariance of the process noise of a sample
    factors: Float[np.ndarray, " n"]  # f, of that covariance
    sensors: Int[np.ndarray, " c"]  # number of the state that each sensor measures
    R: Float[np.ndarray, " c"]  # variance of each sensor's noise


@compiled(inline=True)
def predict(
    A: Matrix,
    Q: Matrix,
    P: Matrix,
    work: Matrix,
    states: int = 0,
    factor: float = 1.0,
    upper: bool = False,
) -> None:
    """Advance a covariance over a sample in place: P <- A P A' + f Q.

    Parameters
    ----------
    A, Q, P, work, factor
        As in the equation, and room for a product [any units]; 0 ``states`` are those of P.
    upper
        Whether A is upper triangular, of which the zeros are then left out.
    """
    s = states if states > 0 else P.shape[0]
    for i in range(s):
        for j in range(s):
            total = 0.0
            for h in range(i if upper else 0, s):
                total += A[i, h] * P[h, j]
            work[i, j] = total
    for i in range(s):
        for j in range(i, s):
            total = Q[i, j] * factor
            for h in range(j if upper else 0, s):
                total += work[i, h] * A[j, h]
            P[i, j] = total
            P[j, i] = total


@compiled(inline=True)
def update(h: Vector, R: float, P: Matrix, gain: Vector, states: int = 0) -> float:
    """Condition a covariance on one measurement in place; return the innovation's variance.

    S = h' P h + R, K = P h / S, P <- P - K S K'.

    Parameters
    ----------
    h, R, P, gain
        As in the equations; the gain K is left in ``gain`` [any units].
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


@compiled(inline=True)
def measure(state: int, R: float, P: Matrix, gain: Vector, states: int = 0) -> float:
    """Condition a covariance on a measurement of one state, as `update` with a unit vector h.

    S = P_ii + R, K = P_i / S, P <- P - K S K'.

    Parameters
    ----------
    R, P, gain
        As of `update` [any units].
    """
    s = states if states > 0 else P.shape[0]
    variance = P[state, state] + R
    for j in range(s):
        gain[j] = P[j, state] / variance
    for j in range(s):
        for h in range(j, s):
            P[j, h] -= gain[j] * gain[h] * variance
            P[h, j] = P[j, h]
    return variance


@compiled(inline=True)
def _whiten(
    model: LinearModel,
    inputs: Float[np.ndarray, "n m q"],
    measured: Float[np.ndarray, "n c q"],
    first: Float[np.ndarray, "s q"],
    spread: Matrix,
    s: int,
) -> tuple[Float[np.ndarray, "n c q"], float]:
    """`whiten` for s states."""
    A, B, Q, factors, sensors, R = model
    n, channels, q = measured.shape
    m = B.shape[1]
    z, moved = first.copy(), np.empty((s, q))
    P, work, gain = spread.copy(), np.empty((s, s)), np.empty(s)
    rows = np.empty((n, channels, q))
    logs = 0.0
    for k in range(n):
        for i in range(s):
            for j in range(q):
                total = 0.0
                for h in range(s):
                    total += A[i, h] * z[h, j]
                drive = 0.0
                for h in range(m):
                    drive += B[i, h] * inputs[k, h, j]
                moved[i, j] = total + drive
        z, moved = moved, z
        predict(A, Q, P, work, s, factors[k])
        for c in range(channels):
            S = measure(sensors[c], R[c], P, gain, s)
            logs += np.log(S)
            root = np.sqrt(S)
            for j in range(q):
                e = measured[k, c, j] - z[sensors[c], j]
                rows[k, c, j] = e / root
                for h in range(s):
                    z[h, j] += gain[h] * e
    return rows, logs


@compiled()
def whiten(
    model: LinearModel,
    inputs: Float[np.ndarray, "n m q"],
    measured: Float[np.ndarray, "n c q"],
    first: Float[np.ndarray, "s q"],
    spread: Matrix,
) -> tuple[Float[np.ndarray, "n c q"], float]:
    """Return normalised innovations (y - h' z) / sqrt(S) of q signals, and the sum of log S.

    The filter is linear, so that signals that share its covariances (a measurement and the
    responses to regressors, for example) are whitened together.

    Parameters
    ----------
    inputs, measured
        Inputs of each sample, and measurements at its end [any units].
    first, spread
        Mean and covariance of the first state [any units].
    """
    if model.A.shape[0] == 2:
        return _whiten(model, inputs, measured, first, spread, 2)
    if model.A.shape[0] == 4:
        return _whiten(model, inputs, measured, first, spread, 4)
    return _whiten(model, inputs, measured, first, spread, model.A.shape[0])


@compiled(inline=True)
def _filter(
    model: LinearModel,
    inputs: Inputs,
    measured: Measured,
    first: Vector,
    spread: Matrix,
    kept: tuple[Float[np.ndarray, "k s"], Float[np.ndarray, "k s s"]],
    s: int,
) -> float:
    """Return `cost` for s states; keep means and covariances predicted, as far as there is room."""
    A, B, Q, factors, sensors, R = model
    means, spreads = kept
    n, channels = measured.shape
    m, room = B.shape[1], means.shape[0]
    z, moved, gain = first.copy(), np.empty(s), np.empty(s)
    P, work = spread.copy(), np.empty((s, s))
    cost = 0.0
    if room > 0:
        means[0], spreads[0] = z, P
    for k in range(n):
        for i in range(s):
            total = 0.0
            for h in range(m):
                total += B[i, h] * inputs[k, h]
            for h in range(s):
                total += A[i, h] * z[h]
            moved[i] = total
        z, moved = moved, z
        predict(A, Q, P, work, s, factors[k])
        if k + 1 < room:
            means[k + 1], spreads[k + 1] = z, P
        for c in range(channels):
            S = measure(sensors[c], R[c], P, gain, s)
            e = measured[k, c] - z[sensors[c]]
            cost += np.log(S) + e * e / S
            for j in range(s):
                z[j] += gain[j] * e
    return cost


@compiled()
def cost(
    model: LinearModel, inputs: Inputs, measured: Measured, first: Vector, spread: Matrix
) -> float:
    """Return twice the negative log likelihood but for a constant, sum of log S + e^2 / S.

    Parameters
    ----------
    inputs, measured, first, spread
        As of `whiten` [any units].
    """
    s = model.A.shape[0]
    none = np.empty((0, s)), np.empty((0, s, s))
    if s == 3:
        return _filter(model, inputs, measured, first, spread, none, 3)
    if s == 5:
        return _filter(model, inputs, measured, first, spread, none, 5)
    return _filter(model, inputs, measured, first, spread, none, s)


@compiled(inline=True)
def _smooth(
    model: LinearModel,
    measured: Measured,
    means: Float[np.ndarray, "n+1 s"],
    spreads: Float[np.ndarray, "n+1 s s"],
    spreads_of: Int[np.ndarray, " q"],
    s: int,
) -> Float[np.ndarray, "n+1 s+q"]:
    """Smooth predictions for s states, backward; see `smooth`."""
    A, _, _, _, sensors, R = model
    n, channels = measured.shape
    out = np.empty((n + 1, s + spreads_of.size))
    lam, g, z = np.zeros(s), np.zeros(s), np.zeros(s)
    L, P, M = np.zeros((s, s)), np.zeros((s, s)), np.zeros((s, s))
    K, S, e = np.zeros((channels, s)), np.ones(channels), np.zeros(channels)
    for k in range(n, -1, -1):
        if k > 0:
            for j in range(s):
                z[j] = means[k, j]
                for h in range(s):
                    P[j, h] = spreads[k, j, h]
            for c in range(channels):  # the updates once more, forward
                S[c] = measure(sensors[c], R[c], P, K[c], s)
                e[c] = measured[k - 1, c] - z[sensors[c]]
                for j in range(s):
                    z[j] += K[c, j] * e[c]
            for c in range(channels - 1, -1, -1):
                i = sensors[c]
                gain, total = 0.0, 0.0
                for j in range(s):
                    gain += K[c, j] * lam[j]
                    g[j] = 0.0
                    for h in range(s):
                        g[j] += L[j, h] * K[c, h]
                    total += K[c, j] * g[j]
                lam[i] -= gain + e[c] / S[c]
                for j in range(s):
                    L[i, j] -= g[j]
                for j in range(s):
                    L[j, i] -= g[j]
                L[i, i] += total + 1.0 / S[c]
        for j in range(s):
            out[k, j] = means[k, j]
            for h in range(s):
                out[k, j] -= spreads[k, j, h] * lam[h]
        for which in range(spreads_of.size):
            i = spreads_of[which]
            drop = 0.0
            for j in range(s):
                for h in range(s):
                    drop += spreads[k, i, j] * L[j, h] * spreads[k, i, h]
            out[k, s + which] = np.sqrt(max(spreads[k, i, i] - drop, 0.0))
        for i in range(s):
            g[i] = 0.0
            for h in range(s):
                g[i] += A[h, i] * lam[h]
        for i in range(s):
            lam[i] = g[i]
            for j in range(s):
                M[i, j] = 0.0
                for h in range(s):
                    M[i, j] += L[i, h] * A[h, j]
        for i in range(s):
            for j in range(s):
                total = 0.0
                for h in range(s):
                    total += A[h, i] * M[h, j]
                L[i, j] = total
    return out


@compiled()
def smooth(
    model: LinearModel,
    inputs: Inputs,
    measured: Measured,
    first: Vector,
    spread: Matrix,
    spreads_of: Int[np.ndarray, " q"],
) -> Float[np.ndarray, "n+1 s+q"]:
    """Return means of the states given all measurements, then standard deviations of some of them.

    The adjoint l and its covariance L run backward through the updates of the filter, so that no
    covariance is inverted (modified Bryson-Frazier smoother, Bierman 1973):

        l <- l - h (K' l + e/S),  L <- (I - K h')' L (I - K h') + h h'/S  over an update,
        l <- A' l,                L <- A' L A                             over a sample,

    and the smoothed state is z - P l with covariance P - P L P.

    Parameters
    ----------
    inputs, measured, first, spread
        As of `whiten` [any units].
    spreads_of
        Numbers of the states whose standard deviations follow.
    """
    n, s = measured.shape[0], model.A.shape[0]
    means, spreads = np.empty((n + 1, s)), np.empty((n + 1, s, s))
    kept = means, spreads
    if s == 3:
        _filter(model, inputs, measured, first, spread, kept, 3)
        return _smooth(model, measured, means, spreads, spreads_of, 3)
    if s == 5:
        _filter(model, inputs, measured, first, spread, kept, 5)
        return _smooth(model, measured, means, spreads, spreads_of, 5)
    _filter(model, inputs, measured, first, spread, kept, s)
    return _smooth(model, measured, means, spreads, spreads_of, s)
