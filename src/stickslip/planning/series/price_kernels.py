"""What the constraints of a move are worth to each pulse.

The price of a constraint is spread over the pulses by the costate p: p_k = A_d' p_{k+1} + w_k, with
w_k the prices of the velocity at the instant k; a net force in step k is then worth B_d' p_{k+1}.
"""

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled

__all__ = ["spread_over_rests", "worth_of_steps"]

Values = NDArray[np.float64]


@compiled()
def worth_of_steps(M: Values, p: Values, W: Values, D: Values) -> Values:
    """Return what a unit of net force in each step is worth.

    M, shape (4, 5), is [A_d B_d]; p the prices of the final state; W, shape (n, 4), those of the
    state at the begin of each step; D, shape (n,), what the force is worth within its own step.
    """
    n = D.shape[0]
    p0, p1, p2, p3 = p[0], p[1], p[2], p[3]
    worth = np.empty(n)
    for k in range(n - 1, -1, -1):
        worth[k] = M[0, 4] * p0 + M[1, 4] * p1 + M[2, 4] * p2 + M[3, 4] * p3 + D[k]
        q0 = M[0, 0] * p0 + M[1, 0] * p1 + M[2, 0] * p2 + M[3, 0] * p3 + W[k, 0]
        q1 = M[0, 1] * p0 + M[1, 1] * p1 + M[2, 1] * p2 + M[3, 1] * p3 + W[k, 1]
        q2 = M[0, 2] * p0 + M[1, 2] * p1 + M[2, 2] * p2 + M[3, 2] * p3 + W[k, 2]
        q3 = M[0, 3] * p0 + M[1, 3] * p1 + M[2, 3] * p2 + M[3, 3] * p3 + W[k, 3]
        p0, p1, p2, p3 = q0, q1, q2, q3
    return worth


@compiled(inline=True)
def _hat(k: float, a: float, b: float, c: float) -> float:
    """Return the hat function from a over b to c, at k in between."""
    if k < b:
        return (k - a) / (b - a)
    return (c - k) / (c - b) if k > b else 1.0


@compiled()
def spread_over_rests(t: Values, price: Values, n: int, near: float) -> tuple[Values, Values]:
    """Spread the prices of instants close to each other over the pulses between them.

    While mass 1 is to rest on the way, the velocity is bounded at every instant, and its price is a
    density. Blocks see it at single instants only; a hat function for each gives the density back.

    Parameters
    ----------
    t
        Instants in pulses, ascending.
    price
        Of the velocity there.
    n
        Pulses.
    near
        Instants no farther apart than this are of one rest.

    Returns
    -------
    spread
        Prices of the velocity at the begin of each pulse.
    left
        What of each price has not been spread: at the first and the last instant of a rest a part
        of it is no density.
    """
    spread = np.zeros(n)
    left = price.copy()
    for r in range(t.size):
        b = t[r]
        before = t[r] - t[r - 1] if r > 0 else 0.0
        after = t[r + 1] - t[r] if r + 1 < t.size else 0.0
        inside_before, inside_after = 0.0 < before <= near, 0.0 < after <= near
        share = price[r]
        if inside_before and inside_after:
            pass
        elif inside_after:
            share = min(share, 0.5 * price[r + 1])
        elif inside_before:
            share = min(share, 0.5 * price[r - 1])
        else:
            continue
        a = b - before if inside_before else b
        c = b + after if inside_after else b
        first, last = int(np.ceil(a)), min(int(np.floor(c)), n - 1)
        total = 0.0
        for k in range(first, last + 1):
            total += _hat(float(k), a, b, c)
        if total > 0.0:
            for k in range(first, last + 1):
                spread[k] += share * _hat(float(k), a, b, c) / total
            left[r] -= share
    return spread, left
