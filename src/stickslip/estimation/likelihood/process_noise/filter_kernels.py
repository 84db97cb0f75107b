"""Innovations of a slipping axis, with their derivatives by parameters and noise levels."""

import numpy as np
from jaxtyping import Bool, Float, Int

from stickslip.compiled import compiled
from stickslip.numerics.kalman import predict, update

__all__ = ["innovate"]

_S = 5  # states, known to the compiler so that it unrolls the loops over them
_D = 2  # the disturbance, which goes on where the axis does not slip


@compiled()
def innovate(
    A: Float[np.ndarray, "2 s s"],
    G: Float[np.ndarray, "2 q s"],
    B: Float[np.ndarray, "2 q s"],
    dA: Float[np.ndarray, "2 p s s"],
    Q: Float[np.ndarray, "2 s s"],
    H: Float[np.ndarray, "c s"],
    dH: Float[np.ndarray, "p c s"],
    R: Float[np.ndarray, " c"],
    first: Float[np.ndarray, " s"],
    A_n: Float[np.ndarray, "a s s"],
    Q_n: Float[np.ndarray, "a 2 s s"],
    R_n: Float[np.ndarray, "a c"],
    first_n: Float[np.ndarray, "a s"],
    known: Float[np.ndarray, " n"],
    measured: Float[np.ndarray, "n c"],
    direction: Int[np.ndarray, " n"],
    renewed: Bool[np.ndarray, " n"],
    rows: Float[np.ndarray, "n c q"],
) -> tuple[
    Float[np.ndarray, "q q"],
    Float[np.ndarray, "a q q"],
    float,
    Float[np.ndarray, " a"],
    Float[np.ndarray, "a a"],
]:
    """Run the filter over a log, and its derivatives beside it (forward mode).

    Row 0 of the states Z is the motion predicted, row j > 0 its derivative by parameter j at a
    fixed gain:

        z_0 <- A z_0 + g_0 + b_0 j,        z_0 <- z_0 + K e_0,   e_0 = y - h' z_0,
        z_j <- A z_j + dA_j z_0 + g_j + b_j j,  z_j <- z_j + K e_j,   e_j = -h' z_j - dh_j' z_0.

    The normalised rows are e_0/sqrt(S) and -e_j/sqrt(S): the error of the parameters is their
    least-squares solution. The gain is held because its change multiplies white innovations, which
    are independent of it. By the noise levels everything is differentiated, the gain included:

        S_a = h' P_a h + R_a,  K_a = (P_a h - K S_a)/S,
        P_a <- P_a - (K_a K' + K K_a') S - K K' S_a,
        P_a <- A P_a A' + A_a P A' + A P A_a' + Q_a.

    All states but the disturbance start anew in each stretch of one direction.

    Parameters
    ----------
    A, G, B, dA
        Axis in each direction; see `AxisModel`.
    Q
        Process noise in each direction.
    H, dH, R
        Rows of the measurements (position, effort, and velocity if measured), their derivatives by
        the parameters, and variances of their noise.
    first
        Variances of the states at the start of a stretch; position and effort are measured there.
    A_n, Q_n, R_n, first_n
        Derivatives by the noise levels.
    known
        Part j of the effort of each sample that is known.
    measured
        Measurements of each sample, the effort less its known part and shifted by its delay in
        whole samples.
    direction
        Of travel: 1, -1, or 0 where the axis does not surely slip.
    renewed
        Where the effort jumps: its states start anew there.
    rows
        Takes the normalised innovations, zero where the axis does not surely slip; without room for
        them (n = 0) they are not kept.

    Returns
    -------
    Gramian of the rows and its derivatives; sum of log S and its derivatives; information on the
    noise levels, sum of S_a S_b/(2 S^2) + e_a e_b/S.
    """
    n, channels = measured.shape
    q, levels = G.shape[1], Q_n.shape[0]
    kept = rows.shape[0] > 0
    Z, Z_n = np.zeros((q, _S)), np.zeros((levels, q, _S))
    P, work = np.zeros((_S, _S)), np.zeros((_S, _S))
    P_n, K_n = np.zeros((levels, _S, _S)), np.zeros(_S)
    K, moved, e, e_n = np.zeros(_S), np.zeros((q, _S)), np.zeros(q), np.zeros((levels, q))
    S_n = np.zeros(levels)
    gram, gram_n = np.zeros((q, q)), np.zeros((levels, q, q))
    information, logs_n, logs = np.zeros((levels, levels)), np.zeros(levels), 0.0
    P[_D, _D] = first[_D]
    for a in range(levels):
        P_n[a, _D, _D] = first_n[a, _D]
    side = -1  # of the stretch under way; -1 outside of one
    for k in range(n):
        now = -1 if direction[k] == 0 else (0 if direction[k] > 0 else 1)
        fresh = now >= 0 and now != side
        if now != side:
            for i in range(_S):
                if i == _D:
                    continue
                for j in range(q):
                    Z[j, i] = 0.0
                    for a in range(levels):
                        Z_n[a, j, i] = 0.0
                for j in range(_S):
                    P[i, j], P[j, i] = 0.0, 0.0
                    for a in range(levels):
                        P_n[a, i, j], P_n[a, j, i] = 0.0, 0.0
                if now >= 0:
                    P[i, i] = first[i]
                    for a in range(levels):
                        P_n[a, i, i] = first_n[a, i]
            if now >= 0:
                Z[0, 0], Z[0, _D + 1] = measured[k, 0], measured[k, 1]
            side = now
        if now < 0:
            # d <- r d, P_dd <- r^2 P_dd + Q_dd
            r = A[0, _D, _D]
            for a in range(levels):
                P_n[a, _D, _D] = (
                    r * r * P_n[a, _D, _D]
                    + 2.0 * r * A_n[a, _D, _D] * P[_D, _D]
                    + Q_n[a, 0, _D, _D]
                )
                for j in range(q):
                    Z_n[a, j, _D] = r * Z_n[a, j, _D] + A_n[a, _D, _D] * Z[j, _D]
            P[_D, _D] = r * r * P[_D, _D] + Q[0, _D, _D]
            for j in range(q):
                Z[j, _D] *= r
            continue
        if renewed[k] and not fresh:
            for i in range(_D + 1, _S):
                for j in range(q):
                    Z[j, i] = 0.0
                    for a in range(levels):
                        Z_n[a, j, i] = 0.0
                for j in range(_S):
                    P[i, j], P[j, i] = 0.0, 0.0
                    for a in range(levels):
                        P_n[a, i, j], P_n[a, j, i] = 0.0, 0.0
                P[i, i] = first[i]
                for a in range(levels):
                    P_n[a, i, i] = first_n[a, i]
            Z[0, _D + 1] = measured[k, 1]
        for c in range(channels):
            if (fresh and c < 2) or (renewed[k] and c == 1):
                continue
            # Derivatives of the variance need the covariance before its update
            for a in range(levels):
                total = R_n[a, c]
                for i in range(_S):
                    for j in range(_S):
                        total += H[c, i] * P_n[a, i, j] * H[c, j]
                S_n[a] = total
            S = update(H[c], R[c], P, K, _S)
            logs += np.log(S)
            for j in range(q):
                total = measured[k, c] if j == 0 else 0.0
                for i in range(_S):
                    total -= H[c, i] * Z[j, i]
                    if j > 0:
                        total -= dH[j - 1, c, i] * Z[0, i]
                e[j] = total
            for a in range(levels):
                logs_n[a] += S_n[a] / S
                for j in range(q):
                    total = 0.0
                    for i in range(_S):
                        total -= H[c, i] * Z_n[a, j, i]
                        if j > 0:
                            total -= dH[j - 1, c, i] * Z_n[a, 0, i]
                    e_n[a, j] = total
                for i in range(_S):
                    total = -K[i] * S_n[a]
                    for j in range(_S):
                        total += P_n[a, i, j] * H[c, j]
                    K_n[i] = total / S
                for i in range(_S):
                    for j in range(_S):
                        P_n[a, i, j] -= (K_n[i] * K[j] + K[i] * K_n[j]) * S + (K[i] * K[j] * S_n[a])
                for j in range(q):
                    for i in range(_S):
                        Z_n[a, j, i] += K_n[i] * e[j] + K[i] * e_n[a, j]
            for j in range(q):
                for i in range(_S):
                    Z[j, i] += K[i] * e[j]
            root = np.sqrt(S)
            for j in range(q):
                if kept:
                    rows[k, c, j] = e[j] / root if j == 0 else -e[j] / root
                for i in range(j, q):
                    gram[j, i] += e[j] * e[i] / S
                    for a in range(levels):
                        gram_n[a, j, i] += (
                            e_n[a, j] * e[i] + e[j] * e_n[a, i] - e[j] * e[i] * S_n[a] / S
                        ) / S
            for a in range(levels):
                for b in range(a, levels):
                    information[a, b] += (0.5 * S_n[a] * S_n[b] / S + e_n[a, 0] * e_n[b, 0]) / S
        for a in range(levels):
            for j in range(q):
                for i in range(_S):
                    total = A_n[a, i, i] * Z[j, i]
                    for g in range(_S):
                        total += A[side, i, g] * Z_n[a, j, g]
                        if j > 0:
                            total += dA[side, j - 1, i, g] * Z_n[a, 0, g]
                    moved[j, i] = total
            for j in range(q):
                for i in range(_S):
                    Z_n[a, j, i] = moved[j, i]
        for j in range(q):
            for i in range(_S):
                total = G[side, j, i] + B[side, j, i] * known[k]
                for g in range(_S):
                    total += A[side, i, g] * Z[j, g]
                    if j > 0:
                        total += dA[side, j - 1, i, g] * Z[0, g]
                moved[j, i] = total
        for j in range(q):
            for i in range(_S):
                Z[j, i] = moved[j, i]
        for a in range(levels):
            predict(A[side], Q_n[a, side], P_n[a], work, _S)
            if A_n[a, _D, _D] != 0.0:  # the only entry of a transition that a level changes
                for i in range(_S):
                    total = 0.0
                    for g in range(_S):
                        total += A[side, i, g] * P[g, _D]
                    total *= A_n[a, _D, _D]
                    P_n[a, i, _D] += total
                    P_n[a, _D, i] += total
        predict(A[side], Q[side], P, work, _S)
    for j in range(q):
        for i in range(j):
            gram[j, i] = gram[i, j]
            for a in range(levels):
                gram_n[a, j, i] = gram_n[a, i, j]
    for a in range(levels):
        for b in range(a):
            information[a, b] = information[b, a]
    # The derivatives e_j = -h' z_j enter with the sign of the least-squares columns
    for j in range(1, q):
        gram[0, j], gram[j, 0] = -gram[0, j], -gram[j, 0]
        for a in range(levels):
            gram_n[a, 0, j], gram_n[a, j, 0] = -gram_n[a, 0, j], -gram_n[a, j, 0]
    return gram, gram_n, logs, logs_n, information
