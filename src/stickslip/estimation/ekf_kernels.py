"""Kernels of an extended Kalman filter whose states are the motion and its friction.

The state of the axis is (x, v, c, f_c, o): position, velocity, viscous friction, Coulomb friction
and offset. Between samples it moves as `predicted` says, by the exact solution of

    m v' = u - o - f_c sign(v) - c v

under a held effort u, with rest where abs(u - o) <= f_c; friction stays as it is. The derivatives
of that solution are exact too, through a stop and a break-away inside the sample.

At rest, friction is whatever the effort asks for, up to a limit: a sample says that the limit is
not reached, which is an inequality, and no Gaussian can hold it. A filter that takes it for an
equation learns that the limit is the effort of the moment, is soon sure of it, and diverges. So a
sample that may be one of rest carries the velocity on under an unknown force, and tells nothing of
the friction.
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.recursion import SAMPLING_TIME, VALUES

__all__ = [
    "COVARIANCE",
    "FIRST",
    "FORCE_VARIANCE",
    "HELD_EFFORT",
    "INNOVATION",
    "KNOWN",
    "MASS",
    "MOTION",
    "POSITION_VARIANCE",
    "REST_SPEED",
    "REST_VARIANCE",
    "SIZE",
    "STATES",
    "VELOCITY_VARIANCE",
    "WALK",
    "ekf_run",
    "ekf_step",
    "predicted",
]

STATES = 5
FRICTION = 3  # of these: c, f_c, o, which stand at VALUES

(
    MASS,
    FORCE_VARIANCE,  # of a disturbing force, white from sample to sample
    POSITION_VARIANCE,
    VELOCITY_VARIANCE,  # infinite where no velocity is measured
    REST_SPEED,  # below which the axis may be at rest; 0 where every sample is taken as it is
    REST_VARIANCE,  # of the unknown force there
    KNOWN,
    HELD_EFFORT,
    INNOVATION,  # e' S^-1 e of the last sample
    MOTION,  # x, v
) = range(VALUES + FRICTION, VALUES + FRICTION + 10)
WALK = MOTION + 2  # variances by which c, f_c and o wander in a sample
FIRST = WALK + FRICTION  # their variances at the start
COVARIANCE = FIRST + FRICTION
SIZE = COVARIANCE + STATES * STATES

_SURE = 3.0  # standard deviations of the velocity from 0, from which on the axis moves for sure
_SMALL = 1e-2  # beta below which the series are more exact


@compiled(inline=True)
def _shares(beta: float) -> tuple[float, float, float, float]:
    """Return phi_1 = (1 - e^-beta)/beta, phi_2 = (1 - phi_1)/beta, and their derivatives."""
    b = beta
    if abs(b) < _SMALL:
        one = 1.0 - b / 2 * (1.0 - b / 3 * (1.0 - b / 4 * (1.0 - b / 5)))
        two = 0.5 - b / 6 * (1.0 - b / 4 * (1.0 - b / 5 * (1.0 - b / 6)))
        one_slope = -0.5 + b / 3 - b * b / 8 + b * b * b / 30
        two_slope = -1.0 / 6 + b / 12 - b * b / 40 + b * b * b / 180
        return one, two, one_slope, two_slope
    one = -np.expm1(-b) / b
    two = (1.0 - one) / b
    one_slope = (np.exp(-b) - one) / b
    return one, two, one_slope, (-one_slope - two) / b


@compiled(inline=True)
def _slip(
    m: float, c: float, force: float, v: float, t: float
) -> tuple[float, float, float, float, float, float, float, float]:
    """Return way and velocity after t of m v' = force - c v, and derivatives to v, force and c."""
    one, two, one_slope, two_slope = _shares(c * t / m)
    decay = np.exp(-c * t / m)
    a = force / m
    way = v * t * one + a * t * t * two
    speed = v * decay + a * t * one
    way_c = t / m * (v * t * one_slope + a * t * t * two_slope)
    speed_c = t / m * (a * t * one_slope - v * decay)
    return way, speed, t * one, t * t * two / m, way_c, decay, t * one / m, speed_c


@compiled(inline=True)
def _stop_time(m: float, c: float, force: float, v: float) -> float:
    """Return when m v' = force - c v comes to v = 0, the force being against v."""
    z = -c * v / force
    if abs(z) < 1e-6:
        return -m * v / force * (1.0 - 0.5 * z)
    return m / c * np.log1p(z)


@compiled()
def predicted(
    m: float,
    x: float,
    v: float,
    c: float,
    f_c: float,
    o: float,
    u: float,
    T: float,
    F: Float[np.ndarray, "2 5"],
) -> tuple[float, float]:
    """Return position and velocity after a sample; F gets their derivatives to (x, v, c, f_c, o).

    Where the axis stops at t* inside the sample, v(t*) = 0 whatever the state was, so that only the
    place depends on it; if it goes on the other way, dt* / dp = -(dv / dp) / v' comes in as well.
    """
    for i in range(2):
        for j in range(5):
            F[i, j] = 0.0
    F[0, 0] = 1.0
    pull = u - o
    hold = max(f_c, 0.0)
    if v == 0.0:
        if abs(pull) <= hold:
            return x, 0.0
        s = 1.0 if pull > 0.0 else -1.0
        way, speed, way_v, way_f, way_c, speed_v, speed_f, speed_c = _slip(
            m, c, pull - s * f_c, 0.0, T
        )
    else:
        s = 1.0 if v > 0.0 else -1.0
        force = pull - s * f_c
        way, speed, way_v, way_f, way_c, speed_v, speed_f, speed_c = _slip(m, c, force, v, T)
        if s * speed <= 0.0:
            stop = min(_stop_time(m, c, force, v), T)
            way, _, way_v, way_f, way_c, at_v, at_f, at_c = _slip(m, c, force, v, stop)
            F[0, 1], F[0, 2], F[0, 3], F[0, 4] = way_v, way_c, -s * way_f, -way_f
            if abs(pull) <= hold:
                return x + way, 0.0
            back = 1.0 if pull > 0.0 else -1.0
            onward = pull - back * f_c
            more, speed, _, more_f, more_c, _, speed_f, speed_c = _slip(m, c, onward, 0.0, T - stop)
            # The later it stopped, the less is left: d / dt* of way and velocity after it
            late = -m / force
            last = (onward - c * speed) / m
            for j, part in ((1, at_v), (2, at_c), (3, -s * at_f), (4, -at_f)):
                F[0, j] -= speed * late * part
                F[1, j] -= last * late * part
            F[0, 2] += more_c
            F[1, 2] += speed_c
            F[0, 3] -= back * more_f
            F[1, 3] -= back * speed_f
            F[0, 4] -= more_f
            F[1, 4] -= speed_f
            return x + way + more, speed
    F[0, 1], F[0, 2], F[0, 3], F[0, 4] = way_v, way_c, -s * way_f, -way_f
    F[1, 1], F[1, 2], F[1, 3], F[1, 4] = speed_v, speed_c, -s * speed_f, -speed_f
    return x + way, speed


@compiled(inline=True)
def _carry(s: Float[np.ndarray, " s"], u: float) -> None:
    """Predict: the state by the axis' own motion, P by F P F' + Q."""
    T, m = s[SAMPLING_TIME], s[MASS]
    P = s[COVARIANCE:SIZE].reshape(STATES, STATES)
    F = np.zeros((2, STATES))
    x, v, q = s[MOTION], s[MOTION + 1], s[FORCE_VARIANCE]
    slow = max(s[REST_SPEED], _SURE * np.sqrt(P[1, 1]))
    if s[REST_SPEED] > 0.0 and abs(v) < slow:
        F[0, 0], F[0, 1], F[1, 1] = 1.0, T, 1.0
        x += v * T
        q = s[REST_VARIANCE]
    else:
        x, v = predicted(m, x, v, s[VALUES], s[VALUES + 1], s[VALUES + 2], u, T, F)
    s[MOTION], s[MOTION + 1] = x, v
    moved = np.zeros((2, STATES))
    for i in range(2):
        for j in range(STATES):
            for k in range(STATES):
                moved[i, j] += F[i, k] * P[k, j]
    for i in range(2):
        for j in range(2, STATES):
            P[i, j] = moved[i, j]
            P[j, i] = moved[i, j]
    for i in range(2):
        for j in range(2):
            total = 0.0
            for k in range(STATES):
                total += moved[i, k] * F[j, k]
            P[i, j] = total
    # A force of variance q held over the sample
    q /= m * m
    P[0, 0] += 0.25 * q * T**4
    P[0, 1] += 0.5 * q * T**3
    P[1, 0] += 0.5 * q * T**3
    P[1, 1] += q * T * T
    for i in range(FRICTION):
        P[2 + i, 2 + i] += s[WALK + i]


@compiled(inline=True)
def _correct(s: Float[np.ndarray, " s"], k: int, measured: float, variance: float) -> None:
    """Take a measurement of state k: K = P h / S, (I - K h') P (I - K h')' + K R K' (Joseph)."""
    P = s[COVARIANCE:SIZE].reshape(STATES, STATES)
    S = P[k, k] + variance
    if not (S > 0.0 and np.isfinite(S)):
        return
    e = measured - s[MOTION + k]
    gain = np.empty(STATES)
    for i in range(STATES):
        gain[i] = P[i, k] / S
    for i in range(STATES):
        place = MOTION + i if i < 2 else VALUES + i - 2
        s[place] += gain[i] * e
    row, column = np.empty(STATES), np.empty(STATES)
    for j in range(STATES):
        row[j] = P[k, j]
    for i in range(STATES):
        for j in range(STATES):
            P[i, j] -= gain[i] * row[j]
    for i in range(STATES):
        column[i] = P[i, k]
    for i in range(STATES):
        for j in range(i, STATES):
            P[i, j] += gain[j] * (gain[i] * variance - column[i])
            P[j, i] = P[i, j]
    s[INNOVATION] += e * e / S


@compiled(brief=True)
def ekf_step(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> bool:
    """Take one sample into the state, in place; return whether all of it was finite."""
    if not np.isfinite(u + x + v + x2 + v2):
        return False
    if s[KNOWN] > 0.0:
        _carry(s, s[HELD_EFFORT])
        s[INNOVATION] = 0.0
        _correct(s, 0, x, s[POSITION_VARIANCE])
        _correct(s, 1, v, s[VELOCITY_VARIANCE])
    else:
        s[MOTION], s[MOTION + 1] = x, v
        s[KNOWN] = 1.0
    s[HELD_EFFORT] = u
    return True


@compiled()
def ekf_run(
    s: Float[np.ndarray, " s"], samples: Float[np.ndarray, "n 5"]
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
    """Take many samples, in place; return c, f_c and o after each, and the innovations."""
    n = samples.shape[0]
    history, innovations = np.empty((n, FRICTION)), np.empty(n)
    for k in range(n):
        ekf_step(s, samples[k, 0], samples[k, 1], samples[k, 2], samples[k, 3], samples[k, 4])
        for i in range(FRICTION):
            history[k, i] = s[VALUES + i]
        innovations[k] = s[INNOVATION]
    return history, innovations
