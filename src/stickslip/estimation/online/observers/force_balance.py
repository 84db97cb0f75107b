"""The friction force of one sample, and how gradient observers follow it.

Over a sample in which the effort u is held, momentum is exactly

    m (v - v_0) = T (u_0 - k_s d - f),    f = c v_m + f_c sign(v) + offset,

with means over the sample: d the stretch of the spring, v_m the velocity, f the friction force. So
f is known at the end of each sample without a derivative, and is linear in what is sought. Samples
in which the velocity changes its sign or is zero at an end give no row. Nor do
those of a rest: where its noise makes an axis seem to move, its force has either sign, and an
observer learns from that that there is no friction. A dead band keeps it from that.

A sample passes `stickslip.estimation.online.faults.admission` first. One with a missing or
impossible value gives no row, nor does the next one. After a sample `settled` returns to
the last valid estimates if these are not finite (`stickslip.estimation.online.faults.guard`).

The state is that of `stickslip.estimation.online.recursion`, with viscous friction, Coulomb
friction and the offset at its values (and a sought mass before them), and behind it what is laid
out below.
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.online.faults.admission import ADMISSION_DTYPE, ADMISSION_SIZE, admit
from stickslip.estimation.online.faults.guard import guard_size, stays_valid
from stickslip.estimation.online.recursion import (
    COUNTED,
    MOST_PARAMETERS,
    ROW,
    SAMPLING_TIME,
    STIFFNESS,
    VALUES,
)
from stickslip.numerics.named_fields import fields_at

__all__ = [
    "ADMISSION",
    "DEAD_BAND",
    "FORCE",
    "GAINS",
    "GUARD",
    "INERTIA",
    "KNOWN",
    "LAST_EFFORT",
    "LAST_POSITION",
    "LAST_VELOCITY",
    "METHOD",
    "SHAPE",
    "SPEED",
    "STATE_SIZE",
    "admission",
    "balance",
    "follow",
    "set_aside",
    "settled",
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
    METHOD,  # of the method's own, up to eight numbers
) = range(VALUES + MOST_PARAMETERS, VALUES + MOST_PARAMETERS + 15)
GAINS = _GAINS[0]
ADMISSION = METHOD + 8
GUARD = ADMISSION + ADMISSION_SIZE
STATE_SIZE = GUARD + guard_size(ADMISSION)

admission = fields_at(ADMISSION_DTYPE, start=ADMISSION)

_FRICTION = 3  # values that a gain belongs to


@compiled(inline=True)
def balance(s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float) -> bool:
    """Lay force and row of the sample that ends here in the state; return whether there is a row.

    The mean stretch of the spring is that of the cubic through both ends.
    """
    complete = False
    ready, u, unknown, x, v, x2, v2, _ = admit(admission(s), u, x, v, x2, v2)
    if not ready:
        return False
    if s[STIFFNESS] == 0.0:
        x2, v2 = 0.0, 0.0
    if np.isnan(x + v + x2 + v2):
        s[KNOWN] = 0.0
        return False
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
        complete = v0 * v > 0.0 and min(abs(v0), abs(v)) > s[DEAD_BAND]
    s[KNOWN] = 0.0 if unknown else 1.0
    s[LAST_EFFORT], s[LAST_POSITION], s[LAST_VELOCITY] = u, x, v
    s[_LAST_LOAD], s[_LAST_LOAD_VELOCITY] = x2, v2
    return complete


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


@compiled(inline=True)
def set_aside(s: Float[np.ndarray, " s"], quiet: bool) -> None:
    """Let a quiet sample end no row and begin none; called before and after it."""
    if quiet:
        s[KNOWN] = 0.0


@compiled(inline=True)
def settled(s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float) -> bool:
    """Validate the estimates after a sample; return whether all of the sample was finite."""
    if not stays_valid(s, GUARD, ADMISSION, VALUES, _FRICTION + 1):
        s[KNOWN] = 0.0
    load = x2 + v2 if s[STIFFNESS] > 0.0 else 0.0
    return bool(np.isfinite(u + x + v + load))
