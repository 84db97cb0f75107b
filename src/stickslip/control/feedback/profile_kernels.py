"""Kernels of a servo: reference with limited jerk, feedforward, PID, dither where it has stuck.

**Reference.** The fastest motion from rest to rest within the accelerations a_1 (up) and a_2 (down)
and a speed has a trapezoid of velocity w(t). Its mean over a window of length t_j,

    r(t) = [P(t) - P(t - t_j)]/t_j,    P' = p, p' = w,

takes t_j longer, has the same limits of speed and acceleration, and the jerk (a_1 + a_2)/t_j at
most. For an axis in motion w begins with its speed v_0, and is v_0 before the start; the trapezoid
then covers v_0 t_j/2 less.

**Effort.** While the reference moves, u = m r'' + F sign(r') + c r' plus the PID of r(t - t_d) - x;
F contains the offset, and t_d is the known delay. After its end the proportional action and the
integral are those of the error beyond the dead band. Where the axis rests outside the tolerance, a
square wave is added until it is inside.
"""

import math
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.numerics.named_fields import fields_at, places
from stickslip.records import SensorSample

METHOD = 5  # of a vector of this kernel
HELD, MOVING, SETTLING = 0, 1, 2  # phases: before the first sample, by reference, after it
RETARGETED = 3  # before the next reference, in motion

STATE = np.dtype(
    [
        # Settings
        ("method", "i8"),  # whose vector it is
        ("period", "f8"),  # T
        ("target", "f8"),
        ("tolerance", "f8"),
        ("effort_limit", "f8"),
        ("planned_effort", "f8"),  # of the reference at most
        ("speed_limit", "f8"),
        ("mass", "f8"),
        ("coulomb", "f8", (2,)),  # of each direction, with the offset
        ("viscous", "f8", (2,)),
        ("offset", "f8"),
        ("least_window", "f8"),  # of t_j
        ("delay", "f8"),  # t_d
        ("K_p", "f8"),
        ("K_i", "f8"),
        ("K_d", "f8"),
        ("filter_time", "f8"),  # tau, time constant of the derivative
        ("measured", "i8"),  # 1 if the velocity is measured, not differentiated
        ("dead_band", "f8"),
        ("dither_amplitude", "f8"),
        ("dither_samples", "i8"),  # of half a period
        ("reset_factor", "f8"),  # 0 for none
        ("holds", "i8"),  # 1 if the effort stays at rest within the dead band
        ("rest_motion", "f8"),  # positions of an axis at rest differ by no more
        ("rest_samples", "i8"),
        # What changes
        ("phase", "i8"),
        ("samples", "i8"),  # since the reference began
        ("start", "f8"),  # of the reference
        ("backward", "i8"),  # 1 if it goes in the negative direction
        ("first_speed", "f8"),  # v_0, of the reference
        ("times", "f8", (3,)),  # of acceleration, cruise and deceleration
        ("accelerations", "f8", (2,)),
        ("window", "f8"),  # t_j
        ("x", "f8"),  # of the last sample
        ("e", "f8"),  # error of the last sample
        ("v", "f8"),  # filtered slope of the error, or measured velocity
        ("integral", "f8"),  # integral action, an effort
        ("anchor", "f8"),  # position from which motion is judged
        ("rested", "i8"),  # samples in a row near it
        ("shaken", "i8"),  # samples of dither so far
    ]
)
fields = fields_at(STATE)
SIZE = places(STATE)

OWN_DELAY = 2.5  # samples: half a sample of the hold, and two of reserve
_BISECTIONS = 40  # of the speed: to a relative 1e-12
_FASTEST = 0.9  # of the speed at which viscous friction takes all of the effort
_SMOOTH = 0.1  # t_j over the duration of the trapezoid, at least
_LEAST = 0.05  # effort that accelerates over the planned one, where friction is near that


@compiled()
def _plan(s: Any, d: float, v_0: float) -> None:
    """Plan the trapezoid over a distance d, from the speed v_0 to rest.

    The distance (v^2 - v_0^2)/(2 a) + v^2/(2 b), a = (u - F - c v)/m, grows with the largest
    speed v.
    """
    m, u, F, c = s.mass, s.planned_effort, s.coulomb[s.backward], s.viscous[s.backward]
    free = max(u - F, _LEAST * u)
    b = max(u + F, _LEAST * u) / m
    v = max(s.speed_limit if c * s.speed_limit < free else _FASTEST * free / c, v_0)
    low, high = v_0, v
    for k in range(_BISECTIONS):
        a = max(free - c * v, _LEAST * free) / m
        if 0.5 * ((v * v - v_0 * v_0) / a + v * v / b) > d:
            high = v
        elif k == 0:
            break
        else:
            low = v
        v = 0.5 * (low + high)
    a = max(free - c * v, _LEAST * free) / m
    v = max(min(v, math.sqrt((2.0 * d + v_0 * v_0 / a) / (1.0 / a + 1.0 / b))), v_0)
    s.accelerations[0], s.accelerations[1], s.first_speed = a, b, v_0
    s.times[0], s.times[2] = (v - v_0) / a, v / b
    left = d - 0.5 * (v * v - v_0 * v_0) / a - 0.5 * v * v / b
    s.times[1] = max(left / v, 0.0) if v > 0.0 else 0.0


@compiled()
def begin(s: Any, x: float, v: float) -> None:
    """Plan the reference to the target from a position and a velocity, as measured.

    It begins where the axis is after the known delay. v_0 is 0 for an axis that moves away from
    the target, and otherwise no more than allows a stop there.
    """
    s.anchor, s.rested = x, 0
    x += v * s.delay
    way = s.target - x
    d = abs(way)
    s.start, s.backward, s.samples, s.phase = x, (1 if way < 0.0 else 0), 0, MOVING
    _plan(s, d, 0.0)
    s.window = max(s.least_window, _SMOOTH * (s.times[0] + s.times[1] + s.times[2]))
    b, half = s.accelerations[1], 0.5 * s.window
    most = b * (math.sqrt(half * half + 2.0 * d / b) - half)
    v_0 = min(-v if s.backward else v, most)
    if v_0 > 0.0:
        _plan(s, d - v_0 * half, v_0)
    s.integral, s.shaken = 0.0, 0
    s.e, s.v = 0.0, (-s.first_speed if s.backward else s.first_speed) - v


@compiled()
def _trapezoid(s: Any, t: float) -> tuple[float, float, float]:
    """Return w, p and P of the trapezoid at a time."""
    t_1, t_2, t_3 = s.times[0], s.times[1], s.times[2]
    a, b, v_0 = s.accelerations[0], s.accelerations[1], s.first_speed
    if t <= 0.0:
        return v_0, v_0 * t, 0.5 * v_0 * t * t
    h = min(t, t_1)
    w, p, area = v_0 + a * h, (v_0 + a * h / 2.0) * h, (v_0 / 2.0 + a * h / 6.0) * h * h
    h = min(max(t - t_1, 0.0), t_2)
    area += h * (p + 0.5 * w * h)
    p += w * h
    h = min(max(t - t_1 - t_2, 0.0), t_3)
    area += h * (p + 0.5 * w * h - b * h * h / 6.0)
    p += w * h - 0.5 * b * h * h
    w -= b * h
    h = t - t_1 - t_2 - t_3
    if h > 0.0:
        return 0.0, p, area + p * h
    return w, p, area


@compiled()
def set_delay(s: Any, delay: float) -> None:
    """Set the delay [s]; the crossover is inversely proportional to the total delay."""
    ratio = (OWN_DELAY * s.period + s.delay) / (OWN_DELAY * s.period + delay)
    s.K_p *= ratio**2
    s.K_i *= ratio**3
    s.K_d *= ratio
    s.filter_time /= ratio
    s.delay = delay


@compiled()
def duration(s: Any) -> float:
    """Return how long the reference moves [s]."""
    return s.times[0] + s.times[1] + s.times[2] + s.window


@compiled()
def reference(s: Any, t: float) -> tuple[float, float, float]:
    """Return position, velocity and acceleration of the reference at a time, from its start."""
    w, p, area = _trapezoid(s, t)
    w_0, p_0, area_0 = _trapezoid(s, t - s.window)
    sign = -1.0 if s.backward else 1.0
    return (
        sign * ((area - area_0) / s.window + 0.5 * s.first_speed * s.window),
        sign * (p - p_0) / s.window,
        sign * (w - w_0) / s.window,
    )


@compiled()
def _rests(s: Any, x: float) -> bool:
    """Take a position; return whether the axis rests."""
    if abs(x - s.anchor) <= s.rest_motion:
        s.rested += 1
    else:
        s.anchor, s.rested = x, 0
    return s.rested >= s.rest_samples


@compiled()
def _dither(s: Any) -> float:
    """Return the next sample of the square wave."""
    s.shaken += 1
    return s.dither_amplitude * (1.0 if (s.shaken // s.dither_samples) % 2 == 0 else -1.0)


@compiled()
def _speed(s: Any, measured: float) -> float:
    """Return the velocity of the axis, measured or from the error at the last sample; 0 at rest."""
    if s.phase == HELD or s.rested >= s.rest_samples:
        return 0.0
    if s.measured:
        return measured
    _, w, _ = reference(s, (s.samples - 1) * s.period - s.delay)
    return w - s.v


@compiled()
def next_effort(s: Any, x: float, velocity: float) -> float:
    """Take a position and a measured velocity; return the effort until the next sample.

    Tustin's substitution makes the integral u_i(k) = u_i(k-1) + K_i T/2 [e(k) + e(k-1)] and the
    derivative of the error v(k) = {(2 tau - T) v(k-1) + 2 [e(k) - e(k-1)]}/(2 tau + T). The
    integral does not grow while the limit holds the effort back.
    """
    T = s.period
    if s.phase in (HELD, RETARGETED):
        begin(s, x, _speed(s, velocity))
    t = s.samples * T
    r, w, _ = reference(s, t - s.delay)
    e = s.start + r - x
    if s.measured:
        s.v = w - velocity
    elif s.samples > 0:
        tau = s.filter_time
        s.v = ((2.0 * tau - T) * s.v + 2.0 * (e - s.e)) / (2.0 * tau + T)
    e_last, s.e, s.x = s.e, e, x
    rests = _rests(s, x)
    ends = duration(s)
    u, growth = 0.0, 0.5 * s.K_i * T * (e + e_last)
    if t < ends:
        # The mean over the sample that begins: two values, as the velocity gives it exactly
        r_1, w_1, _ = reference(s, t + T)
        r_0, w_0, _ = reference(s, t)
        side, sign = s.backward, (-1.0 if s.backward else 1.0)
        u = s.mass * (w_1 - w_0) / T + s.viscous[side] * (r_1 - r_0) / T + sign * s.coulomb[side]
        u += s.K_p * e
    else:
        s.phase = SETTLING
        beyond = math.copysign(max(abs(e) - s.dead_band, 0.0), e)
        u = s.offset + s.K_p * beyond
        if beyond == 0.0:
            growth = 0.0
        away = (u - s.offset + s.integral) * e < 0.0
        if rests and away and abs(e) > s.dead_band and s.reset_factor > 0.0:
            s.integral = -s.reset_factor * (u - s.offset + s.integral) - (u - s.offset)
        if abs(e) > s.tolerance and (rests or s.shaken > 0):
            u += _dither(s)
        elif abs(e) <= s.tolerance:
            s.shaken = 0
    s.integral += growth
    u += s.integral + s.K_d * s.v
    if t >= ends and rests and abs(e) <= s.dead_band and s.holds == 0:
        u = s.offset  # nothing that could move it out again
        s.integral = 0.0
    if abs(u) > s.effort_limit:
        if u * growth > 0.0:
            s.integral -= growth
        u = math.copysign(s.effort_limit, u)
    s.samples += 1
    return u


@compiled()
def _has_ended(s: Any) -> bool:
    """Return whether the axis rests after the end of the reference."""
    return s.phase == SETTLING and s.rested >= s.rest_samples


@compiled()
def rests_at_target(s: Any) -> bool:
    """Return whether the axis rests within the tolerance."""
    return _has_ended(s) and abs(s.target - s.x) <= s.tolerance


@compiled()
def rests_off_target(s: Any) -> bool:
    """Return whether the axis rests outside the tolerance after the end of the reference."""
    return _has_ended(s) and abs(s.target - s.x) > s.tolerance


@compiled()
def step(
    state: Float[np.ndarray, " s"], sample: SensorSample
) -> tuple[Float[np.ndarray, " s"], float]:
    """Take a sample; see the module."""
    if state.size != SIZE or fields(state).method != METHOD:
        raise ValueError("not a state of a ProfileController: begin with the one of its init()")
    vector = state.copy()
    s = fields(vector)
    x, velocity = sample.measured_position, sample.measured_velocity
    if not math.isfinite(x) or (s.measured and not math.isfinite(velocity)):
        return vector, math.nan
    return vector, next_effort(s, x, velocity)
