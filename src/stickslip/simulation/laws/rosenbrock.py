"""One step of a linearly implicit Runge-Kutta method, for plants whose law is not affine.

Rodas5 (Di Marzo 1993; Hairer and Wanner, Solving Ordinary Differential Equations II, Sect. IV.7,
for the form): eight stages of order 5 with an embedded solution of order 4, stiffly accurate and
L-stable, so that stiff bristles do not force its step down. Each stage solves one linear system,
with the same matrix; there is nothing to iterate.
"""

import math

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.simulation.laws.rates import (
    KS,
    M1,
    M2,
    TYPICAL_V,
    TYPICAL_Z,
    linearised,
    rates,
)

__all__ = ["ORDER", "RELATIVE_TOLERANCE", "STATES", "rosenbrock_step"]

Vector = NDArray[np.float64]

STATES = 5  # x1, v1, z, x2, v2
STAGES = 8
ORDER = 5.0
GAMMA = 0.19

RELATIVE_TOLERANCE = 1e-11
"""Error allowed in a step, relative to the state or to what is typical of it."""

A = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0],
        [2.0, 0.0, 0.0, 0.0, 0.0],
        [3.040894194418781, 1.041747909077569, 0.0, 0.0, 0.0],
        [2.576417536461461, 1.622083060776640, -0.9089668560264532, 0.0, 0.0],
        [2.760842080225597, 1.446624659844071, -0.3036980084553738, 0.2877498600325443, 0.0],
        [
            -14.09640773051259,
            6.925207756232704,
            -41.47510893210728,
            2.343771018586405,
            24.13215229196062,
        ],
    ]
)
C = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [-10.31323885133993, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [-21.04823117650003, -7.234992135176716, 0.0, 0.0, 0.0, 0.0, 0.0],
        [32.22751541853323, -4.943732386540191, 19.44922031041879, 0.0, 0.0, 0.0, 0.0],
        [
            -20.69865579590063,
            -8.816374604402768,
            1.260436877740897,
            -0.7495647613787146,
            0.0,
            0.0,
            0.0,
        ],
        [
            -46.22004352711257,
            -17.49534862857472,
            -289.6389582892057,
            93.60855400400906,
            318.3822534212147,
            0.0,
            0.0,
        ],
        [
            34.20013733472935,
            -14.15535402717690,
            57.82335640988400,
            25.83362985412365,
            1.408950972071624,
            -6.551835421242162,
            0.0,
        ],
        [
            42.57076742291101,
            -13.80770672017997,
            93.98938432427124,
            18.77919633714503,
            -31.58359187223370,
            -6.685968952921985,
            -5.810979938412932,
        ],
    ]
)


@compiled()
def rosenbrock_step(
    model: Vector, s: float, U: float, y: Vector, h: float, work: Vector, new: Vector
) -> float:
    """Write the state after a step of length h in direction s; return its error over the allowed.

    NaN if it is not finite.

    ``y`` and ``new`` hold (x1, v1, z, x2, v2), ``work`` is (STAGES + 1, STATES).
    """
    g = GAMMA * h
    a_v, a_z, r_v, r_z = linearised(model, s, y[1], y[2])
    k1, k2 = model[KS] / model[M1], model[KS] / model[M2]
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
        x, v, z, x2, v2 = work[at, 0], work[at, 1], work[at, 2], work[at, 3], work[at, 4]
        dv, dz, dv2 = rates(model, s, U, x, v, z, x2)
        rx, rv, rz, rx2, rv2 = v, dv, dz, v2, dv2
        for j in range(i):
            rx += C[i, j] / h * work[j, 0]
            rv += C[i, j] / h * work[j, 1]
            rz += C[i, j] / h * work[j, 2]
            rx2 += C[i, j] / h * work[j, 3]
            rv2 += C[i, j] / h * work[j, 4]
        rx, rv, rz, rx2, rv2 = g * rx, g * rv, g * rz, g * rx2, g * rv2
        rd = rx - rx2
        rv -= g * k1 * D * (rd - g * rv2)
        kv = (rv * m22 - m12 * rz) / det
        kz = (m11 * rz - m21 * rv) / det
        kv2 = D * (rv2 + g * k2 * (rd + g * kv))
        work[i, 0] = rx + g * kv
        work[i, 1] = kv
        work[i, 2] = kz
        work[i, 3] = rx2 + g * kv2
        work[i, 4] = kv2
    last = STAGES - 1
    for n in range(STATES):
        new[n] = work[at, n] + work[last, n]
    if not abs(new[0]) + abs(new[1]) + abs(new[2]) + abs(new[3]) + abs(new[4]) < math.inf:
        return math.nan  # which no maximum would show
    V, Z = model[TYPICAL_V], model[TYPICAL_Z]
    of_v = max(abs(y[1]), abs(new[1])) + V
    of_v2 = max(abs(y[4]), abs(new[4])) + V
    of_z = max(abs(y[2]), abs(new[2])) + Z
    error = max(abs(work[last, 1]) / of_v, abs(work[last, 4]) / of_v2)
    error = max(error, abs(work[last, 2]) / of_z)
    error = max(error, abs(work[last, 0]) / (h * of_v))
    error = max(error, abs(work[last, 3]) / (h * of_v2))
    return error / RELATIVE_TOLERANCE
