"""Kernels of the standard deviations of online estimates, as exported code gives them."""

import math

from stickslip.compiled import compiled
from stickslip.estimation.energy.known_inertia.online.state import fields as energy_fields
from stickslip.estimation.online.kalman import state as kalman
from stickslip.estimation.online.method import State


@compiled()
def energy_deviation(s: State, i: int) -> float:
    """Return the standard deviation of estimate i by the model of the recursion; infinite at first.

    sqrt(P_ii e' S^-1 e / n), the sum of squared innovations over their variances.
    """
    own = energy_fields(s)
    if own.recursion.first_spread[i] == 0.0:
        return math.inf
    variance = own.recursion.spread[i, i]
    if own.rows > 0.0:
        variance = variance * own.residual_squares / own.rows
    return math.sqrt(max(variance, 0.0))


@compiled()
def kalman_deviation(vector: State, i: int) -> float:
    """Return the standard deviation of estimate i by the model of the filter in use."""
    s = kalman.fields(vector)
    k = 2 + i
    variance = s.sharp.P[k, k] if s.stage == kalman.TRUSTED else s.careful.P[k, k]
    return math.sqrt(max(variance, 0.0))
