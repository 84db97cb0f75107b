"""Friction of two joints of which the second motor turns with the first joint.

The second motor drives its joint through the first one, by a gear or a belt around its axis. With
the positions phi_1 and phi_2 of the motors, on the side of the joints, the first joint is at phi_1
and the second one at phi_2 - phi_1. Friction acts where parts rub: on the shaft of each motor, and
in the second joint, which turns at the difference of both rates,

    e_1 = J_1 a_1 + J_12 a_2 + F_1(v_1) - F_12(v_2 - v_1) + offset_1
    e_2 = J_12 a_1 + J_2 a_2 + F_2(v_2) + F_12(v_2 - v_1) + offset_2,

with F(v) = coulomb_friction sign(v) + viscous_friction v for each. In the joint coordinates
q_1 = phi_1 and q_2 = phi_2 - phi_1 and their torques e_1 + e_2 and e_2 this is the published form:
friction of motor 2 couples both joints with sign(q_1' + q_2').
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.intervals import robust_uncertainty, t_quantile
from stickslip.records import AxisLog
from studies.real_logs.motion import SmoothMotion, smooth_motion

NAMES = (
    "inertia_1", "inertia_2", "inertia_12",
    "viscous_friction_1", "coulomb_friction_1",
    "viscous_friction_2", "coulomb_friction_2",
    "viscous_friction_12", "coulomb_friction_12",
    "offset_1", "offset_2",
)  # fmt: skip
_ROUNDS = 3  # of the weights, which no longer change then
_DEGENERATE = 1e-6  # ratio of singular values of columns of unit norm


@dataclass(frozen=True, kw_only=True)
class CoupledFit:
    """Values and 95 % intervals by name [SI]."""

    values: Mapping[str, float]
    ci95: Mapping[str, tuple[float, float]]


def fit_coupled_joints(first: AxisLog, second: AxisLog) -> CoupledFit:
    """Estimate inertias, frictions and offsets of two joints by least squares.

    Both logs have motor positions over the gear's ratio and motor efforts times it, at the same
    instants. Both equations are weighted by their residuals, and solved together. Gravity and the
    other joints are not modelled: what they do is in the residuals, and so in the intervals.
    """
    if not np.array_equal(first.time, second.time):
        raise ValueError(f"{first.name} and {second.name} were not recorded at the same instants")
    tables = _tables(smooth_motion(first), smooth_motion(second))
    fit = _weighted(tables, [1.0, 1.0])
    for _ in range(_ROUNDS):
        values = list(fit.values.values())
        rests = [float(np.std(table[:, 0] - table[:, 1:] @ values)) for table in tables]
        fit = _weighted(tables, [1.0 / each for each in rests])
    return fit


def _weighted(tables: Sequence[Float[np.ndarray, "m c"]], weights: Sequence[float]) -> CoupledFit:
    """Fit both equations, their rows in turn, in the order of time."""
    both = np.stack([w * table for w, table in zip(weights, tables, strict=True)], axis=1)
    rows = both.reshape(-1, both.shape[2])
    target, columns = rows[:, 0], rows[:, 1:]
    norms = np.linalg.norm(columns, axis=0)
    left, singular, right = np.linalg.svd(columns / norms, full_matrices=False)
    if singular[-1] < _DEGENERATE * singular[0]:
        raise ValueError("the log does not determine the parameters of both joints")
    to_values = (right.T / singular) / norms[:, None]
    values = to_values @ (left.T @ target)
    found = robust_uncertainty(left, to_values, target - columns @ values)
    half = np.sqrt(np.diag(found.covariance))
    half *= [t_quantile(float(degrees)) for degrees in found.degrees_of_freedom]
    return CoupledFit(
        values=dict(zip(NAMES, values.tolist(), strict=True)),
        ci95=dict(
            zip(NAMES, zip((values - half).tolist(), (values + half).tolist(), strict=True),
                strict=True)
        ),
    )  # fmt: skip


def _tables(first: SmoothMotion, second: SmoothMotion) -> list[Float[np.ndarray, "m c"]]:
    """Return effort and columns of both equations, where nothing rests that rubs."""
    v1, v2 = first.velocity, second.velocity
    a1, a2 = first.acceleration, second.acceleration
    v12 = v2 - v1
    together = np.abs(v12) < max(first.slow, second.slow)
    moving = replace(first, resting=first.resting | second.resting | together)
    s1, s2, s12 = np.sign(v1), np.sign(v2), np.sign(v12)
    none, one = np.zeros_like(v1), np.ones_like(v1)
    equations = (
        [first.effort, a1, none, a2, v1, s1, none, none, -v12, -s12, one, none],
        [second.effort, none, a2, a1, none, none, v2, s2, v12, s12, none, one],
    )
    return [moving.decimated(np.column_stack(columns)) for columns in equations]
