"""Innovations of a slipping axis, with their derivatives by parameters and noise levels."""

import numpy as np
from jaxtyping import Float, Int

from stickslip.compiled import compiled
from stickslip.numerics.kalman import predict, update

__all__ = ["innovate"]


@compiled()
def innovate(
    A: Float[np.ndarray, "2 s s"],
    G: Float[np.ndarray, "2 q s 4"],
    dA: Float[np.ndarray, "2 p s s"],
    Q: Float[np.ndarray, "2 s s"],
    R: Float[np.ndarray, " c"],
    r: float,
    variance: float,
    A_n: Float[np.ndarray, "a 2 s s"],
    Q_n: Float[np.ndarray, "a 2 s s"],
    R_n: Float[np.ndarray, "a c"],
    r_n: Float[np.ndarray, " a"],
    variance_n: Float[np.ndarray, " a"],
    effort: Float[np.ndarray, " n"],
    rate: Float[np.ndarray, " n"],
    measured: Float[np.ndarray, "n c"],
    direction: Int[np.ndarray, " n"],
    shift: int,
    speed: float,
    rows: Float[np.ndarray, "n c q"],
) -> tuple[
    Float[np.ndarray, "q q"],
    Float[np.ndarray, "a q q"],
    float,
    Float[np.ndarray, " a"],
    Float[np.ndarray, "a a"],
    int,
]:
    """Run the filter over a log, and its derivatives beside it (forward mode).

    Column 0 of the states Z is the motion predicted, column j > 0 its derivative by parameter j at
    a fixed gain:

        z_0 <- A z_0 + G_0 f,
        z_j <- A z_j + dA_j z_0 + G_j f,
        z_0 <- z_0 + K e,   z_j <- z_j - K h' z_j,   e = y - h' z_0,

    with f = (u(k-1), u(k), 1, rate of change of the smoothed effort).

    The normalised rows are e/sqrt(S) and h' z_j/sqrt(S): the error of the parameters is their
    least-squares solution. The gain is held because its change multiplies white innovations, which
    are independent of it. By the noise levels everything is differentiated, the gain included:

        S_a = P_a,ii + R_a,  K_a = (P_a h - K S_a)/S,  P_a <- P_a - (K_a K' + K K_a') S - K K' S_a.

    Position and velocity start anew in each stretch of one direction; the disturbance goes on.

    Parameters
    ----------
    A, G, dA
        Axis in each direction; see `AxisModel`.
    Q, R
        Process noise in each direction, and noise of position and velocity.
    r, variance
        Correlation from sample to sample, and variance, of the disturbance.
    A_n, Q_n, R_n, r_n, variance_n
        Derivatives by the noise levels.
    effort, rate
        Of each sample, and rate of change of the smoothed effort.
    measured
        One column for the position, two with the velocity.
    direction
        Of travel: 1, -1, or 0 where the axis does not surely slip.
    shift
        Whole samples that the effort acts late.
    speed
        Standard deviation of the velocity that a stretch starts with.
    rows
        Takes the normalised innovations, zero where the axis does not surely slip; without room for
        them (n = 0) they are not kept.

    Returns
    -------
    Gramian of the rows and its derivatives; sum of log S and its derivatives; information on the
    noise levels, sum of S_a S_b/(2 S^2) + e_a e_b/S; number of innovations.
    """
    n, channels = measured.shape
    q, s, levels = G.shape[1], A.shape[1], Q_n.shape[0]
    kept = rows.shape[0] > 0
    Z, moved = np.zeros((q, s)), np.zeros((q, s))
    Z_n = np.zeros((levels, q, s))
    P, work = np.zeros((s, s)), np.zeros((s, s))
    P_n, K_n = np.zeros((levels, s, s)), np.zeros(s)
    K, h = np.zeros(s), np.zeros(s)
    e, forces = np.zeros(q), np.zeros(4)
    S_n, e_n = np.zeros(levels), np.zeros((levels, q))
    gram, gram_n = np.zeros((q, q)), np.zeros((levels, q, q))
    information, logs_n = np.zeros((levels, levels)), np.zeros(levels)
    logs, count = 0.0, 0
    forces[2] = 1.0
    d = s - 1
    P[d, d] = variance
    for a in range(levels):
        P_n[a, d, d] = variance_n[a]
    side = -1  # of the stretch under way; -1 outside of one
    for k in range(n):
        slipping = direction[k] != 0
        now = (0 if direction[k] > 0 else 1) if slipping else -1
        fresh = slipping and now != side
        if now != side:
            for j in range(q):
                Z[j, 0], Z[j, 1] = 0.0, 0.0
                for a in range(levels):
                    Z_n[a, j, 0], Z_n[a, j, 1] = 0.0, 0.0
            for i in range(s):
                for j in range(s):
                    if i < d or j < d:
                        P[i, j] = 0.0
                        for a in range(levels):
                            P_n[a, i, j] = 0.0
            if fresh:
                Z[0, 0] = measured[k, 0]
                P[0, 0], P[1, 1] = R[0], speed * speed
                for a in range(levels):
                    P_n[a, 0, 0] = R_n[a, 0]
            side = now
        if slipping:
            for c in range(channels):
                if fresh and c == 0:
                    continue
                h[:] = 0.0
                h[c] = 1.0
                for a in range(levels):
                    S_n[a] = P_n[a, c, c] + R_n[a, c]
                S = update(h, R[c], P, K)
                root = np.sqrt(S)
                logs += np.log(S)
                count += 1
                for j in range(q):
                    e[j] = -Z[j, c]
                e[0] += measured[k, c]
                for a in range(levels):
                    logs_n[a] += S_n[a] / S
                    for j in range(q):
                        e_n[a, j] = -Z_n[a, j, c]
                    for i in range(s):
                        K_n[i] = (P_n[a, i, c] - K[i] * S_n[a]) / S
                    for i in range(s):
                        for j in range(i, s):
                            P_n[a, i, j] -= (K_n[i] * K[j] + K[i] * K_n[j]) * S + (
                                K[i] * K[j] * S_n[a]
                            )
                            P_n[a, j, i] = P_n[a, i, j]
                    for j in range(q):
                        for i in range(s):
                            Z_n[a, j, i] += K_n[i] * e[j] + K[i] * e_n[a, j]
                for j in range(q):
                    for i in range(s):
                        Z[j, i] += K[i] * e[j]
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
                        information[a, b] += (
                            0.5 * S_n[a] * S_n[b] / S + e_n[a, 0] * e_n[b, 0]
                        ) / S
            first = max(k - shift - 1, 0)
            forces[0] = effort[min(first, n - 1)]
            now = min(max(k - shift, 0), n - 1)
            forces[1], forces[3] = effort[now], rate[now]
            for a in range(levels):
                for j in range(q):
                    for i in range(s):
                        total = 0.0
                        for g in range(s):
                            total += A[side, i, g] * Z_n[a, j, g] + A_n[a, side, i, g] * Z[j, g]
                            if j > 0:
                                total += dA[side, j - 1, i, g] * Z_n[a, 0, g]
                        moved[j, i] = total
                for j in range(q):
                    for i in range(s):
                        Z_n[a, j, i] = moved[j, i]
            for j in range(q):
                for i in range(s):
                    total = 0.0
                    for g in range(s):
                        total += A[side, i, g] * Z[j, g]
                        if j > 0:
                            total += dA[side, j - 1, i, g] * Z[0, g]
                    for g in range(4):
                        total += G[side, j, i, g] * forces[g]
                    moved[j, i] = total
            for j in range(q):
                for i in range(s):
                    Z[j, i] = moved[j, i]
            for a in range(levels):
                # A_a P A' + A P_a A' + A P A_a' + Q_a
                predict(A[side], Q_n[a, side], P_n[a], work)
                for i in range(s):
                    for j in range(s):
                        total = 0.0
                        for g in range(s):
                            total += A_n[a, side, i, g] * P[g, j]
                        work[i, j] = total
                for i in range(s):
                    for j in range(i, s):
                        total = P_n[a, i, j]
                        for g in range(s):
                            total += work[i, g] * A[side, j, g] + work[j, g] * A[side, i, g]
                        P_n[a, i, j] = total
                        P_n[a, j, i] = total
            predict(A[side], Q[side], P, work)
        else:
            # d <- r d, P_dd <- r^2 P_dd + (1 - r^2) variance
            for a in range(levels):
                P_n[a, d, d] = (
                    r * r * P_n[a, d, d]
                    + 2.0 * r * r_n[a] * (P[d, d] - variance)
                    + (1.0 - r * r) * variance_n[a]
                )
                for j in range(q):
                    Z_n[a, j, d] = r * Z_n[a, j, d] + r_n[a] * Z[j, d]
            P[d, d] = r * r * P[d, d] + (1.0 - r * r) * variance
            for j in range(q):
                Z[j, d] *= r
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
    return gram, gram_n, logs, logs_n, information, count
