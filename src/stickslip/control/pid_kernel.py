"""The step of a PID controller. Settings and memory are one vector, laid out by the constants."""

import math
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.dither import dither_effort
from stickslip.control.reset_integral import reset
from stickslip.records import SensorSample

__all__ = [
    "ARMED",
    "DEAD_BAND",
    "DITHER_AMPLITUDE",
    "DITHER_CYCLES",
    "DITHER_SQUARE",
    "EFFORT_LIMIT",
    "FILTER",
    "INTEGRAL",
    "K_D",
    "K_I",
    "K_P",
    "MARK",
    "MEASURED",
    "METHOD",
    "RESET_FACTOR",
    "RESET_LAW",
    "REST_SAMPLES",
    "REST_SPEED",
    "SAMPLES",
    "SIZE",
    "TARGET",
    "TIME",
    "Step",
    "pid_step",
]

MARK = 4.0  # of a vector of this kernel

# Settings
(
    METHOD,  # whose vector it is
    TIME,  # T
    TARGET,
    K_P,
    K_I,
    K_D,
    FILTER,  # tau, time constant of the derivative
    MEASURED,  # the velocity is measured, not differentiated
    EFFORT_LIMIT,
    DEAD_BAND,
    DITHER_AMPLITUDE,
    DITHER_CYCLES,  # a sample
    DITHER_SQUARE,
    RESET_LAW,
    RESET_FACTOR,
    REST_SPEED,
    REST_SAMPLES,
) = range(17)
# What changes
(
    SAMPLES,  # taken so far
    _LAST_X,
    _VELOCITY,
    INTEGRAL,  # integral action, an effort
    ARMED,  # logic state of the resets
    _RESTED,  # samples in a row within the speed of rest
    SIZE,
) = range(REST_SAMPLES + 1, REST_SAMPLES + 8)

Vector = Float[np.ndarray, " s"]
Step = Callable[[Vector, SensorSample], tuple[Vector, float]]


@compiled()
def pid_step(
    state: Float[np.ndarray, " s"], sample: SensorSample
) -> tuple[Float[np.ndarray, " s"], float]:
    """Take a sample: u = u_p + u_i - K_d v + dither, limited, with u_p = K_p e.

    Tustin's substitution s = (2/T) (z - 1)/(z + 1) turns K_i/s and s/(1 + tau s) into
    u_i(k) = u_i(k-1) + K_i T/2 [e(k) + e(k-1)] and
    v(k) = {(2 tau - T) v(k-1) + 2 [x(k) - x(k-1)]}/(2 tau + T).
    The integral does not grow while the limit holds the effort back and it would grow further
    beyond it, nor while the error is within the dead band.

    Raises
    ------
    ValueError
        If the vector is not one of this kernel.
    """
    if state.size != SIZE or state[METHOD] != MARK:
        raise ValueError("not a state of a PIDController: begin with the one of its init()")
    s = state.copy()
    x, v = sample.measured_position, sample.measured_velocity
    T, r = s[TIME], s[TARGET]
    started = s[SAMPLES] > 0.0
    x_last = s[_LAST_X] if started else x
    v_last = s[_VELOCITY]
    if s[MEASURED] == 0.0:
        tau = s[FILTER]
        v = ((2.0 * tau - T) * v_last + 2.0 * (x - x_last)) / (2.0 * tau + T)
    if not math.isfinite(x) or not math.isfinite(v):
        return s, math.nan
    e, e_last = r - x, r - x_last
    u_p, u_i = s[K_P] * e, s[INTEGRAL]
    growth = 0.5 * s[K_I] * T * (e + e_last)
    if not started or abs(e) <= s[DEAD_BAND]:
        growth = 0.0

    moving = abs(v) > s[REST_SPEED]
    s[_RESTED] = 0.0 if moving else s[_RESTED] + 1.0
    stopped = s[_RESTED] >= s[REST_SAMPLES] or v * v_last < 0.0
    u_i, s[ARMED] = reset(
        s[RESET_LAW], s[RESET_FACTOR], s[DEAD_BAND], s[ARMED], u_p, u_i + growth, e, e_last,
        moving, stopped,
    )  # fmt: skip

    u = u_p + u_i - s[K_D] * v
    u += dither_effort(
        s[DITHER_AMPLITUDE], s[DITHER_CYCLES] * (s[SAMPLES] + 0.5), s[DITHER_SQUARE] > 0.0
    )
    limit = s[EFFORT_LIMIT]
    if abs(u) > limit:
        if u * growth > 0.0:
            u_i -= growth
        u = math.copysign(limit, u)
    s[INTEGRAL] = u_i
    s[_LAST_X], s[_VELOCITY] = x, v
    s[SAMPLES] += 1.0
    return s, u
