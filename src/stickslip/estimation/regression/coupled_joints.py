"""Two joints of which the second motor turns with the first joint, as in many wrists.

The second motor drives its joint through the first one, by a gear or a belt around its axis. With
the positions phi_1 and phi_2 of the motors, on the side of the joints, the first joint is at phi_1
and the second one at phi_2 - phi_1. Friction acts where parts rub: on the shaft of each motor, and
in the second joint, which turns at the difference of both rates,

    e_1 = J_1 a_1 + J_12 a_2 + F_1(v_1) - F_12(v_2 - v_1) + offset_1
    e_2 = J_12 a_1 + J_2 a_2 + F_2(v_2) + F_12(v_2 - v_1) + offset_2,

with F(v) = coulomb_friction sign(v) + viscous_friction v for each. By the joint coordinates
q_1 = phi_1 and q_2 = phi_2 - phi_1 and their torques e_1 + e_2 and e_2 this is the form in which
robots with such wrists are identified: friction of motor 2 couples both joints with
sign(q_1' + q_2').
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.regression.law_selection.linear_fit import LinearFit, fit_rows
from stickslip.estimation.regression.law_selection.smooth_motion import RowSettings, SmoothMotion
from stickslip.records import AxisLog, InputError

__all__ = ["CoupledJoints"]

_NAMES = (
    "inertia_1", "inertia_2", "inertia_12",
    "viscous_friction_1", "coulomb_friction_1",
    "viscous_friction_2", "coulomb_friction_2",
    "viscous_friction_12", "coulomb_friction_12",
    "offset_1", "offset_2",
)  # fmt: skip

_ROUNDS = 3


@dataclass(frozen=True, kw_only=True)
class CoupledJoints:
    """Least squares of the inverse dynamics of two joints at once.

    Both equations are weighted by what they leave over, and solved together. Gravity and the other
    joints are not modelled: what they do adds to the residual, and to the intervals.

    Attributes
    ----------
    rows
        How the logs become rows.

    Examples
    --------
    >>> CoupledJoints().names[3:5]
    ('viscous_friction_1', 'coulomb_friction_1')
    """

    rows: RowSettings = RowSettings()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters: 1 and 2 for the motors, 12 for the second joint."""
        return _NAMES

    def fit(self, first: AxisLog, second: AxisLog) -> LinearFit:
        """Estimate inertias, frictions and offsets.

        Parameters
        ----------
        first, second
            Motor position over the gear's ratio, and motor effort times it, at the same instants.

        Raises
        ------
        InputError
            If the logs are not of the same instants, have gaps or are too short, or do not
            determine the parameters.
        """
        if len(first) != len(second) or not np.array_equal(first.time, second.time):
            raise InputError(
                f"the logs have {len(first)} and {len(second)} samples, or other instants",
                where=f"{first.name}, {second.name}",
                remedy="record both joints together",
            )
        motions = self.rows.motion(first), self.rows.motion(second)
        tables = _tables(*motions)
        fit = _weighted(tables, [1.0, 1.0])
        for _ in range(_ROUNDS):
            values = list(fit.values.values())
            left = [float(np.std(table[:, 0] - table[:, 1:] @ values)) for table in tables]
            fit = _weighted(tables, [1.0 / each for each in left])
        return fit


def _weighted(tables: list[Float[np.ndarray, "m c"]], weights: list[float]) -> LinearFit:
    """Fit both equations, their rows in turn, in the order of time."""
    both = np.stack([w * table for w, table in zip(weights, tables, strict=True)], axis=1)
    rows = both.reshape(-1, both.shape[2])
    return fit_rows(_NAMES, rows[:, 1:], rows[:, 0])


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
