"""Kernels of the published energy estimator: expected noise, sums, rows and the recursion.

Source: van de Wijdeven (2002), part A, chapters 3 to 6.

The fields of the recursion (`stickslip.estimation.online.recursion`) come first, behind them those
of the sums. A sample passes `stickslip.estimation.online.faults.admission`
first. The published balance cannot leave a sample out: the work in it would be missing from then
on. A missing or impossible value is replaced, the effort by the last one, the motion by one of
constant velocity. Estimates that are not finite are replaced by the last valid ones
(`stickslip.estimation.online.faults.guard`).
"""

import math
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.energy.balance import squared_velocity, turning_distance
from stickslip.estimation.online.faults.admission import ADMISSION_DTYPE, admit, continued
from stickslip.estimation.online.faults.guard import guard_dtype, stays_valid
from stickslip.estimation.online.method import State
from stickslip.estimation.online.recursion import RECURSION, VALUES, update
from stickslip.numerics.named_fields import fields_at, place_of, places

MOST_VALUES = 4  # f_c, c, B, S

SUMS = np.dtype(
    [
        ("samples", "i8"),
        ("work", "f8"),
        ("travel", "f8"),  # first regressor
        ("square", "f8"),  # second regressor
        ("correction", "f8"),  # W_c
        ("last_effort", "f8"),
        ("last_position", "f8"),
        ("last_velocity", "f8"),
    ]
)
"""Sums, which begin at zero in a new run."""

_LEARNED: list[Any] = [
    ("recursion", RECURSION),
    ("inertia", "f8"),
    ("settled_sums", "i8"),  # 1 for sums that are exact under a held effort
    ("compensation", "i8"),  # 0 none, 1 by the printed polynomial, 2 exact
    ("noise", "f8"),  # standard deviation of the velocity; negative: needed and not known
    ("level_bias", "f8"),  # bracket of Eq. 5.26
    ("prediction_error", "f8"),
    ("sums", SUMS),
]
_FIELDS = np.dtype(
    [
        *_LEARNED,
        ("admission", ADMISSION_DTYPE),
        ("guard", guard_dtype(places(np.dtype(_LEARNED)))),
    ]
)
STATE_SIZE = places(_FIELDS)
NOISE = place_of(_FIELDS, "noise")  # negative while it is not known

fields = fields_at(_FIELDS)

POLYNOMIAL_RANGE = 3.0
"""Standard deviations up to which the polynomials hold (Eqs. 5.21, 5.22)."""

BIAS_OF_POLYNOMIAL = (
    1.1361291565940794,
    -1.071061075829815,
    0.4392381553227702,
    -0.12282161254536852,
    0.02452687081397115,
)
"""Of s^0 to s^4, s the velocity over the standard deviation of its noise: fitted to Eq. 5.24 less s
over 0 <= s <= 3 by least squares, every s weighing the same; within 0.0089."""

_FAR = 9.0  # standard deviations at which the bias is less than the rounding of abs(m)
_ROOT_TWO = math.sqrt(2.0)
_ROOT_TWO_OVER_PI = math.sqrt(2.0 / math.pi)

_REVERSAL = 12.0
"""A change of the velocity's sign within a sample is a reversal only if it changes by more standard
deviations of its noise: with half the true one assumed, the velocities of a rest differ by that
once in 45 000 samples. What a smaller reversal adds to the travel is less than noise does."""


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
def double_mean(m: float, sigma: float) -> float:
    """Return E_v g(m - v) with g of Eq. 5.20: a folded normal of variance 2 sigma^2."""
    return folded_mean(m, _ROOT_TWO * sigma)


@compiled(inline=True)
def quartic_bias(
    m: float, sigma: float, coefficients: tuple[float, float, float, float, float]
) -> float:
    """Return a bias of abs(m) by a polynomial of order four in abs(m) / sigma; 0 beyond 3 sigma."""
    if abs(m) > POLYNOMIAL_RANGE * sigma or sigma == 0.0:
        return 0.0
    s = abs(m) / sigma
    a0, a1, a2, a3, a4 = coefficients
    return sigma * ((((a4 * s + a3) * s + a2) * s + a1) * s + a0)


@compiled(inline=True)
def bias_of_double_mean(m: float, sigma: float) -> float:
    """Return h(abs(m)) - abs(m), h the exact double expectation."""
    return double_mean(m, sigma) - abs(m)


@compiled(inline=True)
def _target_and_row(own: Any, u: float, x: float, v: float, x2: float, v2: float) -> float:
    """Add one sample to the sums, write W(k) to the state and return y(k) (Eqs. 4.3, 4.4).

    The printed sums are by backward Euler: T u(k) x1'(k), T abs(x1'(k)), T x1'(k)^2 (Eqs. 3.6,
    4.3). Compensated, the bracket of Eq. 5.26 is added to y, and [W_c, sigma^2 T (k + 1)] is
    subtracted from W (Eq. 5.27). The settled sums take the travel from positions and its sign from
    two velocities: noise does not lengthen it, so W_c is not subtracted there, and the squared
    velocity T (v_-^2 + v_- v + v^2) / 3 gains 2/3 sigma^2 T a sample.
    """
    sums = own.sums
    T, sigma = own.recursion.sampling_time, own.noise
    compensated = own.compensation > 0
    settled = own.settled_sums > 0  # read once: a second read, after a store, slows a step by 30 %
    bias = 0.0
    if own.compensation == 1:  # Eq. 5.24 by the polynomial of order four
        bias = quartic_bias(v, sigma, BIAS_OF_POLYNOMIAL)
    elif own.compensation == 2:
        bias = bias_of_double_mean(v, sigma)
    if not settled:
        sums.work += T * u * v
        sums.correction += T * bias
        sums.travel += T * abs(v) - T * bias
        squared = T * v * v
        if compensated:
            squared -= T * sigma * sigma
        sums.square += squared
    elif sums.samples > 0:
        v0 = sums.last_velocity
        dx = x - sums.last_position
        sums.work += sums.last_effort * dx
        sums.correction += T * bias
        if v0 * v < 0.0 and abs(v - v0) > _REVERSAL * sigma:
            sums.travel += turning_distance(v0, v, dx, T)
        else:
            sums.travel += dx if v0 + v >= 0.0 else -dx
        squared = squared_velocity(v0, v, v - v0, T)
        if compensated:
            squared -= 2.0 / 3.0 * T * sigma * sigma
        sums.square += squared
    if settled:
        sums.last_effort, sums.last_position, sums.last_velocity = u, x, v
    sums.samples += 1
    own.recursion.row[0] = sums.travel
    own.recursion.row[1] = sums.square
    if own.recursion.parameters > 2:  # Eq. 6.2
        own.recursion.row[2] = 1.0
        own.recursion.row[3] = sums.correction
    kinetic = 0.5 * own.inertia * v * v + 0.5 * own.recursion.load_inertia * v2 * v2
    potential = 0.5 * own.recursion.stiffness * (x - x2) * (x - x2)
    y = sums.work - kinetic - potential
    return y + own.level_bias if compensated else y


@compiled(brief=True)
def published_energy_step(s: State, u: float, x: float, v: float, x2: float, v2: float) -> bool:
    """Take one sample into the state, in place; return whether all was finite (Eqs. 4.3-4.10).

    None is taken while the noise is needed and not known.
    """
    own = fields(s)
    whole = np.isfinite(u + x + v)
    if own.recursion.stiffness > 0.0:
        whole = whole and np.isfinite(x2 + v2)
    if own.noise < 0.0:
        return False
    ready, u, _, x, v, x2, v2, stepped = admit(own.admission, u, x, v, x2, v2)
    if not ready:
        return whole
    predicted, velocity = continued(own.admission.driven)
    x, v = predicted if np.isnan(x) else x, velocity if np.isnan(v) else v
    if own.recursion.stiffness > 0.0:
        predicted, velocity = continued(own.admission.load)
        x2, v2 = predicted if np.isnan(x2) else x2, velocity if np.isnan(v2) else v2
    else:
        x2, v2 = 0.0, 0.0
    if stepped:
        own.sums.last_position = x - own.recursion.sampling_time * v
    y = _target_and_row(own, u, x, v, x2, v2)
    e = y
    for i in range(own.recursion.parameters):
        e -= own.recursion.row[i] * own.recursion.values[i]
    own.prediction_error = e  # Eq. 4.9
    update(own.recursion, y, own.recursion.forgetting, True)
    stays_valid(s, own.guard, VALUES, MOST_VALUES)
    return whole


@compiled()
def published_energy_run(
    s: State, samples: Float[np.ndarray, "n 5"]
) -> tuple[Float[np.ndarray, "n p"], Float[np.ndarray, " n"]]:
    """Take many samples, in place; return the estimates after each, and the errors before it."""
    own = fields(s)
    n, p = samples.shape[0], own.recursion.parameters
    history, errors = np.empty((n, p)), np.empty(n)
    for k in range(n):
        u, x, v, x2, v2 = samples[k, 0], samples[k, 1], samples[k, 2], samples[k, 3], samples[k, 4]
        published_energy_step(s, u, x, v, x2, v2)
        errors[k] = own.prediction_error
        for i in range(p):
            history[k, i] = own.recursion.values[i]
    return history, errors


@compiled()
def published_energy_rows(
    s: State, samples: Float[np.ndarray, "n 5"]
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, "n p"]]:
    """Return y(k) and W(k) of many samples without estimating anything; the state's sums move."""
    own = fields(s)
    n, p = samples.shape[0], own.recursion.parameters
    targets, rows = np.empty(n), np.empty((n, p))
    for k in range(n):
        u, x, v, x2, v2 = samples[k, 0], samples[k, 1], samples[k, 2], samples[k, 3], samples[k, 4]
        targets[k] = _target_and_row(own, u, x, v, x2, v2)
        for i in range(p):
            rows[k, i] = own.recursion.row[i]
    return targets, rows
