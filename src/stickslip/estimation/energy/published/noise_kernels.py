"""Expected error of the absolute value of a noisy velocity, one sample.

Source: van de Wijdeven (2002), part A, Eqs. 5.20-5.24.

Polynomials are in s, a velocity over the standard deviation of its noise. Their coefficients are
those of least squares over the whole range, every s weighing the same.
"""

import math

from stickslip.compiled import compiled

__all__ = [
    "BIAS_OF_DOUBLE_MEAN",
    "BIAS_OF_POLYNOMIAL",
    "RANGE",
    "SIXTH_ORDER",
    "bias_of_double_mean",
    "bias_of_polynomial",
    "double_mean",
    "double_mean_of_polynomial",
    "folded_mean",
    "mean_polynomial",
    "quartic_bias",
]

RANGE = 3.0
"""Standard deviations up to which the polynomials hold (Eqs. 5.21, 5.22)."""

SIXTH_ORDER = (
    0.0009382206513882359,
    -0.02409001748523754,
    0.3861122275439948,
    0.8008114763360322,
)
"""A_1 to A_4 of Eq. 5.21, fitted to Eq. 5.20 over abs(s) <= 3; within 0.0077."""

BIAS_OF_POLYNOMIAL = (
    1.1361291565940794,
    -1.071061075829815,
    0.4392381553227702,
    -0.12282161254536852,
    0.02452687081397115,
)
"""Of s^0 to s^4, fitted to Eq. 5.24 less s over 0 <= s <= 3; within 0.0089."""

BIAS_OF_DOUBLE_MEAN = (
    1.1301194043941631,
    -1.0176746262320544,
    0.32374154175322806,
    -0.03643334765971691,
    0.00010808145353151144,
)
"""Of s^0 to s^4, fitted to the exact double expectation less s over 0 <= s <= 3; within 0.0018."""

_FAR = 9.0  # standard deviations at which the bias is less than the rounding of abs(m)
_ROOT_TWO = math.sqrt(2.0)
_ROOT_TWO_OVER_PI = math.sqrt(2.0 / math.pi)


@compiled(inline=True)
def folded_mean(m: float, sigma: float) -> float:
    """Return E abs(m + v) of normal v (Eq. 5.20, a folded normal).

    sqrt(2/pi) sigma exp(-m^2 / (2 sigma^2)) + m erf(m / (sqrt(2) sigma)), which is abs(m) in
    double precision where noise does not turn the sign.
    """
    if abs(m) >= _FAR * sigma:
        return abs(m)
    s = m / sigma
    return _ROOT_TWO_OVER_PI * sigma * math.exp(-0.5 * s * s) + m * math.erf(s / _ROOT_TWO)


@compiled(inline=True)
def mean_polynomial(m: float, sigma: float) -> float:
    """Return Eq. 5.20 by its even polynomial of order six (Eqs. 5.21, 5.22)."""
    if abs(m) > RANGE * sigma or sigma == 0.0:
        return abs(m)
    q = (m / sigma) * (m / sigma)
    A1, A2, A3, A4 = SIXTH_ORDER
    return sigma * (((A1 * q + A2) * q + A3) * q + A4)


@compiled(inline=True)
def double_mean(m: float, sigma: float) -> float:
    """Return E_v g(m - v) with g of Eq. 5.20: a folded normal of variance 2 sigma^2."""
    return folded_mean(m, _ROOT_TWO * sigma)


@compiled(inline=True)
def double_mean_of_polynomial(m: float, sigma: float) -> float:
    """Return E_v of Eq. 5.21 at m - v (Eqs. 5.23, 5.24), abs(m) beyond 3 sigma (Eq. 5.22).

    With E v^2 = sigma^2, E v^4 = 3 sigma^4 and E v^6 = 15 sigma^6.
    """
    if abs(m) > RANGE * sigma or sigma == 0.0:
        return abs(m)
    q = (m / sigma) * (m / sigma)
    A1, A2, A3, A4 = SIXTH_ORDER
    sixth = ((q + 15.0) * q + 45.0) * q + 15.0
    fourth = (q + 6.0) * q + 3.0
    return sigma * (A1 * sixth + A2 * fourth + A3 * (q + 1.0) + A4)


@compiled(inline=True)
def quartic_bias(
    m: float, sigma: float, coefficients: tuple[float, float, float, float, float]
) -> float:
    """Return a bias of abs(m) by a polynomial of order four in abs(m) / sigma; 0 beyond 3 sigma."""
    if abs(m) > RANGE * sigma or sigma == 0.0:
        return 0.0
    s = abs(m) / sigma
    a0, a1, a2, a3, a4 = coefficients
    return sigma * ((((a4 * s + a3) * s + a2) * s + a1) * s + a0)


@compiled(inline=True)
def bias_of_polynomial(m: float, sigma: float) -> float:
    """Return Eq. 5.24 less abs(m), by the polynomial of order four of van de Wijdeven (2002)."""
    return quartic_bias(m, sigma, BIAS_OF_POLYNOMIAL)


@compiled(inline=True)
def bias_of_double_mean(m: float, sigma: float) -> float:
    """Return h(abs(m)) - abs(m), h the exact double expectation."""
    return double_mean(m, sigma) - abs(m)
