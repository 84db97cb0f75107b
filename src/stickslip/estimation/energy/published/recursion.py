"""Kernels of the published energy estimator: one sample into sums, a row, and the recursion.

The state is that of `stickslip.estimation.online.recursion`, with room for four parameters, and
behind it what the sums need. What lies where is given by the constants below.

A sample passes `stickslip.estimation.online.faults.admission` first. The published balance cannot
leave a sample out: the work in it would be missing from then on. A missing or impossible value is
replaced, the effort by the last one, the motion by one of constant velocity. Estimates that are not
finite are replaced by the last valid ones (`stickslip.estimation.online.faults.guard`).
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.energy.balance import published_step, squared_velocity, turning_way
from stickslip.estimation.energy.published.noise_kernels import (
    bias_of_double_mean,
    bias_of_polynomial,
)
from stickslip.estimation.online.faults.admission import (
    ADMISSION_DTYPE,
    ADMISSION_SIZE,
    admit,
    continued,
)
from stickslip.estimation.online.faults.guard import guard_size, stays_valid
from stickslip.estimation.online.recursion import FORGETTING, PARAMETERS, ROW, VALUES, update
from stickslip.numerics.named_fields import fields_at

__all__ = [
    "ADMISSION",
    "COMPENSATION",
    "COUNT",
    "GUARD",
    "INERTIA",
    "LEVEL_BIAS",
    "LOAD_INERTIA",
    "MOST_VALUES",
    "NOISE",
    "PREDICTION_ERROR",
    "SAMPLING_TIME",
    "SETTLED_SUMS",
    "STATE_SIZE",
    "STIFFNESS",
    "SUMS",
    "SUMS_END",
    "admission",
    "published_energy_rows",
    "published_energy_run",
    "published_energy_step",
]

MOST_VALUES = 4

# Settings
(
    SAMPLING_TIME,
    INERTIA,
    LOAD_INERTIA,
    STIFFNESS,
    SETTLED_SUMS,
    COMPENSATION,  # 0 none, 1 by the printed polynomial, 2 exact
    NOISE,  # standard deviation of the velocity; negative: not known, and nothing is taken
    LEVEL_BIAS,  # bracket of Eq. 5.26
    # What changes
    PREDICTION_ERROR,
    COUNT,
    WORK,
    WAY,  # first regressor
    SQUARE,  # second regressor
    CORRECTION,  # W_c
    LAST_EFFORT,
    LAST_POSITION,
    LAST_VELOCITY,
    ADMISSION,
) = range(VALUES + MOST_VALUES, VALUES + MOST_VALUES + 18)
SUMS, SUMS_END = COUNT, ADMISSION  # what a new run begins with at zero
GUARD = ADMISSION + ADMISSION_SIZE
STATE_SIZE = GUARD + guard_size(ADMISSION)

admission = fields_at(ADMISSION_DTYPE, start=ADMISSION)

REVERSAL = 12.0
"""A change of the velocity's sign within a sample is a reversal only if it changes by more standard
deviations of its noise: with half the true one assumed, the velocities of a rest differ by that
once in 45 000 samples. What a smaller reversal adds to the way is less than noise does."""


@compiled(inline=True)
def _target_and_row(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> float:
    """Add one sample to the sums, lay W(k) in the state and return y(k) (Eqs. 4.3, 4.4).

    Compensated, the bracket of Eq. 5.26 is added to y, and [W_c, sigma^2 T (k + 1)] is subtracted
    from W (Eq. 5.27). The settled sums take the way from positions and its sign from two
    velocities: noise does not lengthen it, so W_c is not subtracted there, and the squared
    velocity T (v_-^2 + v_- v + v^2) / 3 gains 2/3 sigma^2 T a sample.
    """
    T, sigma = s[SAMPLING_TIME], s[NOISE]
    settled = s[SETTLED_SUMS] > 0.0
    bias = 0.0
    if s[COMPENSATION] == 1.0:
        bias = bias_of_polynomial(v, sigma)
    elif s[COMPENSATION] == 2.0:
        bias = bias_of_double_mean(v, sigma)
    if not settled:
        work, way, squared = published_step(u, v, T)
        s[WORK] += work
        s[CORRECTION] += T * bias
        s[WAY] += way - T * bias
        if s[COMPENSATION] > 0.0:
            squared -= T * sigma * sigma
        s[SQUARE] += squared
    elif s[COUNT] > 0.0:
        v0 = s[LAST_VELOCITY]
        dx = x - s[LAST_POSITION]
        s[WORK] += s[LAST_EFFORT] * dx
        s[CORRECTION] += T * bias
        if v0 * v < 0.0 and abs(v - v0) > REVERSAL * sigma:
            s[WAY] += turning_way(v0, v, dx, T)
        else:
            s[WAY] += dx if v0 + v >= 0.0 else -dx
        squared = squared_velocity(v0, v, v - v0, T)
        if s[COMPENSATION] > 0.0:
            squared -= 2.0 / 3.0 * T * sigma * sigma
        s[SQUARE] += squared
    if settled:
        s[LAST_EFFORT], s[LAST_POSITION], s[LAST_VELOCITY] = u, x, v
    s[COUNT] += 1.0
    s[ROW] = s[WAY]
    s[ROW + 1] = s[SQUARE]
    if s[PARAMETERS] > 2.0:  # Eq. 6.2
        s[ROW + 2] = 1.0
        s[ROW + 3] = s[CORRECTION]
    kinetic = 0.5 * s[INERTIA] * v * v + 0.5 * s[LOAD_INERTIA] * v2 * v2
    potential = 0.5 * s[STIFFNESS] * (x - x2) * (x - x2)
    y = s[WORK] - kinetic - potential
    if s[COMPENSATION] > 0.0:
        y += s[LEVEL_BIAS]
    return y


@compiled(brief=True)
def published_energy_step(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> bool:
    """Take one sample into the state, in place; return whether all was finite (Eqs. 4.3-4.10).

    None is taken while the noise is needed and not known.
    """
    whole = np.isfinite(u + x + v)
    if s[STIFFNESS] > 0.0:
        whole = whole and np.isfinite(x2 + v2)
    if s[NOISE] < 0.0:
        return False
    ready, u, _, x, v, x2, v2, stepped = admit(admission(s), u, x, v, x2, v2)
    if not ready:
        return whole
    predicted, velocity = continued(admission(s).driven)
    x, v = predicted if np.isnan(x) else x, velocity if np.isnan(v) else v
    if s[STIFFNESS] > 0.0:
        predicted, velocity = continued(admission(s).load)
        x2, v2 = predicted if np.isnan(x2) else x2, velocity if np.isnan(v2) else v2
    else:
        x2, v2 = 0.0, 0.0
    if stepped:
        s[LAST_POSITION] = x - s[SAMPLING_TIME] * v
    y = _target_and_row(s, u, x, v, x2, v2)
    e = y
    for i in range(int(s[PARAMETERS])):
        e -= s[ROW + i] * s[VALUES + i]
    s[PREDICTION_ERROR] = e  # Eq. 4.9
    update(s, y, s[FORGETTING], True)
    stays_valid(s, GUARD, ADMISSION, VALUES, MOST_VALUES)
    return whole


@compiled()
def published_energy_run(
    s: Float[np.ndarray, " s"], samples: Float[np.ndarray, "n 5"]
) -> tuple[Float[np.ndarray, "n p"], Float[np.ndarray, " n"]]:
    """Take many samples, in place; return the estimates after each, and the errors before it."""
    n, p = samples.shape[0], int(s[PARAMETERS])
    history, errors = np.empty((n, p)), np.empty(n)
    for k in range(n):
        published_energy_step(
            s, samples[k, 0], samples[k, 1], samples[k, 2], samples[k, 3], samples[k, 4]
        )
        errors[k] = s[PREDICTION_ERROR]
        for i in range(p):
            history[k, i] = s[VALUES + i]
    return history, errors


@compiled()
def published_energy_rows(
    s: Float[np.ndarray, " s"], samples: Float[np.ndarray, "n 5"]
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, "n p"]]:
    """Return y(k) and W(k) of many samples without estimating anything; the state's sums move."""
    n, p = samples.shape[0], int(s[PARAMETERS])
    targets, rows = np.empty(n), np.empty((n, p))
    for k in range(n):
        targets[k] = _target_and_row(
            s, samples[k, 0], samples[k, 1], samples[k, 2], samples[k, 3], samples[k, 4]
        )
        for i in range(p):
            rows[k, i] = s[ROW + i]
    return targets, rows
