"""Kalman filter and smoother of linear states, of which some are measured one by one."""

import numpy as np
from jaxtyping import Float, Int

from stickslip.compiled import compiled

__all__ = ["filtered", "smoothed"]


@compiled(inline=True)
def _filter(
    A: Float[np.ndarray, "s s"],
    B: Float[np.ndarray, " s"],
    Q: Float[np.ndarray, "s s"],
    freedom: Float[np.ndarray, " n"],
    u: Float[np.ndarray, " n"],
    measured: Float[np.ndarray, "n m"],
    channels: Float[np.ndarray, "m 2"],
    first: Float[np.ndarray, " s"],
    states: Float[np.ndarray, "k s"],
    spreads: Float[np.ndarray, "k s s"],
    s: int,
) -> float:
    """Run the Kalman filter; keep its predictions where there is room for them.

    ``Q`` times its freedom is what a sample adds to the covariance. Returns the cost, twice the
    negative log likelihood.
    """
    n, m = measured.shape
    kept = states.shape[0]
    z, w, K = np.zeros(s), np.zeros(s), np.zeros(s)
    P, M = np.zeros((s, s)), np.zeros((s, s))
    for i in range(s):
        P[i, i] = first[i]
    for c in range(m):
        z[int(channels[c, 0])] = measured[0, c]
    cost = 0.0
    for k in range(n):
        if k < kept:
            for i in range(s):
                states[k, i] = z[i]
                for j in range(s):
                    spreads[k, i, j] = P[i, j]
        if k > 0:
            for c in range(m):
                i = int(channels[c, 0])
                S = P[i, i] + channels[c, 1]
                e = measured[k, c] - z[i]
                cost += np.log(S) + e * e / S
                for j in range(s):
                    K[j] = P[j, i] / S
                for j in range(s):
                    z[j] += K[j] * e
                    for h in range(j, s):
                        P[j, h] -= K[j] * K[h] * S
                        P[h, j] = P[j, h]
        for i in range(s):
            total = B[i] * u[k]
            for h in range(s):
                total += A[i, h] * z[h]
            w[i] = total
            for j in range(s):
                total = 0.0
                for h in range(s):
                    total += A[i, h] * P[h, j]
                M[i, j] = total
        for i in range(s):
            z[i] = w[i]
            for j in range(i, s):
                total = Q[i, j] * freedom[k]
                for h in range(s):
                    total += M[i, h] * A[j, h]
                P[i, j] = total
                P[j, i] = total
    return cost


@compiled(inline=True)
def _smooth(
    A: Float[np.ndarray, "s s"],
    measured: Float[np.ndarray, "n m"],
    channels: Float[np.ndarray, "m 2"],
    states: Float[np.ndarray, "n s"],
    spreads: Float[np.ndarray, "n s s"],
    spreads_of: Int[np.ndarray, " q"],
    s: int,
) -> Float[np.ndarray, "n c"]:
    """Return the smoothed states, then the standard deviations of some of them.

    The adjoint l and its covariance L run backward through the updates that the filter made, so
    that no covariance is inverted (modified Bryson-Frazier smoother, Bierman 1973).
    """
    n, m = measured.shape
    out = np.empty((n, s + spreads_of.size))
    lam, g, z = np.zeros(s), np.zeros(s), np.zeros(s)
    L, P, M = np.zeros((s, s)), np.zeros((s, s)), np.zeros((s, s))
    K, S, e = np.zeros((m, s)), np.ones(m), np.zeros(m)
    for k in range(n - 1, -1, -1):
        if k > 0:
            for j in range(s):
                z[j] = states[k, j]
                for h in range(s):
                    P[j, h] = spreads[k, j, h]
            for c in range(m):  # the updates once more, forward
                i = int(channels[c, 0])
                S[c] = P[i, i] + channels[c, 1]
                e[c] = measured[k, c] - z[i]
                for j in range(s):
                    K[c, j] = P[j, i] / S[c]
                for j in range(s):
                    z[j] += K[c, j] * e[c]
                    for h in range(s):
                        P[j, h] -= K[c, j] * K[c, h] * S[c]
            for c in range(m - 1, -1, -1):
                i = int(channels[c, 0])
                gain, total = 0.0, 0.0
                for j in range(s):
                    gain += K[c, j] * lam[j]
                    g[j] = 0.0
                    for h in range(s):
                        g[j] += L[j, h] * K[c, h]
                    total += K[c, j] * g[j]
                lam[i] -= gain + e[c] / S[c]
                # L <- (I - K H)' L (I - K H) + H' H / S
                for j in range(s):
                    L[i, j] -= g[j]
                for j in range(s):
                    L[j, i] -= g[j]
                L[i, i] += total + 1.0 / S[c]
        for j in range(s):
            out[k, j] = states[k, j]
            for h in range(s):
                out[k, j] -= spreads[k, j, h] * lam[h]
        for which in range(spreads_of.size):
            i = spreads_of[which]
            drop = 0.0
            for j in range(s):
                for h in range(s):
                    drop += spreads[k, i, j] * L[j, h] * spreads[k, i, h]
            out[k, s + which] = np.sqrt(max(spreads[k, i, i] - drop, 0.0))
        # Back over the sample: l <- A' l, L <- A' L A
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
def filtered(
    A: Float[np.ndarray, "s s"],
    B: Float[np.ndarray, " s"],
    Q: Float[np.ndarray, "s s"],
    freedom: Float[np.ndarray, " n"],
    u: Float[np.ndarray, " n"],
    measured: Float[np.ndarray, "n m"],
    channels: Float[np.ndarray, "m 2"],
    first: Float[np.ndarray, " s"],
    states: Float[np.ndarray, "k s"],
    spreads: Float[np.ndarray, "k s s"],
) -> float:
    """`_filter` with a number of states that the compiler knows: the loops over them unroll."""
    if B.size == 3:
        return _filter(A, B, Q, freedom, u, measured, channels, first, states, spreads, 3)
    return _filter(A, B, Q, freedom, u, measured, channels, first, states, spreads, 5)


@compiled()
def smoothed(
    A: Float[np.ndarray, "s s"],
    measured: Float[np.ndarray, "n m"],
    channels: Float[np.ndarray, "m 2"],
    states: Float[np.ndarray, "n s"],
    spreads: Float[np.ndarray, "n s s"],
    spreads_of: Int[np.ndarray, " q"],
) -> Float[np.ndarray, "n c"]:
    """`_smooth` with a number of states that the compiler knows."""
    if A.shape[0] == 3:
        return _smooth(A, measured, channels, states, spreads, spreads_of, 3)
    return _smooth(A, measured, channels, states, spreads, spreads_of, 5)
