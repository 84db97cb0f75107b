import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip.simulation.kernels.first_root import DEGREE, WORK_SIZE, first_root

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
def test_a_near_miss_is_no_zero_and_its_distance_is_told(gap):
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
