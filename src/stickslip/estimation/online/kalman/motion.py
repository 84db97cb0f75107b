"""The exact motion of an axis over a sample, and its exact derivatives, for a Kalman filter.

Under an effort u that is held, with viscous friction c, Coulomb friction f_c and offset o,

    m v' = u - o - f_c sign(v) - c v,

with rest where abs(u - o) <= f_c: static friction is Coulomb friction. The derivatives are exact
too, through a stop and a breakaway inside the sample.
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled

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
    m: float, z: Float[np.ndarray, "5"], u: float, T: float, F: Float[np.ndarray, "2 5"]
) -> tuple[float, float]:
    """Return position and velocity after a sample from z = (x, v, c, f_c, o); F gets their slopes.

    Where the axis stops at t* inside the sample, v(t*) = 0 whatever the state was, so that only the
    place depends on it; if it goes on the other way, dt* / dp = -(dv / dp) / v' comes in as well.
    """
    x, v, c, f_c, o = z[0], z[1], z[2], z[3], z[4]
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
            stop_slope = -m / force
            last = (onward - c * speed) / m
            for j, part in ((1, at_v), (2, at_c), (3, -s * at_f), (4, -at_f)):
                F[0, j] -= speed * stop_slope * part
                F[1, j] -= last * stop_slope * part
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
