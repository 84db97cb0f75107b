"""The step of a feedback controller.

Settings and memory are one vector, so that one piece of machine code serves all controllers,
whatever their settings: the fields of `HEAD`, the moves of the reference, and the state of the
estimator that runs along.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from jaxtyping import Float
from numba.extending import is_jitted

from stickslip.compiled import compiled
from stickslip.control.feedback.friction_compensation import compensating_effort, physical
from stickslip.control.feedback.notch import notch_step
from stickslip.control.feedback.pd import pd_effort
from stickslip.control.feedback.reference import reference_at
from stickslip.numerics.named_fields import fields_at, places
from stickslip.records import SensorSample

__all__ = ["HEAD", "METHOD", "REFERENCE", "head", "step_for"]

METHOD = 5  # of a vector of these kernels

HEAD = np.dtype(
    [
        # Settings
        ("method", "i8"),  # whose vector it is
        ("length", "i8"),  # of the vector
        ("position_gain", "f8"),
        ("velocity_gain", "f8"),
        ("inertia", "f8"),
        ("effort_limit", "f8"),
        ("notch", "f8", (5,)),  # coefficients
        ("coulomb", "f8", (2,)),  # in positive, in negative direction
        ("viscous", "f8", (2,)),  # likewise
        ("offset", "f8"),
        ("measured", "i8"),  # 1: the measured velocity is compensated for, not the reference's
        ("dead_band", "f8"),
        ("coulomb_at", "i8"),  # places of the running estimates in the vector; 0 without any
        ("viscous_at", "i8"),
        ("needs_load", "i8"),
        ("estimator", "i8"),  # where the estimator's state begins, which is the rest of the vector
        ("moves", "i8"),
        # What changes
        ("z", "f8", (2,)),  # memory of the notch
        ("refused", "i8"),  # samples that the estimator did not take
    ]
)
"""Fields before the moves of the reference."""

head = fields_at(HEAD)
REFERENCE = places(HEAD)
"""Place of the first move."""

Vector = Float[np.ndarray, " s"]
Step = Callable[[Vector, SensorSample], tuple[Vector, float]]


@compiled()
def command(vector: Float[np.ndarray, " s"], t: float, x: float, v: float) -> float:
    """Return the effort at time t, and advance the notch in place unless the effort is not finite.

    u = H(z) [K_p (r - x) + K_d (r' - v)] + J r'' + f_c sign(w) + c w + f_0, limited; w is the
    velocity compensated for (van de Wijdeven 2002 A section 6.2).

    Raises
    ------
    ValueError
        If the vector is not one of these kernels.
    """
    if (
        vector.size < REFERENCE
        or head(vector).method != METHOD
        or head(vector).length != vector.size
    ):
        raise ValueError("not a state of a FeedbackController: begin with the one of its init()")
    s = head(vector)
    r, r_dot, r_ddot = reference_at(vector, REFERENCE, s.moves, t)
    e = pd_effort(s.position_gain, s.velocity_gain, r, x, r_dot, v)
    n = s.notch
    y, z1, z2 = notch_step(n[0], n[1], n[2], n[3], n[4], s.z[0], s.z[1], e)
    if s.coulomb_at > 0:
        f_pos = physical(float(vector[s.coulomb_at]))
        c_pos = physical(float(vector[s.viscous_at]))
        f_neg, c_neg = f_pos, c_pos
    else:
        f_pos, f_neg = s.coulomb[0], s.coulomb[1]
        c_pos, c_neg = s.viscous[0], s.viscous[1]
    w = v if s.measured else r_dot
    u = y + s.inertia * r_ddot + s.offset
    u += compensating_effort(f_pos, f_neg, c_pos, c_neg, w, s.dead_band)
    if not np.isfinite(u):
        return np.nan
    s.z[0], s.z[1] = z1, z2
    limit = s.effort_limit
    return min(max(u, -limit), limit)


@compiled()
def _step_alone(
    state: Float[np.ndarray, " s"], sample: SensorSample
) -> tuple[Float[np.ndarray, " s"], float]:
    """Take a sample, with no estimator running along."""
    vector = state.copy()
    return vector, command(vector, sample.time, sample.measured_position, sample.measured_velocity)


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
        vector = state.copy()
        x, v = sample.measured_position, sample.measured_velocity
        u = command(vector, sample.time, x, v)
        if np.isfinite(u):
            s = head(vector)
            x2, v2 = sample.measured_load_position, sample.measured_load_velocity
            if not s.needs_load:
                x2 = 0.0 if np.isnan(x2) else x2
                v2 = 0.0 if np.isnan(v2) else v2
            if not kernel(vector[s.estimator :], u, x, v, x2, v2):
                s.refused += 1
        return vector, u

    return step
