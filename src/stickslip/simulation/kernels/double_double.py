"""Double-double arithmetic, and the transition matrices of the arm in it.

A number is kept as the sum of two doubles, with about 31 digits (T. J. Dekker, "A floating-point
technique for extending the available precision", Numer. Math. 18 (1971), pp. 224-242).

A sampled simulation applies the same matrix at every sample, so that its rounding error is not
averaged away but adds up. The matrices are therefore computed with about 31 digits and handed on as
the sum of two doubles. What is stored is the increment exp(M T) - I: its error is relative to the
small change in a sample and not to the state.
"""

from functools import lru_cache

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from stickslip.compiled import compiled

_SPLIT = 134217729.0  # 2^27 + 1, Dekker's splitting constant
_TERMS = 28  # of the exponential series, at most
_REMAINDER = 1e-34  # of the series, relative to the smallest entries: those of fifth order
_SERIES_NORM = 0.25  # largest norm of a step at which the series converges to `_REMAINDER`

Matrix = NDArray[np.float64]


@compiled(inline=True)
def accumulate(high: float, low: float, increment: float) -> tuple[float, float]:
    """Add to a double-double value; a zero increment leaves it bitwise the same.

    Dekker's fast two-sum: where the increment is the larger one, what it misses is within the
    increment's own rounding.
    """
    t = increment + low
    s = high + t
    return s, t - (s - high)


@compiled(inline=True)
def two_sum(a: float, b: float) -> tuple[float, float]:
    """Return a + b and what it rounds away."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@compiled(inline=True)
def two_product(a: float, b: float) -> tuple[float, float]:
    """Return a b and what it rounds away."""
    p = a * b
    t = _SPLIT * a
    ah = t - (t - a)
    al = a - ah
    t = _SPLIT * b
    bh = t - (t - b)
    bl = b - bh
    return p, ((ah * bh - p) + ah * bl + al * bh) + al * bl


@compiled(inline=True)
def add(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """Return (ah + al) + (bh + bl)."""
    s, e = two_sum(ah, bh)
    t, f = two_sum(al, bl)
    s, e = two_sum(s, e + t)
    return two_sum(s, e + f)


@compiled(inline=True)
def multiply(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """Return (ah + al) (bh + bl)."""
    p, e = two_product(ah, bh)
    return two_sum(p, e + (ah * bl + al * bh))


@compiled(inline=True)
def divide(ah: float, al: float, b: float) -> tuple[float, float]:
    """Return (ah + al) / b."""
    q1 = ah / b
    ph, pl = two_product(q1, b)
    rh, rl = add(ah, al, -ph, -pl)
    q2 = rh / b
    ph, pl = two_product(q2, b)
    rh, rl = add(rh, rl, -ph, -pl)
    sh, sl = two_sum(q1, q2)
    return two_sum(sh, sl + rh / b)


@compiled()
def _matrix_product(ah: Matrix, al: Matrix, bh: Matrix, bl: Matrix, ch: Matrix, cl: Matrix) -> None:
    """C = A B for square double-double matrices."""
    n = ah.shape[0]
    for i in range(n):
        for j in range(n):
            sh, sl = 0.0, 0.0
            for k in range(n):
                if ah[i, k] != 0.0 and bh[k, j] != 0.0:
                    ph, pl = multiply(ah[i, k], al[i, k], bh[k, j], bl[k, j])
                    sh, sl = add(sh, sl, ph, pl)
            ch[i, j] = sh
            cl[i, j] = sl


@compiled()
def _arm_transition(
    m1: float, m2: float, ks: float, c: float, T: float, slipping: bool
) -> tuple[Matrix, Matrix]:
    """Return exp(M T) - I of the arm, high and low parts: their sum is accurate to about 1e-30.

    The state is (x1, v1, d, v2, x2, F) with the held force F = u - s fc and d = x1 - x2:
    x1' = v1, v1' = (F - c v1 - ks d)/m1, d' = v1 - v2, v2' = ks d/m2, x2' = v2, F' = 0
    (van de Wijdeven 2002 A Eqs. 2.1-2.3 while the first mass slips). While it rests only the second
    moves.
    """
    n = 6
    mh, ml = np.zeros((n, n)), np.zeros((n, n))
    norm = (np.sqrt(ks / m1 + ks / m2) + c / m1) * T
    halvings = 0
    step = T
    while norm > _SERIES_NORM:
        norm *= 0.5
        step *= 0.5
        halvings += 1
    h, l = two_product(ks, step)  # noqa: E741 (high and low part)
    mh[2, 3] = -step
    mh[4, 3] = step
    mh[3, 2], ml[3, 2] = divide(h, l, m2)
    if slipping:
        mh[0, 1] = step
        mh[2, 1] = step
        mh[1, 2], ml[1, 2] = divide(-h, -l, m1)
        h, l = two_product(c, step)  # noqa: E741
        mh[1, 1], ml[1, 1] = divide(-h, -l, m1)
        mh[1, 5], ml[1, 5] = divide(step, 0.0, m1)
    # Horner's scheme for E = M (I + M/2 (I + M/3 (...))), in increments: E <- M/k + (M/k) E
    eh, el, ph, pl = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    terms, term = 5, 1.0 / 120.0
    while terms < _TERMS and term > _REMAINDER:
        terms += 1
        term *= norm / terms
    for k in range(terms, 0, -1):
        _matrix_product(mh, ml, eh, el, ph, pl)
        for i in range(n):
            for j in range(n):
                h, l = add(mh[i, j], ml[i, j], ph[i, j], pl[i, j])  # noqa: E741
                eh[i, j], el[i, j] = divide(h, l, float(k)) if h != 0.0 else (0.0, 0.0)
    # exp(2M) - I = 2E + E E
    for _ in range(halvings):
        _matrix_product(eh, el, eh, el, ph, pl)
        for i in range(n):
            for j in range(n):
                eh[i, j], el[i, j] = add(2.0 * eh[i, j], 2.0 * el[i, j], ph[i, j], pl[i, j])
    return eh, el


@lru_cache(maxsize=1024)
def arm_increment(
    constants: tuple[float, float, float, float], sampling_time: float, *, slipping: bool
) -> Float[np.ndarray, "2 5 4"]:
    """Return the increments of (x1, v1, d, v2, x2) over a sample in terms of (v1, d, v2, F).

    The arm has the constants (m1, m2, ks, c); the high and the low part are stacked, read-only.
    """
    m1, m2, ks, c = constants
    parts = _arm_transition(m1, m2, ks, c, sampling_time, slipping)
    increment = np.stack([part[:5, [1, 2, 3, 5]] for part in parts])
    increment.flags.writeable = False
    return increment
