"""Expected effect of sensor noise on energies and regressors (van de Wijdeven 2002, chapter 5).

A measured velocity is the true one plus white noise of standard deviation sigma (Eqs. 5.1-5.4).
Functions of a velocity [m/s or rad/s] take an array of any shape or a number, and return an array
of that shape. Noise is a standard deviation, of the unit of its quantity; a negative one is an
`InputError`.
"""

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.energy.published.kernels import (
    BIAS_OF_POLYNOMIAL,
    POLYNOMIAL_RANGE,
    bias_of_double_mean,
    double_mean,
    folded_mean,
    quartic_bias,
)
from stickslip.records import non_negative, positive

_SPEED = "m/s or rad/s"

SIXTH_ORDER = (
    0.0009382206513882359,
    -0.02409001748523754,
    0.3861122275439948,
    0.8008114763360322,
)
"""A_1 to A_4 of Eq. 5.21, fitted to Eq. 5.20 over abs(s) <= 3; within 0.0077."""

BIAS_OF_DOUBLE_MEAN = (
    1.1301194043941631,
    -1.0176746262320544,
    0.32374154175322806,
    -0.03643334765971691,
    0.00010808145353151144,
)
"""Of s^0 to s^4, fitted to the exact double expectation less s over 0 <= s <= 3; within 0.0018."""

Velocities = float | Sequence[float] | Float[np.ndarray, "..."]


@compiled(inline=True)
def mean_polynomial(m: float, sigma: float) -> float:
    """Return Eq. 5.20 by its even polynomial of order six (Eqs. 5.21, 5.22)."""
    if abs(m) > POLYNOMIAL_RANGE * sigma or sigma == 0.0:
        return abs(m)
    q = (m / sigma) * (m / sigma)
    A1, A2, A3, A4 = SIXTH_ORDER
    return sigma * (((A1 * q + A2) * q + A3) * q + A4)


@compiled(inline=True)
def double_mean_of_polynomial(m: float, sigma: float) -> float:
    """Return E_v of Eq. 5.21 at m - v (Eqs. 5.23, 5.24), abs(m) beyond 3 sigma (Eq. 5.22).

    With E v^2 = sigma^2, E v^4 = 3 sigma^4 and E v^6 = 15 sigma^6.
    """
    if abs(m) > POLYNOMIAL_RANGE * sigma or sigma == 0.0:
        return abs(m)
    q = (m / sigma) * (m / sigma)
    A1, A2, A3, A4 = SIXTH_ORDER
    sixth = ((q + 15.0) * q + 45.0) * q + 15.0
    fourth = (q + 6.0) * q + 3.0
    return sigma * (A1 * sixth + A2 * fourth + A3 * (q + 1.0) + A4)


def kinetic_energy_bias(inertia: float, velocity_noise: float) -> float:
    """Return what noise adds to the kinetic energy of one mass in expectation [J] (Eq. 5.6).

    >>> kinetic_energy_bias(2.0, 0.5)
    0.25
    """
    return 0.5 * inertia * velocity_noise**2


def potential_energy_bias(
    stiffness: float, position_noise: float, load_position_noise: float
) -> float:
    """Return what noise at both ends adds to the mean energy of the spring [J] (Eq. 5.7)."""
    return 0.5 * stiffness * (position_noise**2 + load_position_noise**2)


def viscous_regressor_bias(velocity_noise: float, sampling_time: float, samples: int) -> float:
    """Return what noise adds to T times the sum of squared velocities [m^2/s or rad^2/s].

    Eq. 5.25, sigma^2 T times the number of samples, k + 1 up to sample k.
    """
    return velocity_noise**2 * sampling_time * samples


def absolute_density(values: Velocities, mean: float, noise: float) -> Float[np.ndarray, "..."]:
    """Return the probability density of abs(X), X normal (Eqs. 5.15, 5.16); noise is above 0.

    >>> absolute_density([-1.0, 0.0], 0.0, 1.0).round(4)
    array([0.    , 0.7979])
    """
    positive("noise", noise, _SPEED)
    y = np.asarray(values, dtype=np.float64)
    below, above = (np.exp(-0.5 * ((branch - mean) / noise) ** 2) for branch in (-y, y))
    density = (below + above) / (noise * np.sqrt(2.0 * np.pi))
    return np.asarray(np.where(y < 0.0, 0.0, density))


def absolute_mean(velocity: Velocities, noise: float) -> Float[np.ndarray, "..."]:
    """Return the expected absolute value of a noisy velocity (Eq. 5.20, a folded normal).

    >>> absolute_mean([0.0, 0.1], 0.05).round(4)
    array([0.0399, 0.1008])
    """
    return _each(folded_mean, velocity, noise)


def absolute_mean_polynomial(velocity: Velocities, noise: float) -> Float[np.ndarray, "..."]:
    """Return the same by the published polynomial of order six, up to 3 sigma (Eqs. 5.21, 5.22)."""
    return _each(mean_polynomial, velocity, noise)


def double_absolute_mean(measured_velocity: Velocities, noise: float) -> Float[np.ndarray, "..."]:
    """Return E_v of the expected absolute value at the measured velocity less v.

    What Eq. 5.24 approximates, exactly: h(a) = (2 sigma / sqrt(pi)) exp(-a^2 / (4 sigma^2)) +
    a erf(a / (2 sigma)). It treats the true velocity as scattered about the measured one, and so is
    itself biased: averaged over the measurements at rest, h(a) - a is 0.584 sigma where noise has
    added 0.798 sigma, and at 2 sigma it is 0.196 sigma where noise has added 0.017 sigma.
    """
    return _each(double_mean, measured_velocity, noise)


def double_absolute_mean_polynomial(
    measured_velocity: Velocities, noise: float
) -> Float[np.ndarray, "..."]:
    """Return the same by the polynomial as printed (Eqs. 5.22, 5.24).

    It runs the polynomial of order six beyond the 3 sigma that it holds for, so it is too large by
    0.06 sigma at 2 sigma and by 0.54 sigma at 3 sigma.
    """
    return _each(double_mean_of_polynomial, measured_velocity, noise)


def absolute_bias(measured_velocity: Velocities, noise: float) -> Float[np.ndarray, "..."]:
    """Return h(a) - a at a = abs(measured velocity): what is subtracted from it.

    T times the sum of it is W_c of Eq. 5.27.

    >>> absolute_bias([0.0, 0.1, -0.1], 0.05).round(4)
    array([0.0564, 0.005 , 0.005 ])
    """
    return _each(bias_of_double_mean, measured_velocity, noise)


def absolute_bias_polynomial(
    measured_velocity: Velocities, noise: float, *, of: Literal["polynomial", "double_mean"]
) -> Float[np.ndarray, "..."]:
    """Return the bias by the published polynomial of order four in the absolute velocity.

    It needs odd powers too; beyond 3 sigma it is zero. It was fitted to Eq. 5.24 as printed
    (``"polynomial"``), or to the exact double expectation (``"double_mean"``).
    """
    coefficients = BIAS_OF_POLYNOMIAL if of == "polynomial" else BIAS_OF_DOUBLE_MEAN
    return _each(lambda m, sigma: quartic_bias(m, sigma, coefficients), measured_velocity, noise)


def _each(
    kernel: Callable[[float, float], float], velocity: Velocities, noise: float
) -> Float[np.ndarray, "..."]:
    """Return what a kernel makes of every velocity."""
    sigma = non_negative("noise", noise, _SPEED)
    values = np.asarray(velocity, dtype=np.float64)
    made = [kernel(value, sigma) for value in values.ravel().tolist()]
    return np.array(made, dtype=np.float64).reshape(values.shape)
