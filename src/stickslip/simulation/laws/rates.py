"""Rates of change of a plant whose friction law is not affine, and their derivatives.

The plant is the flexible arm with x1, v1, x2, v2 (van de Wijdeven 2002 A Eqs. 2.1-2.3); a rigid
axis is an arm whose spring has no stiffness. Friction is one of two kinds.

- Without bristles (Stribeck): ``s G(v) + c v`` while slipping in direction s, with
  ``G(v) = f_c + (f_s - f_c) exp(-(s v/v_s)^delta)``.
- With bristles of deflection z (Dahl, LuGre, elasto-plastic; Dupont et al. 2002 write them as one):
  ``z' = v (1 - alpha(z, v) s sigma_0 z/G(v))^i`` and the friction is
  ``sigma_0 z + sigma_1 z' + c v``. Dahl has G = f_c and alpha = 1, LuGre alpha = 1 and i = 1.

The direction s is held while a formula holds, and each goes on smoothly a little beyond v = 0: it
is there that the integrator finds out when to change it.
"""

import math

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled

__all__ = ["MODEL_SIZE", "acceleration", "linearised", "rates"]

(
    TIME, M1, M2, KS, FC_N, FC_P, FS_N, FS_P, C_N, C_P, OFFSET,
    STRIBECK,  # Stribeck velocity v_s
    DELTA,  # exponent of the Stribeck effect: 2 or 1
    SIGMA_0,  # stiffness of the bristles; 0 without any
    SIGMA_1,  # damping of the bristles
    EXPONENT,  # i, 1 but for Dahl
    ELASTIC,  # elastic deflection z_ba; negative where alpha is 1 throughout
    TYPICAL_V,  # a speed and a deflection that errors are small against
    TYPICAL_Z,
    FEATURE_V,  # changes of speed and deflection over which the friction changes much
    FEATURE_Z,
    BUDGET,  # steps and events allowed in one sample
) = range(22)  # fmt: skip
MODEL_SIZE = 22

Vector = NDArray[np.float64]


@compiled(inline=True)
def _strength(model: Vector, s: float, v: float) -> tuple[float, float]:
    """Return G(v) and its derivative."""
    fc = model[FC_P] if s > 0.0 else model[FC_N]
    more = (model[FS_P] if s > 0.0 else model[FS_N]) - fc
    if more == 0.0:
        return fc, 0.0
    r = s * v / model[STRIBECK]
    if model[DELTA] == 2.0:
        left = math.exp(-r * r)
        return fc + more * left, -2.0 * r * left * more * s / model[STRIBECK]
    left = math.exp(-max(r, -1.0))  # of no use beyond v = 0, but to stay finite there
    return fc + more * left, (-left * more * s / model[STRIBECK] if r > -1.0 else 0.0)


@compiled(inline=True)
def _plasticity(
    model: Vector, s: float, z: float, G: float, G_v: float
) -> tuple[float, float, float]:
    """Return alpha(z, v) (Dupont et al. 2002) and its derivatives by v and z."""
    elastic = model[ELASTIC]
    if elastic < 0.0:
        return 1.0, 0.0, 0.0
    bend = s * z
    if bend <= elastic:
        return 0.0, 0.0, 0.0
    full = G / model[SIGMA_0]
    if bend >= full:
        return 1.0, 0.0, 0.0
    width = full - elastic
    phase = math.pi * (bend - 0.5 * (full + elastic)) / width
    steep = 0.5 * math.pi * math.cos(phase) / width
    by_full = -steep * (bend - elastic) / width
    return 0.5 + 0.5 * math.sin(phase), by_full * G_v / model[SIGMA_0], steep * s


@compiled(inline=True)
def rates(
    model: Vector, s: float, U: float, x: float, v: float, z: float, x2: float
) -> tuple[float, float, float]:
    """Return v', z' and v2' under the effort less the offset U."""
    G, G_v = _strength(model, s, v)
    c = model[C_P] if s > 0.0 else model[C_N]
    spring = model[KS] * (x - x2)
    if model[SIGMA_0] == 0.0:
        bending, friction = 0.0, s * G + c * v
    else:
        alpha, _, _ = _plasticity(model, s, z, G, G_v)
        left = 1.0 - alpha * s * model[SIGMA_0] * z / G
        if model[EXPONENT] != 1.0:
            left = math.copysign(abs(left) ** model[EXPONENT], left)
        bending = v * left
        friction = model[SIGMA_0] * z + model[SIGMA_1] * bending + c * v
    return (U - spring - friction) / model[M1], bending, spring / model[M2]


@compiled()
def acceleration(
    model: Vector, s: float, U: float, x: float, v: float, z: float, x2: float
) -> float:
    """Return v' alone."""
    return rates(model, s, U, x, v, z, x2)[0]


@compiled(inline=True)
def linearised(model: Vector, s: float, v: float, z: float) -> tuple[float, float, float, float]:
    """Return the derivatives of v' by v and z, and of z' by v and z."""
    G, G_v = _strength(model, s, v)
    c = model[C_P] if s > 0.0 else model[C_N]
    m = model[M1]
    if model[SIGMA_0] == 0.0:
        return -(s * G_v + c) / m, 0.0, 0.0, 0.0
    alpha, alpha_v, alpha_z = _plasticity(model, s, z, G, G_v)
    q = s * model[SIGMA_0] * z / G
    q_v, q_z = -q * G_v / G, s * model[SIGMA_0] / G
    left = 1.0 - alpha * q
    i = model[EXPONENT]
    power, slope = left, 1.0
    if i != 1.0:
        slope = i * abs(left) ** (i - 1.0)
        power = math.copysign(abs(left) ** i, left)
    z_v = power - v * slope * (alpha_v * q + alpha * q_v)
    z_z = -v * slope * (alpha_z * q + alpha * q_z)
    return (
        -(model[SIGMA_1] * z_v + c) / m,
        -(model[SIGMA_0] + model[SIGMA_1] * z_z) / m,
        z_v,
        z_z,
    )
