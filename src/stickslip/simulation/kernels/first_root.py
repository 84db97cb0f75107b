"""The first zero of a polynomial in an interval, found with certainty.

In Bernstein form a polynomial has as many zeros inside the interval as its coefficients have sign
variations, less an even number (Descartes' rule of signs). Halving (de Casteljau's algorithm)
until the count is 0 or 1 isolates the zeros, the leftmost first, also where two of them are too
near for an end-point test to see.
"""

import math

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled

Vector = NDArray[np.float64]

DEGREE = 18  # the highest degree
DEPTH = 50  # bisections: points at a distance of 2^-50 of the interval are still distinct
WORK_SIZE = (3 + DEPTH + 2, DEGREE + 1)  # the first three rows are left to the caller
SAFETY = 1.0 + 1e-9  # on bounds, against their own rounding

# By degree n: the j-th Bernstein coefficient is the sum over i of C(j, i) / C(n, i) q_i
BERNSTEIN = np.array(
    [
        [
            [math.comb(j, i) / math.comb(n, i) if i <= n else 0.0 for i in range(DEGREE + 1)]
            for j in range(DEGREE + 1)
        ]
        for n in range(DEGREE + 1)
    ]
)


@compiled()
def _polish(
    work: Vector, shift: int, n: int, a: float, b: float, sign: float, start: float
) -> float:
    """Return the zero of the polynomial in (a, b], where it has the given sign at a.

    ``start`` is how far into the interval the chord between its ends is zero.
    """
    t = a + (b - a) * start
    if not a < t < b:
        t = 0.5 * (a + b)
    last_step = 0.0  # nothing is known of how the steps shrink
    for _ in range(100):
        p, dp = work[0, shift + n], 0.0
        for j in range(n - 1, -1, -1):
            dp = dp * t + p
            p = p * t + work[0, shift + j]
        if p == 0.0:
            return t
        if sign * p > 0.0:
            a = t
        else:
            b = t
        step = p / dp
        new = t - step
        if a < new < b:
            # Newton's steps shrink quadratically: stop when the next one would be lost in rounding
            ratio = step / last_step
            if abs(step) * ratio * ratio < 1e-18 or new == t:
                return new
        else:
            new = 0.5 * (a + b)
            if new in (a, b):
                return b
            step = 0.0
        last_step = step
        t = new
    return t


@compiled()
def first_root(work: Vector, shift: int, n: int, sign: float) -> tuple[float, float]:
    """Find the first zero in (0, 1] of a polynomial q of degree n with ``sign q(0) > 0``.

    Its coefficients, lowest first, stand in the first row of ``work`` from ``shift`` on: a slice of
    an array costs a reference count, which is felt where this is called at every event. Returns the
    zero, or 2 if there is none; and without a zero, how near q came to one.
    """
    q_0 = work[0, shift]
    rest = 0.0
    slope = 0.0
    end = q_0
    for j in range(1, n + 1):
        rest += abs(work[0, shift + j])
        slope += j * abs(work[0, shift + j])
        end += work[0, shift + j]
    if abs(q_0) > rest * SAFETY:
        return 2.0, 1e300
    if n == 0:
        return 2.0, 1e300
    if 2.0 * abs(work[0, shift + 1]) > slope * SAFETY:  # |q1| > sum of the rest: monotone
        if sign * end > 0.0:
            return 2.0, 1e300
        return _polish(work, shift, n, 0.0, 1.0, sign, q_0 / (q_0 - end)), 1e300
    # Bernstein coefficients: as many zeros as sign variations, less an even number
    top = 3
    for j in range(n + 1):
        s = 0.0
        for i in range(j + 1):
            s += BERNSTEIN[n, j, i] * work[0, shift + i]
        work[top, j] = s
    # A stack of intervals, the leftmost on top. Dyadic ends are exact in floating point.
    left = 0.0
    width = 1.0
    depth = 0
    dip = 1e300
    while True:
        first = work[top, 0]
        last = work[top, n]
        dip = min(dip, abs(last))
        variations = 0
        previous = first
        for j in range(1, n + 1):
            b = work[top, j]
            if b != 0.0:
                if b * previous < 0.0:
                    variations += 1
                previous = b
        if sign * last <= 0.0 and (variations <= 1 or depth == DEPTH):
            chord = first / (first - last) if first != last else 0.5
            return _polish(work, shift, n, left, left + width, sign, chord), dip
        if variations == 0 or depth == DEPTH:
            # nothing here: go on to the next interval on the right
            left += width
            if left >= 1.0:
                return 2.0, dip
            top -= 1
            while left % (2.0 * width) == 0.0 and width < 1.0:
                width *= 2.0
                depth -= 1
            continue
        # halve: the right half stays at `top`, the left one goes above it (de Casteljau)
        above = top + 1
        for j in range(n + 1):
            work[above, j] = work[top, 0]
            for i in range(n - j):
                work[top, i] = 0.5 * (work[top, i] + work[top, i + 1])
        top = above
        width *= 0.5
        depth += 1
