"""Energies of an axis and the regressors of its friction (van de Wijdeven 2002, chapters 3 and 4).

Two forms. The printed one sums by backward Euler (Eqs. 3.6-4.4) and is biased when the effort is
held over each sample. The other uses that the effort *is* held: the work of a sample is exactly
u(k-1) [x1(k) - x1(k-1)], and the way travelled is exactly the sum of position increments between
reversals.
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled

__all__ = [
    "published_step",
    "sample_integrals",
    "squared_velocity",
    "travel_direction",
    "turning_way",
    "whiten_levels",
]


@compiled(inline=True)
def published_step(u: float, v: float, T: float) -> tuple[float, float, float]:
    """Return the work and the two regressors of one sample as printed (Eqs. 3.6, 4.3).

    (T u(k) x1'(k), T abs(x1'(k)), T x1'(k)^2)
    """
    return T * u * v, T * abs(v), T * v * v


@compiled(inline=True)
def turning_way(v_before: float, v: float, dx: float, T: float) -> float:
    """Return the way travelled in a sample in which the velocity changes sign.

    That of a constant acceleration, T (v_-^2 + v^2) / (2 abs(v - v_-)), and never less than the
    displacement.
    """
    return max(0.5 * T * (v_before * v_before + v * v) / abs(v - v_before), abs(dx))


@compiled(inline=True)
def squared_velocity(v_before: float, v: float, dv: float, T: float) -> float:
    """Return the integral of the squared velocity over a sample (Eq. 4.3, second order).

    That of a constant acceleration, T (v_-^2 + v_- v + v^2) / 3, written T (v_- v + dv^2 / 3) with
    dv the smoothed change of velocity: successive errors do not correlate, so noise leaves no bias.
    """
    return T * (v_before * v + dv * dv / 3.0)


@compiled()
def sample_integrals(
    x: Float[np.ndarray, " n"],
    v: Float[np.ndarray, " n"],
    smooth_v: Float[np.ndarray, " n"],
    direction: Float[np.ndarray, " n-1"],
    T: float,
    noisy: bool,
) -> tuple[Float[np.ndarray, " n-1"], Float[np.ndarray, " n-1"]]:
    """Return the way travelled and the integral of the squared velocity of every sample.

    With ``noisy``, the sign of a single velocity is not used, only ``direction``.
    """
    n = x.size - 1
    path, squared = np.empty(n), np.empty(n)
    for k in range(n):
        dx = x[k + 1] - x[k]
        path[k] = direction[k] * dx
        if not noisy and v[k] * v[k + 1] < 0.0:
            path[k] = turning_way(v[k], v[k + 1], dx, T)
        squared[k] = squared_velocity(v[k], v[k + 1], smooth_v[k + 1] - smooth_v[k], T)
    return path, squared


@compiled()
def travel_direction(x: Float[np.ndarray, " n"], hysteresis: float) -> Float[np.ndarray, " n-1"]:
    """Return the direction of travel (-1, 0 or +1) over each sample.

    A reversal counts once the position has come back from its furthest point by more than the
    hysteresis, and then from that point on: noise smaller than the hysteresis makes no reversals,
    and none is late. Where the position never leaves the hysteresis, the direction is 0.
    """
    n = x.size - 1
    direction = np.zeros(n)
    way, last = 0.0, 0
    high, low, at_high, at_low = x[0], x[0], 0, 0
    for k in range(1, n + 1):
        if x[k] >= high:
            high, at_high = x[k], k
        if x[k] <= low:
            low, at_low = x[k], k
        if way >= 0.0 and high - x[k] > hysteresis:
            turn = at_high
            direction[last:turn] = 1.0
            way, last = -1.0, turn
            low, at_low = x[k], k
        elif way <= 0.0 and x[k] - low > hysteresis:
            turn = at_low
            direction[last:turn] = -1.0
            way, last = 1.0, turn
            high, at_high = x[k], k
    direction[last:] = way
    return direction


@compiled()
def whiten_levels(
    levels: Float[np.ndarray, "n c"],
    disturbance: Float[np.ndarray, " n-1"],
    noise: Float[np.ndarray, " n"],
) -> tuple[Float[np.ndarray, "n-1 c"], Float[np.ndarray, " n-1"]]:
    """Whiten levels that carry white noise and the sum of a force disturbance.

    The level's error is B(k) + e(k): e white with the variances ``noise``, and B a random walk
    whose steps have the variances ``disturbance``. The Kalman filter of B, run over the measured
    energy and over every regressor alike, leaves innovations that are white, so that ordinary least
    squares on them is generalised least squares on the levels.

    Returns
    -------
    The innovations divided by their standard deviations, and their variances. The first level only
    sets the filter off; it holds the unknown constant.
    """
    n, c = levels.shape
    white = np.empty((n - 1, c))
    variance = np.empty(n - 1)
    b = levels[0].copy()
    p = noise[0]
    for k in range(1, n):
        p += disturbance[k - 1]
        S = p + noise[k]
        K = p / S
        root = np.sqrt(S)
        for j in range(c):
            e = levels[k, j] - b[j]
            white[k - 1, j] = e / root
            b[j] += K * e
        p = K * noise[k]
        variance[k - 1] = S
    return white, variance
