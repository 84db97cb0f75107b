"""The first zero of a polynomial, and transition matrices with thirty digits."""

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip.simulation.kernels.double_double import arm_increment
from stickslip.simulation.kernels.first_root import DEGREE, WORK_SIZE, first_root

DOUBLE_DOUBLE = 1e-30  # two doubles hold 106 bits; the series and the squarings lose a few
ROUNDING = 1e-13  # of a simple zero of a polynomial with coefficients of order 1


def polynomial(zeros):
    """Coefficients, lowest first, of the polynomial with these zeros, positive at 0."""
    q = np.polynomial.polynomial.polyfromroots(zeros)
    return q * np.sign(q[0]) / np.abs(q).max()


def find(q, sign=1.0):
    work = np.full(WORK_SIZE, np.nan)
    work[0, : len(q)] = q
    return first_root(work, 0, len(q) - 1, sign)


@given(st.lists(st.integers(1, 400), min_size=1, max_size=6, unique=True), st.booleans())
@settings(max_examples=300, deadline=None)
def test_the_leftmost_of_many_zeros_is_found(hundredths, mirrored):
    zeros = np.array(sorted(hundredths)) / 100.0
    sign = -1.0 if mirrored else 1.0
    root, _ = find(sign * polynomial(zeros), sign)
    if zeros[0] < 1.0:
        # what coefficients rounded to doubles do to a zero among its neighbours
        others = np.abs(np.delete(zeros, 0) - zeros[0])
        assert root == pytest.approx(zeros[0], abs=ROUNDING / np.prod(others / (1 + zeros[1:])))
    elif zeros[0] > 1.0:
        assert root == 2.0


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-6])
def test_a_double_crossing_is_seen_although_the_ends_agree_in_sign(gap):
    root, _ = find(polynomial([0.3 - gap, 0.3 + gap]))
    assert root == pytest.approx(0.3 - gap, abs=1e-15 / gap)


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-6])
def test_a_near_miss_is_no_zero_and_its_distance_is_returned(gap):
    q = np.array([0.3**2 + gap**2, -0.6, 1.0])  # least at 0.3, where it is gap^2
    root, dip = find(q)
    assert root == 2.0
    assert gap**2 * (1 - 1e-3) <= dip <= 20 * gap**2  # the nearest end of a bisection


def test_without_a_zero_nothing_is_found():
    assert find([1.0, 0.5, 0.2])[0] == 2.0
    assert find([1.0])[0] == 2.0
    assert find([1.0] + [0.0] * (DEGREE - 1) + [-0.5])[0] == 2.0


def test_a_zero_at_the_end_is_found():
    root, _ = find([1.0, -1.0])
    assert root == pytest.approx(1.0, abs=ROUNDING)


def reference(m1, m2, ks, c, T, slipping):
    """exp(M T) - I with 60 digits, rows (x1, v1, d, v2, x2), columns (v1, d, v2, F)."""
    with mpmath.workdps(60):
        m1, m2, ks, c, T = (mpmath.mpf(value) for value in (m1, m2, ks, c, T))
        M = mpmath.zeros(6)
        M[2, 3], M[3, 2], M[4, 3] = -1, ks / m2, 1
        if slipping:
            M[0, 1], M[2, 1] = 1, 1
            M[1, 1], M[1, 2], M[1, 5] = -c / m1, -ks / m1, 1 / m1
        E = mpmath.expm(M * T, method="taylor") - mpmath.eye(6)
        return [[E[i, j] for j in (1, 2, 3, 5)] for i in range(5)]


@pytest.mark.parametrize("slipping", [True, False])
@pytest.mark.parametrize(
    ("m1", "m2", "ks", "c", "T"),
    [
        (1.0, 1.0, 1.0, 0.05, 0.01),
        (0.7, 2.3, 1.3, 0.0, 0.001),
        (1.0, 2.0, 9.0, 0.3, 2.0),
        (150.0, 20.0, 3e4, 700.0, 0.01),
        (1.0, 1.0, 1.0, 40.0, 2.0),
    ],
)
def test_increment_has_thirty_digits(m1, m2, ks, c, T, slipping):
    high, low = arm_increment((m1, m2, ks, c), T, slipping=slipping)
    for i, row in enumerate(reference(m1, m2, ks, c, T, slipping)):
        for j, exact in enumerate(row):
            with mpmath.workdps(60):
                got = mpmath.mpf(float(high[i, j])) + mpmath.mpf(float(low[i, j]))
                assert abs(got - exact) <= DOUBLE_DOUBLE * abs(exact)
    assert np.all(np.abs(low) <= np.spacing(np.abs(high)))
