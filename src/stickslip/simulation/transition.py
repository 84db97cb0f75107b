"""Transition matrices of linear plants under a held input, in double-double precision.

A sampled simulation applies the same matrix at every sample, so that its rounding error is not
averaged away but adds up. The matrices are therefore computed with about 31 digits and handed on
as the sum of two doubles. The increment exp(M T) - I is what is stored: its error is relative to
the small change in a sample and not to the state.
"""

from functools import lru_cache

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.simulation.kernels.double_double import add, divide, multiply, two_product

__all__ = ["arm_increment"]

Matrix = NDArray[np.float64]

_TERMS = 28  # of the exponential series, at most
_REMAINDER = 1e-34  # of the series, relative to the smallest entries: those of fifth order
_SERIES_NORM = 0.25


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
    """Return exp(M T) - I of the arm as a double-double matrix.

    The state is (x1, v1, d, v2, x2, F) with the held force F = u - s fc and d = x1 - x2:
    x1' = v1, v1' = (F - c v1 - ks d)/m1, d' = v1 - v2, v2' = ks d/m2, x2' = v2, F' = 0
    (van de Wijdeven 2002 A Eqs. 2.1-2.3 while the first mass slips). While it rests only the second
    moves.

    Returns
    -------
    high, low
        Shape (6, 6) each; their sum is accurate to about 1e-30.
    """
    n = 6
    mh = np.zeros((n, n))
    ml = np.zeros((n, n))
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
    eh = np.zeros((n, n))
    el = np.zeros((n, n))
    ph = np.zeros((n, n))
    pl = np.zeros((n, n))
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
    mass_1: float,
    mass_2: float,
    stiffness: float,
    viscous_friction: float,
    sampling_time: float,
    *,
    slipping: bool,
) -> Float[np.ndarray, "2 5 4"]:
    """Return the increments of (x1, v1, d, v2, x2) over a sample in terms of (v1, d, v2, F).

    Returns
    -------
    The high and the low part of the matrix, stacked; read-only.
    """
    high, low = _arm_transition(
        mass_1, mass_2, stiffness, viscous_friction, sampling_time, slipping
    )
    increment = np.stack([high[:5, [1, 2, 3, 5]], low[:5, [1, 2, 3, 5]]])
    increment.flags.writeable = False
    return increment
