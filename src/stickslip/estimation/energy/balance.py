"""Kernels of the regressors of friction (van de Wijdeven 2002, chapters 3 and 4).

They use that the effort is held over each sample: its work is exactly u(k-1) [x1(k) - x1(k-1)], and
the distance travelled is exactly the sum of position increments between reversals. The printed
sums by backward Euler are in `stickslip.estimation.energy.published.kernels`.
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled


@compiled(inline=True)
def turning_distance(v_before: float, v: float, dx: float, T: float) -> float:
    """Return the distance travelled in a sample in which the velocity changes sign.

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
    """Return the distance travelled and the integral of the squared velocity of every sample.

    With ``noisy``, the sign of a single velocity is not used, only ``direction``.
    """
    n = x.size - 1
    path, squared = np.empty(n), np.empty(n)
    for k in range(n):
        dx = x[k + 1] - x[k]
        path[k] = direction[k] * dx
        if not noisy and v[k] * v[k + 1] < 0.0:
            path[k] = turning_distance(v[k], v[k + 1], dx, T)
        squared[k] = squared_velocity(v[k], v[k + 1], smooth_v[k + 1] - smooth_v[k], T)
    return path, squared


@compiled()
def travel_direction(x: Float[np.ndarray, " n"], hysteresis: float) -> Float[np.ndarray, " n-1"]:
    """Return the direction of travel (-1, 0 or +1) over each sample.

    A reversal counts once the position has come back from its furthest point by more than the
    hysteresis, and then from that point on: noise smaller than the hysteresis makes no reversals,
    and none is delayed. Where the position never leaves the hysteresis, the direction is 0.
    """
    n = x.size - 1
    direction = np.zeros(n)
    heading, last = 0.0, 0
    high, low, at_high, at_low = x[0], x[0], 0, 0
    for k in range(1, n + 1):
        if x[k] >= high:
            high, at_high = x[k], k
        if x[k] <= low:
            low, at_low = x[k], k
        if heading >= 0.0 and high - x[k] > hysteresis:
            turn = at_high
            direction[last:turn] = 1.0
            heading, last = -1.0, turn
            low, at_low = x[k], k
        elif heading <= 0.0 and x[k] - low > hysteresis:
            turn = at_low
            direction[last:turn] = -1.0
            heading, last = 1.0, turn
            high, at_high = x[k], k
    direction[last:] = heading
    return direction
