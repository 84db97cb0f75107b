"""The friction force of one sample, and how gradient observers follow it.

Over a sample in which the effort u is held, momentum is exactly

    m (v - v_0) = T (u_0 - k_s d - f),    f = c v_m + f_c sign(v) + offset,

with means over the sample: d the stretch of the spring, v_m the velocity, f the friction force. So
f is known at the end of each sample without a derivative, and is linear in what is sought. Samples
in which the velocity changes its sign or is zero at an end tell nothing of a known row. Nor do
those of a rest: where its noise makes an axis seem to move, its force has either sign, and an
observer learns from that that there is no friction. A dead band keeps it from that.

The state is that of `stickslip.estimation.online.recursion`, with viscous friction, Coulomb
friction and the offset at its values (and a sought mass before them), and behind it what is laid
out below.
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.online.recursion import (
    COUNTED,
    MOST_PARAMETERS,
    ROW,
    SAMPLING_TIME,
    STIFFNESS,
    VALUES,
)

__all__ = [
    "DEAD_BAND",
    "FORCE",
    "GAINS",
    "INERTIA",
    "KNOWN",
    "LAST_EFFORT",
    "LAST_POSITION",
    "LAST_VELOCITY",
    "SHAPE",
    "SPEED",
    "STATE_SIZE",
    "balance",
    "finite",
    "follow",
]

(
    # Settings
    INERTIA,  # 0 where it is sought
    SPEED,  # typical one, that gains refer to
    SHAPE,  # a number of the method's own
    DEAD_BAND,  # slower than this, the axis may be at rest
    *_GAINS,  # Gamma, of the viscous friction, the Coulomb friction and the offset
    # What changes
    KNOWN,  # whether there is a sample before this one
    LAST_EFFORT,
    LAST_POSITION,
    LAST_VELOCITY,
    _LAST_LOAD,
    _LAST_LOAD_VELOCITY,
    FORCE,  # f of the sample that has just ended; with the inertia sought, f and its force
    STATE_SIZE,
) = range(VALUES + MOST_PARAMETERS, VALUES + MOST_PARAMETERS + 15)
GAINS = _GAINS[0]

_FRICTION = 3  # values that a gain belongs to


@compiled(inline=True)
def finite(u: float, x: float, v: float, x2: float, v2: float) -> bool:
    """Return whether every number of a sample is finite."""
    return bool(np.isfinite(u + x + v + x2 + v2))


@compiled(inline=True)
def balance(s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float) -> bool:
    """Lay force and row of the sample that ends here in the state; return whether they tell.

    The mean stretch of the spring is that of the cubic through both ends.
    """
    told = False
    v0 = s[LAST_VELOCITY]
    if s[KNOWN] > 0.0:
        T = s[SAMPLING_TIME]
        d0, d = s[LAST_POSITION] - s[_LAST_LOAD], x - x2
        w0, w = v0 - s[_LAST_LOAD_VELOCITY], v - v2
        stretch = 0.5 * (d0 + d) + T / 12.0 * (w0 - w)
        acceleration = (v - v0) / T
        s[FORCE] = s[LAST_EFFORT] - s[INERTIA] * acceleration - s[STIFFNESS] * stretch
        k = ROW
        if s[INERTIA] == 0.0:
            s[k] = acceleration
            k += 1
        s[k] = 0.5 * (v0 + v)
        s[k + 1] = 1.0 if v > 0.0 else -1.0
        s[k + 2] = 1.0
        told = v0 * v > 0.0 and min(abs(v0), abs(v)) > s[DEAD_BAND]
    s[KNOWN] = 1.0
    s[LAST_EFFORT], s[LAST_POSITION], s[LAST_VELOCITY] = u, x, v
    s[_LAST_LOAD], s[_LAST_LOAD_VELOCITY] = x2, v2
    return told


@compiled(inline=True)
def follow(s: Float[np.ndarray, " s"], y: float, rho: float) -> None:
    """Follow the gradient flow theta' = rho Gamma r (y - <r, theta>) over a sample.

    With the row r and the target y held, the flow moves along Gamma r only, and is solved exactly:
    the error y - <r, theta> decays by exp(-rho g T), g = <r, Gamma r>. So the step is stable
    whatever the gains, and <theta~, Gamma^-1 theta~> never grows where y = <r, theta>.
    """
    g, e = 0.0, y
    for i in range(_FRICTION):
        g += s[GAINS + i] * s[ROW + i] * s[ROW + i]
        e -= s[ROW + i] * s[VALUES + i]
    if g > 0.0:
        share = -np.expm1(-rho * g * s[SAMPLING_TIME]) / g
        for i in range(_FRICTION):
            s[VALUES + i] += s[GAINS + i] * s[ROW + i] * share * e
        s[COUNTED] += 1.0
