"""The step of a PID controller."""

import math
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.feedback.dither import dither_effort
from stickslip.control.feedback.reset_integral import reset
from stickslip.numerics.named_fields import fields_at, places
from stickslip.records import SensorSample

__all__ = ["METHOD", "STATE", "Step", "fields", "pid_step"]

METHOD = 4  # of a vector of this kernel

STATE = np.dtype(
    [
        # Settings
        ("method", "i8"),  # whose vector it is
        ("period", "f8"),  # T
        ("target", "f8"),
        ("K_p", "f8"),
        ("K_i", "f8"),
        ("K_d", "f8"),
        ("filter_time", "f8"),  # tau, time constant of the derivative
        ("measured", "i8"),  # 1 if the velocity is measured, not differentiated
        ("effort_limit", "f8"),
        ("dead_band", "f8"),
        ("dither_amplitude", "f8"),
        ("dither_cycles", "f8"),  # a sample
        ("dither_square", "i8"),
        ("reset_law", "f8"),
        ("reset_factor", "f8"),
        ("rest_speed", "f8"),
        ("rest_samples", "i8"),
        # What changes
        ("samples", "i8"),  # taken so far
        ("x", "f8"),  # position and velocity of the last sample
        ("v", "f8"),
        ("integral", "f8"),  # integral action, an effort
        ("armed", "f8"),  # logic state of the resets
        ("rested", "i8"),  # samples in a row within the speed of rest
    ]
)
"""Settings and memory of a PID controller."""

fields = fields_at(STATE)
_SIZE = places(STATE)

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
    if state.size != _SIZE or fields(state).method != METHOD:
        raise ValueError("not a state of a PIDController: begin with the one of its init()")
    vector = state.copy()
    s = fields(vector)
    x, v = sample.measured_position, sample.measured_velocity
    T, r = s.period, s.target
    started = s.samples > 0
    x_last = s.x if started else x
    v_last = s.v
    if not s.measured:
        tau = s.filter_time
        v = ((2.0 * tau - T) * v_last + 2.0 * (x - x_last)) / (2.0 * tau + T)
    if not math.isfinite(x) or not math.isfinite(v):
        return vector, math.nan
    e, e_last = r - x, r - x_last
    u_p, u_i = s.K_p * e, s.integral
    growth = 0.5 * s.K_i * T * (e + e_last)
    if not started or abs(e) <= s.dead_band:
        growth = 0.0

    moving = abs(v) > s.rest_speed
    s.rested = 0 if moving else s.rested + 1
    stopped = s.rested >= s.rest_samples or v * v_last < 0.0
    u_i, s.armed = reset(
        s.reset_law, s.reset_factor, s.dead_band, s.armed, u_p, u_i + growth, e, e_last,
        moving, stopped,
    )  # fmt: skip

    u = u_p + u_i - s.K_d * v
    u += dither_effort(s.dither_amplitude, s.dither_cycles * (s.samples + 0.5), s.dither_square > 0)
    limit = s.effort_limit
    if abs(u) > limit:
        if u * growth > 0.0:
            u_i -= growth
        u = math.copysign(limit, u)
    s.integral = u_i
    s.x, s.v = x, v
    s.samples += 1
    return vector, u
