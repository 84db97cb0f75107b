"""Motion of the flexible arm while its driven mass slips one way, under a held effort.

The state is x = (x1, v1, x2, v2). With the net force f = u - F (effort less Coulomb friction and
offset) the arm is linear (van de Wijdeven 2002 A Eqs. 2.1-2.3 for x1' > 0, c inside A):

    x1' = v1,  v1' = (f - c v1 - ks (x1 - x2))/m1,  x2' = v2,  v2' = ks (x1 - x2)/m2.
"""

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled

__all__ = ["forced_states", "short_response", "velocity_minima"]

Values = NDArray[np.float64]

_TERMS = 16  # of the series within a step h with (w + c/m1) h <= 1/2: 0.5^17/17! = 2e-20
_HALVINGS = 60


@compiled()
def forced_states(M: Values, x: Values, f: Values) -> Values:
    """Return the states from x on under the net forces f, each held for a step.

    M, shape (4, 5), is [A_d B_d] of one step: x_{k+1} = A_d x_k + B_d f_k.
    """
    n = f.shape[0]
    X = np.empty((n + 1, 4))
    for i in range(4):
        X[0, i] = x[i]
    for k in range(n):
        for i in range(4):
            X[k + 1, i] = (
                M[i, 0] * X[k, 0]
                + M[i, 1] * X[k, 1]
                + M[i, 2] * X[k, 2]
                + M[i, 3] * X[k, 3]
                + M[i, 4] * f[k]
            )
    return X


@compiled()
def _series(
    m1: float,
    m2: float,
    ks: float,
    c: float,
    x1: float,
    v1: float,
    x2: float,
    v2: float,
    f: float,
    C: Values,
) -> None:
    """Write the Taylor coefficients of v1 under the held net force f: v1(t) = sum C_i t^i."""
    a, b, d, g = v1, v2, x1 - x2, f  # coefficients of v1, v2, x1 - x2 and the net force
    C[0] = a
    for i in range(1, _TERMS + 1):
        a_next = (g - c * a - ks * d) / m1 / i
        b_next = ks * d / m2 / i
        d = (a - b) / i
        a, b, g = a_next, b_next, 0.0
        C[i] = a


@compiled()
def _value(C: Values, t: float) -> float:
    total = 0.0
    for i in range(_TERMS, -1, -1):
        total = total * t + C[i]
    return total


@compiled()
def _slope(C: Values, t: float) -> float:
    total = 0.0
    for i in range(_TERMS, 0, -1):
        total = total * t + i * C[i]
    return total


@compiled()
def _curvature(C: Values, t: float) -> float:
    total = 0.0
    for i in range(_TERMS, 1, -1):
        total = total * t + i * (i - 1) * C[i]
    return total


@compiled()
def _slope_zero(C: Values, low: float, high: float) -> float:
    """Return where the slope turns from negative to positive."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if _slope(C, middle) < 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@compiled()
def _curvature_zero(C: Values, low: float, high: float) -> float:
    """Return where the curvature changes its sign."""
    rising = _curvature(C, low) < 0.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if (_curvature(C, middle) < 0.0) == rising:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@compiled()
def _dip(C: Values, h: float) -> float:
    """Return the instant within (0, h) of the lowest local minimum of v1; -1 if there is none.

    The curvature changes its sign at most once in so short a step, so that one instant decides
    whether the slope does so although its signs at both ends do not tell.
    """
    begin, end = _slope(C, 0.0), _slope(C, h)
    if begin < 0.0 < end:
        return _slope_zero(C, 0.0, h)
    bent, straightened = _curvature(C, 0.0), _curvature(C, h)
    if begin >= 0.0 and end >= 0.0 and bent < 0.0 < straightened:
        middle = _curvature_zero(C, 0.0, h)
        if _slope(C, middle) < 0.0:
            return _slope_zero(C, middle, h)
    elif begin <= 0.0 and end <= 0.0 and bent > 0.0 > straightened:
        middle = _curvature_zero(C, 0.0, h)
        if _slope(C, middle) > 0.0:
            return _slope_zero(C, 0.0, middle)
    return -1.0


@compiled()
def short_response(m1: float, m2: float, ks: float, c: float, t: float) -> Values:
    """Return v1 at a short time t per unit of x1, v1, x2, v2 at its start and of the net force."""
    C = np.empty(_TERMS + 1)
    g = np.empty(5)
    _series(m1, m2, ks, c, 1.0, 0.0, 0.0, 0.0, 0.0, C)
    g[0] = _value(C, t)
    _series(m1, m2, ks, c, 0.0, 1.0, 0.0, 0.0, 0.0, C)
    g[1] = _value(C, t)
    _series(m1, m2, ks, c, 0.0, 0.0, 1.0, 0.0, 0.0, C)
    g[2] = _value(C, t)
    _series(m1, m2, ks, c, 0.0, 0.0, 0.0, 1.0, 0.0, C)
    g[3] = _value(C, t)
    _series(m1, m2, ks, c, 0.0, 0.0, 0.0, 0.0, 1.0, C)
    g[4] = _value(C, t)
    return g


@compiled()
def velocity_minima(
    m1: float, m2: float, ks: float, c: float, h: float, X: Values, f: Values
) -> Values:
    """Return the local minima of v1 strictly between the first and the last instant.

    One row each: step, time within the step, v1. A minimum at the begin of a step has time 0.
    """
    n = f.shape[0]
    found = np.empty((2 * n, 3))
    count = 0
    before = 1.0  # slope at the end of the step before
    C = np.empty(_TERMS + 1)
    for k in range(n):
        force = f[k] - ks * (X[k, 0] - X[k, 2])
        begin = (force - c * X[k, 1]) / m1
        if k > 0 and before <= 0.0 <= begin:
            found[count, 0], found[count, 1], found[count, 2] = k, 0.0, X[k, 1]
            count += 1
        end = (f[k] - ks * (X[k + 1, 0] - X[k + 1, 2]) - c * X[k + 1, 1]) / m1
        _series(m1, m2, ks, c, X[k, 0], X[k, 1], X[k, 2], X[k, 3], f[k], C)
        t = _dip(C, h)
        if t > 0.0:
            found[count, 0], found[count, 1], found[count, 2] = k, t, _value(C, t)
            count += 1
        before = end
    return found[:count]
