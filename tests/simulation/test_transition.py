import mpmath
import numpy as np
import pytest

from stickslip.simulation.kernels.double_double import arm_increment

# The two doubles hold 106 bits; the series and the squarings lose a few.
DOUBLE_DOUBLE = 1e-30


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
