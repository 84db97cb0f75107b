"""The step of a feedback controller: what it remembers, and the kernels that advance it.

Settings and memory are one vector of fixed size, so that one piece of machine code serves all
controllers, whatever their settings. What lies where in it is given by the constants below.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from jaxtyping import Float
from numba.extending import is_jitted

from stickslip.compiled import compiled
from stickslip.control.friction_compensation import compensating_effort, physical
from stickslip.control.notch import notch_step
from stickslip.control.pd import pd_effort
from stickslip.control.reference import reference_at
from stickslip.records import SensorSample

__all__ = [
    "COULOMB",
    "COULOMB_AT",
    "DEAD_BAND",
    "EFFORT_LIMIT",
    "ESTIMATOR",
    "INERTIA",
    "MARK",
    "MEASURED",
    "METHOD",
    "MOVES",
    "NEEDS_LOAD",
    "NOTCH",
    "OFFSET",
    "POSITION_GAIN",
    "REFERENCE",
    "REFUSED",
    "SIZE",
    "VELOCITY_GAIN",
    "VISCOUS",
    "VISCOUS_AT",
    "step_for",
]

MARK = 5.0  # of a vector of these kernels

# Settings
(
    METHOD,  # whose vector it is
    SIZE,  # of the vector
    POSITION_GAIN,
    VELOCITY_GAIN,
    INERTIA,
    EFFORT_LIMIT,
    NOTCH,  # five coefficients
) = range(7)
(
    COULOMB,  # in positive, in negative direction
    _,
    VISCOUS,  # likewise
    _,
    OFFSET,
    MEASURED,  # the measured velocity is compensated for, not that of the reference
    DEAD_BAND,
    COULOMB_AT,  # places of the running estimates in this vector; 0 when there are none
    VISCOUS_AT,
    NEEDS_LOAD,
    ESTIMATOR,  # where the estimator's state begins, which is the rest of the vector
    MOVES,
) = range(NOTCH + 5, NOTCH + 17)
# What changes
_Z1, _Z2, REFUSED = range(MOVES + 1, MOVES + 4)  # notch; samples that the estimator did not take
REFERENCE = REFUSED + 1  # the moves

Vector = Float[np.ndarray, " s"]
Step = Callable[[Vector, SensorSample], tuple[Vector, float]]


@compiled()
def command(s: Float[np.ndarray, " s"], t: float, x: float, v: float) -> float:
    """Return the effort at time t, and advance the notch in place unless the effort is not finite.

    u = H(z) [K_p (r - x) + K_d (r' - v)] + J r'' + f_c sign(w) + c w + f_0, limited; w is the
    velocity compensated for (van de Wijdeven 2002 A section 6.2).

    Raises
    ------
    ValueError
        If the vector is not one of these kernels.
    """
    if s.size < REFERENCE or s[METHOD] != MARK or s[SIZE] != s.size:
        raise ValueError("not a state of a FeedbackController: begin with the one of its init()")
    r, r_dot, r_ddot = reference_at(s, REFERENCE, int(s[MOVES]), t)
    e = pd_effort(s[POSITION_GAIN], s[VELOCITY_GAIN], r, x, r_dot, v)
    y, z1, z2 = notch_step(
        s[NOTCH], s[NOTCH + 1], s[NOTCH + 2], s[NOTCH + 3], s[NOTCH + 4], s[_Z1], s[_Z2], e
    )
    if s[COULOMB_AT] > 0.0:
        f_pos = physical(s[int(s[COULOMB_AT])])
        c_pos = physical(s[int(s[VISCOUS_AT])])
        f_neg, c_neg = f_pos, c_pos
    else:
        f_pos, f_neg = s[COULOMB], s[COULOMB + 1]
        c_pos, c_neg = s[VISCOUS], s[VISCOUS + 1]
    w = v if s[MEASURED] > 0.0 else r_dot
    u = y + s[INERTIA] * r_ddot + s[OFFSET]
    u += compensating_effort(f_pos, f_neg, c_pos, c_neg, w, s[DEAD_BAND])
    if not np.isfinite(u):
        return np.nan
    s[_Z1], s[_Z2] = z1, z2
    limit = s[EFFORT_LIMIT]
    return min(max(u, -limit), limit)


@compiled()
def _step_alone(
    state: Float[np.ndarray, " s"], sample: SensorSample
) -> tuple[Float[np.ndarray, " s"], float]:
    """Take a sample, with no estimator running along."""
    s = state.copy()
    return s, command(s, sample.time, sample.measured_position, sample.measured_velocity)


def step_for(kernel: Any) -> Step:
    """Return the step that feeds an estimator's kernel; compiled, and only once, when that is.

    Parameters
    ----------
    kernel
        Of an `OnlineFriction`, or None.
    """
    if kernel is None:
        return _step_alone
    return _compiled_step(kernel) if is_jitted(kernel) else _step_with(kernel)


@cache
def _compiled_step(kernel: Any) -> Step:
    return compiled(cached=False)(_step_with(kernel))


def _step_with(kernel: Any) -> Step:
    def step(state: Vector, sample: SensorSample) -> tuple[Vector, float]:
        s = state.copy()
        x, v = sample.measured_position, sample.measured_velocity
        u = command(s, sample.time, x, v)
        if np.isfinite(u):
            x2, v2 = sample.measured_load_position, sample.measured_load_velocity
            if s[NEEDS_LOAD] == 0.0:
                x2 = 0.0 if np.isnan(x2) else x2
                v2 = 0.0 if np.isnan(v2) else v2
            if not kernel(s[int(s[ESTIMATOR]) :], u, x, v, x2, v2):
                s[REFUSED] += 1.0
        return s, u

    return step
