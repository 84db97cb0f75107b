"""Coulomb, viscous and static friction with their Stribeck velocity: separable least squares.

Given the Stribeck velocity, friction is linear in its parameters; what an estimator makes of a log
is then a linear regression. The velocity itself is what is left to search: the sum of squares that
linear least squares leaves, as a function of it alone (variable projection, Golub and Pereyra
1973). Near its minimum the law is linearised in the velocity too, as van de Wijdeven (2002, part A,
chapter 7) recommends, which makes the search a Gauss-Newton iteration and gives the intervals.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.estimator import EnergyEstimator
from stickslip.estimation.fit.fitted import Fit, RowsEstimator
from stickslip.estimation.fit.intervals import t_quantile
from stickslip.estimation.fit.rows import Regression, least_squares
from stickslip.estimation.fit.solve import provenance_of, solve
from stickslip.estimation.prepare import repaired
from stickslip.estimation.regression.idim import IdimLeastSquares
from stickslip.estimation.signals.kinematics import slow_speed
from stickslip.friction import StribeckEffect
from stickslip.friction.stribeck import StribeckShape
from stickslip.records import AxisKind, AxisLog, FrictionEstimate, InputError, Status

_COARSE, _FINE = 9, 7
"""Stribeck velocities that are compared at once, over the whole range and then around the best."""

_APART = 0.05  # relative distance of the velocities that the slope is taken from

_CONVERGED = 2e-3
"""Relative change of the Stribeck velocity that the last linearisation may still find: it counts,
and is right but for its square."""

_ITERATIONS = 12  # of the linearisation at most [-]
_LARGEST_STEP = 1.5  # factor of the Stribeck velocity in an iteration
_WIDE = 1.0  # half an interval over the Stribeck velocity above which the log has not determined it


@dataclass(frozen=True, kw_only=True)
class StribeckEstimator(RowsEstimator):
    """Fit a Stribeck law to a whole log, its Stribeck velocity included.

    Where no step from static to Coulomb friction stands out, both static friction and Stribeck
    velocity are reported as not identifiable, and the others as if there were none.

    Attributes
    ----------
    method
        What makes a regression of the log, with all its settings but for the Stribeck effect.
    shape
        ``"gaussian"`` or ``"exponential"``.
    velocities
        Smallest and largest Stribeck velocity to look for [m/s or rad/s]; None takes the slowest
        and the fastest motion that the log shows.

    Raises
    ------
    InputError
        If the method has a Stribeck effect already, or the velocities are not 0 < smallest <
        largest.

    Examples
    --------
    >>> StribeckEstimator(method=EnergyEstimator(inertia=95.1)).name
    'stribeck-energy'
    """

    method: EnergyEstimator | IdimLeastSquares
    shape: StribeckShape = "gaussian"
    velocities: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if self.method.stribeck is not None:
            raise InputError("stribeck_given")
        _ = StribeckEffect(velocity=1.0, shape=self.shape)
        if self.velocities is not None and not 0 < self.velocities[0] < self.velocities[1] < np.inf:
            raise InputError(
                "velocities_out_of_order", velocities=self.velocities, unit="m/s or rad/s"
            )

    @property
    def name(self) -> str:
        """Name of the estimator."""
        return f"stribeck-{self.method.name}"

    @property
    def inertia(self) -> float | None:
        """The method's own inertia if it is known [kg or kg m^2]."""
        return self.method.inertia

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of what is estimated, in the order of the rows."""
        sides = ("_positive", "_negative") if self.method.per_direction else ("",)
        static = (f"static_friction{side}" for side in sides)
        return (*self.method.parameter_names(kind), *static, "stribeck_velocity")

    def regression(self, log: AxisLog) -> Regression:
        """Return the method's rows, linearised around the Stribeck velocity that fits best.

        Where no step stands out, the columns of static friction and Stribeck velocity are zeros.
        """
        log = repaired(log)
        plain = self.method.regression(log)
        low, high = self._range(plain)
        note = (
            "no step from static to Coulomb friction stands out with a Stribeck velocity from "
            f"{low:.3g} to {high:.3g} {log.unit('velocity')}"
        )
        best = self._searched(log, low, high) if plain.target.size and low < high else None
        if best is not None:
            velocity, rows = best
            step = _step(self._solved(log, rows), velocity)
            if step > 0:
                return rows
            if step < 0:
                note = (
                    f"friction rises by {-step:.3g} {log.unit('effort')} as motion sets in, over "
                    f"some {velocity:.3g} {log.unit('velocity')}, where static friction would fall"
                )
        return _without_step(plain, note)

    def details(self, log: AxisLog) -> Fit:
        """Return the estimate with its rows, for a report."""
        log = repaired(log)
        rows = self.regression(log)
        return self.method.fitted(self._judged(log, rows), rows)

    def _judged(self, log: AxisLog, regression: Regression) -> FrictionEstimate:
        """Return the estimate, with the reason where the log shows no Stribeck effect."""
        found = self._solved(log, regression)
        absent = [not np.any(column) for column in regression.regressors.T]
        if found.status is not Status.NOT_IDENTIFIABLE or not any(absent):
            return found
        *notes, why_not = found.diagnostics.notes
        pairs = list(zip(found.diagnostics.verdicts, absent, strict=True))
        if all(verdict.identifiable or none for verdict, none in pairs):
            # The status and its advice are about the two that are missing
            notes.append(
                "the axis may have no Stribeck effect; the other parameters are those of a fit "
                "without one, whose status states whether to trust them (leave --stribeck out)"
            )
        verdicts = tuple(replace(v, reason=why_not) if none else v for v, none in pairs)
        diagnostics = replace(found.diagnostics, verdicts=verdicts, notes=tuple(notes))
        return replace(found, diagnostics=diagnostics)

    def _solved(self, log: AxisLog, rows: Regression) -> FrictionEstimate:
        options = {
            "estimator": self.name,
            "shape": self.shape,
            "velocities": self.velocities,
            "method": self.method.options,
        }
        return solve(rows, estimator=self.name, provenance=provenance_of(log, options))

    def _range(self, plain: Regression) -> tuple[float, float]:
        if self.velocities is not None:
            return self.velocities
        motion = plain.motion
        return slow_speed(motion.largest_speed, motion.speed_noise), motion.largest_speed

    def _regression(self, log: AxisLog, velocities: Float[np.ndarray, " k"]) -> Regression:
        """Return the method's rows with a step for each of some Stribeck velocities."""
        effects = tuple(StribeckEffect(velocity=v, shape=self.shape) for v in velocities.tolist())
        return replace(self.method, stribeck=effects).regression(log)

    def _searched(self, log: AxisLog, low: float, high: float) -> tuple[float, Regression] | None:
        """Return the Stribeck velocity that fits best, and the rows linearised there.

        None if the best lies at an end of the range.
        """
        ends = low, high
        for count in (_COARSE, _FINE):
            grid = np.geomspace(*ends, count)
            left = _left_over(self._regression(log, grid), count)
            k = int(np.argmin(left))
            ends = grid[max(k - 1, 0)], grid[min(k + 1, count - 1)]
        velocity = float(grid[k])
        linear = None
        for _ in range(_ITERATIONS):
            around = velocity * np.array([1.0 - _APART, 1.0, 1.0 + _APART])
            linear = _linearised(self._regression(log, around), around)
            found = float(least_squares(linear.regressors, linear.target)[-1])
            after = float(np.clip(found, velocity / _LARGEST_STEP, velocity * _LARGEST_STEP))
            if not low <= after <= high:
                return None
            if abs(after - velocity) <= _CONVERGED * velocity:
                return velocity, linear
            velocity = after
        return None if linear is None else (velocity, linear)


def _sides(regression: Regression) -> tuple[str, ...]:
    """Return what the names of the directional parameters end with."""
    return ("",) if "coulomb_friction" in regression.names else ("_positive", "_negative")


def _column(regression: Regression, name: str) -> Float[np.ndarray, " n"]:
    return regression.regressors[:, regression.names.index(name)]


def _left_over(regression: Regression, count: int) -> Float[np.ndarray, " k"]:
    """Return the sum of squares that is left with each of the steps alone."""
    others = [k for k, name in enumerate(regression.names) if not name.startswith("step")]
    left: list[float] = []
    for k in range(count):
        own = [regression.names.index(f"step_{k}{side}") for side in _sides(regression)]
        columns = regression.regressors[:, others + own]
        residual = regression.target - columns @ least_squares(columns, regression.target)
        left.append(float(residual @ residual))
    return np.array(left)


def _linearised(regression: Regression, around: Float[np.ndarray, " 3"]) -> Regression:
    """Return the rows in Coulomb and static friction and the Stribeck velocity v_s.

    ``f_c (1 - e) + f_s e + (f_s - f_c) de/dv_s (v_s - around)``, the slope from three effects; what
    is known of it is on the target's side.
    """
    names: list[str] = []
    columns: list[Float[np.ndarray, " n"]] = []
    noise: list[float] = []
    for name, column, level in zip(
        regression.names, regression.regressors.T, regression.regressor_noise, strict=True
    ):
        if name.startswith(("step_0", "step_2")):
            continue
        coulomb = name.startswith("coulomb_friction")
        step = name.replace("coulomb_friction", "step_1")
        names.append(name.replace("step_1", "static_friction"))
        columns.append(column - _column(regression, step) if coulomb else column)
        noise.append(float(level))
    found = least_squares(np.column_stack(columns), regression.target)
    values = dict(zip(names, found, strict=True))
    slope = np.zeros(regression.target.size)
    for side in _sides(regression):
        rise = _column(regression, f"step_2{side}") - _column(regression, f"step_0{side}")
        step = values[f"static_friction{side}"] - values[f"coulomb_friction{side}"]
        slope += step * rise / (around[2] - around[0])
    regressors, shifts = np.column_stack([*columns, slope]), regression.shifts
    if shifts is not None:  # the same forces, in the new parameters
        forces = shifts @ regression.regressors.T
        shifts = np.array([least_squares(regressors, force) for force in forces])
    return replace(
        regression,
        target=regression.target + slope * around[1],
        names=(*names, "stribeck_velocity"),
        regressors=regressors,
        regressor_noise=np.array([*noise, 0.0]),
        shifts=shifts,
    )


def _step(found: FrictionEstimate, velocity: float) -> float:
    """Return the step from Coulomb to static friction that stands out most; 0 if none does."""
    identified = [name for name, p in found.parameters.items() if p.identified]
    if "stribeck_velocity" not in identified:
        return 0.0
    interval = found.parameters["stribeck_velocity"].ci95
    if interval is None or 0.5 * (interval[1] - interval[0]) > _WIDE * velocity:
        return 0.0
    steps = [0.0]
    for side in ("", "_positive", "_negative"):
        pair = [f"static_friction{side}", f"coulomb_friction{side}"]
        if not set(pair) <= set(identified):
            continue
        at = [identified.index(name) for name in pair]
        block = found.covariance[np.ix_(at, at)]
        std = float(np.sqrt(max(block[0, 0] + block[1, 1] - 2.0 * block[0, 1], 0.0)))
        step = found.value(pair[0]) - found.value(pair[1])
        widest = max(found.parameters[name].quantile for name in pair)
        if abs(step) > max(widest, t_quantile(np.inf)) * std:
            steps.append(step)
    return max(steps, key=abs)


def _without_step(plain: Regression, note: str) -> Regression:
    """Return rows with columns of zeros for what the log does not show, and why."""
    names = [*(f"static_friction{side}" for side in _sides(plain)), "stribeck_velocity"]
    return replace(
        plain,
        names=(*plain.names, *names),
        regressors=np.pad(plain.regressors, ((0, 0), (0, len(names)))),
        regressor_noise=np.pad(plain.regressor_noise, (0, len(names))),
        notes=(*plain.notes, note),
        shifts=None if plain.shifts is None else np.pad(plain.shifts, ((0, 0), (0, len(names)))),
    )
