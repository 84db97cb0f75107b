"""Equations of a plant whose friction law is not affine, and one step of their integration.

The plant is the flexible arm with x1, v1, x2, v2 (van de Wijdeven 2002 A Eqs. 2.1-2.3); a rigid
axis is an arm whose spring has no stiffness. Friction is one of two kinds.

- Without bristles (Stribeck): ``s G(v) + c v`` while slipping in direction s, with
  ``G(v) = f_c + (f_s - f_c) exp(-(s v/v_s)^delta)``.
- With bristles of deflection z (Dahl, LuGre, elasto-plastic; Dupont et al. 2002 write them as one):
  ``z' = v (1 - alpha(z, v) s sigma_0 z/G(v))^i`` and the friction is
  ``sigma_0 z + sigma_1 z' + c v``. Dahl has G = f_c and alpha = 1, LuGre alpha = 1 and i = 1.

The direction s is held while a formula holds, and each goes on smoothly a little beyond v = 0: it
is there that the integrator finds out when to change it.

The step is that of Rodas5, a linearly implicit Runge-Kutta method (Di Marzo 1993; Hairer and
Wanner, Solving Ordinary Differential Equations II, Sect. IV.7, for the form): eight stages of order
5 with an embedded solution of order 4, stiffly accurate and L-stable, so that stiff bristles do not
force its step down. Each stage solves one linear system, with the same matrix; there is nothing to
iterate.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.numerics.named_fields import fields_at

LAW_MODEL = np.dtype(
    [
        (name, "f8")
        for name in (
            *("sampling_time", "m1", "m2", "ks"),
            *("fc_n", "fc_p", "fs_n", "fs_p", "c_n", "c_p", "offset"),
            "stribeck_velocity",
            "delta",  # exponent of the Stribeck effect: 2 or 1
            "sigma_0",  # stiffness of the bristles; 0 without any
            "sigma_1",  # damping of the bristles
            "exponent",  # i, 1 but for Dahl
            "elastic_deflection",  # z_ba; negative where alpha is 1 throughout
            "typical_v",  # a speed and a deflection that errors are small against
            "typical_z",
            "feature_v",  # changes of speed and deflection over which friction changes much
            "feature_z",
            "budget",  # steps and events allowed in one sample
        )
    ]
)
law_fields = fields_at(LAW_MODEL)

STATES = 5  # x1, v1, z, v2, x2
# Of Rodas5
STAGES = 8
ORDER = 5.0  # of the method
GAMMA = 0.19  # diagonal of the matrix of its implicit stages


class IntegrationTuning(NamedTuple):
    """Tuning of the integration of laws that are not affine.

    Sensitivities are those of eight random plants, each law on a mass and on an arm, over 25
    samples of 1 ms: the number of steps over that with the values here, at half and at twice the
    value (at 0.99 for the caution). The motion changes by at most 1.3e-9 of its largest value.
    Values without an effect bound the work in cases that did not occur.
    """

    relative_tolerance: float = 1e-11
    """Error of a step over the state, or over what is typical of it [-]. 1.18, 0.85."""
    smallest_change: float = 0.2  #: Smallest change of a step's length [-]. 1.00, 1.00.
    largest_change: float = 6.0  #: Largest change of a step's length [-]. 1.00, 1.00.
    caution: float = 0.9
    """Length of a step over that which has the tolerated error [-]. 2.27, 1.01."""
    least_error: float = 1e-10
    """Least error, over the tolerated one, that a step's length is computed of: no division by
    zero [-]. 1.00, 1.00."""
    significant: float = 1e-9
    """Speed over the typical one from which a change of sign is a reversal [-].
    1.00, 1.00."""
    iterations: int = 60
    """Iterations to find a zero of the velocity, at most [-]: bisection alone takes 53. 1.00,
    1.00."""
    halvings: int = 40
    """Halvings of a step from rest until the mass moves forward, at most [-]. 1.00, 1.00."""
    left: float = 1e-13  #: Rest of a sample that is rounding [sampling time]. 1.00, 1.00.


TUNING = IntegrationTuning()

# fmt: off
A, C = np.zeros((6, 5)), np.zeros((8, 7))  # below the diagonal, row by row
A[np.tril_indices(6, -1, 5)] = (
    2.0,
    3.040894194418781, 1.041747909077569,
    2.576417536461461, 1.622083060776640, -0.9089668560264532,
    2.760842080225597, 1.446624659844071, -0.3036980084553738, 0.2877498600325443,
    -14.09640773051259, 6.925207756232704, -41.47510893210728, 2.343771018586405, 24.13215229196062,
)
C[np.tril_indices(8, -1, 7)] = (
    -10.31323885133993,
    -21.04823117650003, -7.234992135176716,
    32.22751541853323, -4.943732386540191, 19.44922031041879,
    -20.69865579590063, -8.816374604402768, 1.260436877740897, -0.7495647613787146,
    -46.22004352711257, -17.49534862857472, -289.6389582892057, 93.60855400400906,
    318.3822534212147,
    34.20013733472935, -14.15535402717690, 57.82335640988400, 25.83362985412365,
    1.408950972071624, -6.551835421242162,
    42.57076742291101, -13.80770672017997, 93.98938432427124, 18.77919633714503,
    -31.58359187223370, -6.685968952921985, -5.810979938412932,
)
# fmt: on

Vector = NDArray[np.float64]


@compiled(inline=True)
def _strength(m: Any, s: float, v: float) -> tuple[float, float]:
    """Return G(v) and its derivative."""
    fc = m.fc_p if s > 0.0 else m.fc_n
    more = (m.fs_p if s > 0.0 else m.fs_n) - fc
    if more == 0.0:
        return fc, 0.0
    r = s * v / m.stribeck_velocity
    if m.delta == 2.0:
        left = math.exp(-r * r)
        return fc + more * left, -2.0 * r * left * more * s / m.stribeck_velocity
    left = math.exp(-max(r, -1.0))  # of no use beyond v = 0, but to stay finite there
    return fc + more * left, (-left * more * s / m.stribeck_velocity if r > -1.0 else 0.0)


@compiled(inline=True)
def _plasticity(m: Any, s: float, z: float, G: float, G_v: float) -> tuple[float, float, float]:
    """Return alpha(z, v) (Dupont et al. 2002) and its derivatives by v and z."""
    elastic = m.elastic_deflection
    if elastic < 0.0:
        return 1.0, 0.0, 0.0
    bend = s * z
    if bend <= elastic:
        return 0.0, 0.0, 0.0
    full = G / m.sigma_0
    if bend >= full:
        return 1.0, 0.0, 0.0
    width = full - elastic
    phase = math.pi * (bend - 0.5 * (full + elastic)) / width
    steep = 0.5 * math.pi * math.cos(phase) / width
    by_full = -steep * (bend - elastic) / width
    return 0.5 + 0.5 * math.sin(phase), by_full * G_v / m.sigma_0, steep * s


@compiled(inline=True)
def rates(
    m: Any, s: float, U: float, x: float, v: float, z: float, x2: float
) -> tuple[float, float, float]:
    """Return v', z' and v2' under the effort less the offset U."""
    G, G_v = _strength(m, s, v)
    c = m.c_p if s > 0.0 else m.c_n
    spring = m.ks * (x - x2)
    if m.sigma_0 == 0.0:
        bending, friction = 0.0, s * G + c * v
    else:
        alpha, _, _ = _plasticity(m, s, z, G, G_v)
        left = 1.0 - alpha * s * m.sigma_0 * z / G
        if m.exponent != 1.0:
            left = math.copysign(abs(left) ** m.exponent, left)
        bending = v * left
        friction = m.sigma_0 * z + m.sigma_1 * bending + c * v
    return (U - spring - friction) / m.m1, bending, spring / m.m2


@compiled()
def acceleration(m: Any, s: float, U: float, x: float, v: float, z: float, x2: float) -> float:
    """Return v' alone."""
    return rates(m, s, U, x, v, z, x2)[0]


@compiled(inline=True)
def linearised(m: Any, s: float, v: float, z: float) -> tuple[float, float, float, float]:
    """Return the derivatives of v' by v and z, and of z' by v and z."""
    G, G_v = _strength(m, s, v)
    c = m.c_p if s > 0.0 else m.c_n
    m1 = m.m1
    if m.sigma_0 == 0.0:
        return -(s * G_v + c) / m1, 0.0, 0.0, 0.0
    alpha, alpha_v, alpha_z = _plasticity(m, s, z, G, G_v)
    q = s * m.sigma_0 * z / G
    q_v, q_z = -q * G_v / G, s * m.sigma_0 / G
    left = 1.0 - alpha * q
    i = m.exponent
    power, slope = left, 1.0
    if i != 1.0:
        slope = i * abs(left) ** (i - 1.0)
        power = math.copysign(abs(left) ** i, left)
    z_v = power - v * slope * (alpha_v * q + alpha * q_v)
    z_z = -v * slope * (alpha_z * q + alpha * q_z)
    return (
        -(m.sigma_1 * z_v + c) / m1,
        -(m.sigma_0 + m.sigma_1 * z_z) / m1,
        z_v,
        z_z,
    )


@compiled()
def rosenbrock_step(
    m: Any, s: float, U: float, y: Vector, h: float, work: Vector, new: Vector
) -> float:
    """Write the state after a step of length h in direction s; return its error over the allowed.

    NaN if it is not finite.

    ``y`` and ``new`` hold (x1, v1, z, v2, x2), ``work`` is (STAGES + 1, STATES).
    """
    g = GAMMA * h
    a_v, a_z, r_v, r_z = linearised(m, s, y[1], y[2])
    k1, k2 = m.ks / m.m1, m.ks / m.m2
    # (I - g J) k = r with x1, x2 and v2 eliminated: two equations for v1 and z are left
    D = 1.0 / (1.0 + g * g * k2)
    m11, m12 = 1.0 + g * g * k1 * D - g * a_v, -g * a_z
    m21, m22 = -g * r_v, 1.0 - g * r_z
    det = m11 * m22 - m12 * m21
    at = STAGES
    for i in range(STAGES):
        if i < 6:
            for n in range(STATES):
                total = y[n]
                for j in range(i):
                    total += A[i, j] * work[j, n]
                work[at, n] = total
        else:
            for n in range(STATES):
                work[at, n] += work[i - 1, n]
        x, v, z, v2, x2 = work[at, 0], work[at, 1], work[at, 2], work[at, 3], work[at, 4]
        dv, dz, dv2 = rates(m, s, U, x, v, z, x2)
        rx, rv, rz, rx2, rv2 = v, dv, dz, v2, dv2
        for j in range(i):
            rx += C[i, j] / h * work[j, 0]
            rv += C[i, j] / h * work[j, 1]
            rz += C[i, j] / h * work[j, 2]
            rv2 += C[i, j] / h * work[j, 3]
            rx2 += C[i, j] / h * work[j, 4]
        rx, rv, rz, rx2, rv2 = g * rx, g * rv, g * rz, g * rx2, g * rv2
        rd = rx - rx2
        rv -= g * k1 * D * (rd - g * rv2)
        kv = (rv * m22 - m12 * rz) / det
        kz = (m11 * rz - m21 * rv) / det
        kv2 = D * (rv2 + g * k2 * (rd + g * kv))
        work[i, 0] = rx + g * kv
        work[i, 1] = kv
        work[i, 2] = kz
        work[i, 3] = kv2
        work[i, 4] = rx2 + g * kv2
    last = STAGES - 1
    for n in range(STATES):
        new[n] = work[at, n] + work[last, n]
    if not abs(new[0]) + abs(new[1]) + abs(new[2]) + abs(new[3]) + abs(new[4]) < math.inf:
        return math.nan  # which no maximum would show
    V, Z = m.typical_v, m.typical_z
    of_v = max(abs(y[1]), abs(new[1])) + V
    of_v2 = max(abs(y[3]), abs(new[3])) + V
    of_z = max(abs(y[2]), abs(new[2])) + Z
    error = max(abs(work[last, 1]) / of_v, abs(work[last, 3]) / of_v2)
    error = max(error, abs(work[last, 2]) / of_z)
    error = max(error, abs(work[last, 0]) / (h * of_v))
    error = max(error, abs(work[last, 4]) / (h * of_v2))
    return error / TUNING.relative_tolerance
