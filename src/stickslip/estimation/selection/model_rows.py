"""A selected model as a regression, with the shapes of its terms among the parameters."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from stickslip.estimation.fit.intervals import robust_uncertainty
from stickslip.estimation.fit.rows import (
    MotionSummary,
    Regression,
    least_squares,
    summarise_motion,
)
from stickslip.estimation.prepare import PreparedLog
from stickslip.estimation.selection.model import Model, smallest_ratio
from stickslip.estimation.selection.search.tuning import SearchTuning
from stickslip.estimation.selection.terms import DELAY, DIRECTION
from stickslip.estimation.weak_form.motion import SlipMotion, SlipMotions
from stickslip.estimation.weak_form.rows import Column
from stickslip.estimation.weak_form.windows import Weight
from stickslip.records import quantity_name


@dataclass(frozen=True, kw_only=True)
class ModelRows:
    """Named columns and a target."""

    names: tuple[str, ...]  #: Parameter of each column.
    columns: Float[np.ndarray, "n p"]  #: Shape (n, p) [SI].
    target: Float[np.ndarray, " n"]  #: Shape (n,) [N or N m].
    #: Number of the log that each row is from [-], shape (n,); None for one log.
    log: Int[np.ndarray, " n"] | None = None

    def values(self) -> Float[np.ndarray, " p"]:
        """Return the least-squares parameters [SI]."""
        return least_squares(self.columns, self.target)

    def with_column(self, name: str, column: Float[np.ndarray, " n"]) -> "ModelRows":
        """Return the rows with one more column."""
        columns = np.column_stack([self.columns, column])
        return replace(self, names=(*self.names, name), columns=columns)

    def fitted(self) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
        """Return the least-squares parameters and their standard deviations [SI]."""
        norms = np.linalg.norm(self.columns, axis=0)
        left, singular, right = np.linalg.svd(self.columns / norms, full_matrices=False)
        to_values = (right.T / singular) / norms[:, None]
        values = to_values @ (left.T @ self.target)
        residual = self.target - self.columns @ values
        found = robust_uncertainty(left, to_values, residual, log=self.log)
        return values, np.sqrt(np.diag(found.covariance))

    def regression(
        self,
        log: PreparedLog,
        motions: SlipMotions,
        model: Model,
        *,
        shifts: Float[np.ndarray, "k p"] | None,
        law_shifts: Float[np.ndarray, "laws p"] | None,
        notes: Sequence[str],
    ) -> Regression:
        """Return the rows with what is known about their noise.

        ``shifts`` are deviations of the parameters beyond their sampling error [SI], ``law_shifts``
        their differences to those of other laws that explain the log as well [SI].
        """
        return Regression(
            kind=log.log.kind,
            names=self.names,
            time=model.rows.time,
            target=self.target,
            regressors=self.columns,
            regressor_noise=column_noise(self.names, motions, model.rows.weight),
            quantity="effort",
            motion=motion_summary(log, motions, model.rows.weight),
            samples=len(log.log),
            notes=tuple(notes),
            shifts=shifts,
            law_shifts=law_shifts,
            slow_residual=True,
            overlap=model.rows.weight.overlap(),
            simultaneous=any(score.selected for score in model.scores),
            effort=model.rows.own_effort,
        )


def motion_summary(log: PreparedLog, motions: SlipMotions, weight: Weight) -> MotionSummary:
    """Return how well the motion of a log excites the parameters.

    Velocities are smoothed over windows of the weight.
    """
    speed_noise = motions.noise_of(weight.first())
    return summarise_motion(
        [m.position for m in motions.stretches],
        [m.velocity for m in motions.stretches],
        log.sampling_time,
        (log.position_noise, speed_noise),
    )


def column_noise(
    names: Sequence[str], motions: SlipMotions, weight: Weight
) -> Float[np.ndarray, " p"]:
    """Return the standard deviation of the sensor noise in each column [SI]."""
    noise = np.zeros(len(names))
    for k, name in enumerate(names):
        if name in {"mass", "inertia"}:
            noise[k] = motions.noise_of(weight.second())
        elif name.startswith("viscous_friction"):
            noise[k] = motions.noise_of(weight.first())
        elif name == "elasticity":
            noise[k] = motions.noise_of(weight.fourth())
    return noise


def model_rows(model: Model, inertia_name: str, excess: float | None = None) -> ModelRows:
    """Return the rows of a model in the parameters that are reported.

    A direction of its own has its own Coulomb and viscous friction, with the offset in them. A
    Stribeck effect has static friction f_s besides Coulomb friction f_c:
    ``(1 - g) f_c + g f_s`` with ``g = exp(-(v / v_s)^2)``. A parameter that enters a column
    nonlinearly (the delay, v_s, the velocity of the friction of low speeds) gets a column of its
    own, the derivative at the estimate.

    ``excess`` is static over Coulomb friction, f_s - f_c, or the friction of low speeds [N or N m];
    None for that of the fit.
    """
    rows = model.rows
    velocity, sign = rows.velocity, rows.direction
    ways = {"": np.ones(rows.size)}
    if DIRECTION in model.names:
        ways = {"_positive": (sign > 0).astype(float), "_negative": (sign < 0).astype(float)}
    named: dict[str, Float[np.ndarray, " n"]] = {}
    if model.inertia is None:
        named[inertia_name] = rows.acceleration
    for way, on in ways.items() if model.viscous else ():
        named[f"viscous_friction{way}"] = velocity * on
    for way, on in ways.items():
        named[f"coulomb_friction{way}"] = sign * on
    if DIRECTION not in model.names and model.offset:
        named["offset"] = np.ones(rows.size)
    target = model.target()
    for term, shape in model.chosen:
        if term.name == DIRECTION:
            continue
        own = model.term_columns(term, shape)
        if term.name == DELAY:
            T = rows.weight.sampling_time
            named["effort_delay"] = own[:, 0] / T
            target = target + rows.delay * own[:, 0]
        elif term.name == "stribeck":
            rise = own[:, 0] * sign  # g, positive
            if excess is None:
                excess = float(model.coefficients("stribeck")[0])
            for way, on in ways.items():
                named[f"coulomb_friction{way}"] = named[f"coulomb_friction{way}"] - sign * rise * on
            for way, on in ways.items():
                named[f"static_friction{way}"] = sign * rise * on
            named["stribeck_velocity"] = excess * rows.mean(width_slope(shape.value))
            target = target + shape.value * named["stribeck_velocity"]
        elif term.name == "low speed":
            if excess is None:
                excess = float(model.coefficients("low speed")[0])
            named["low_speed_friction"] = own[:, 0]
            named["low_speed_velocity"] = excess * rows.mean(width_slope(shape.value))
            target = target + shape.value * named["low_speed_velocity"]
        else:
            for k, name in enumerate(shape.names):
                named[name] = own[:, k]
    return ModelRows(
        names=tuple(named), columns=np.column_stack(list(named.values())), target=target
    )


def with_shapes(found: ModelRows, model: Model, names: Sequence[str] | None = None) -> ModelRows:
    """Return the rows with the period of a ripple and the distance of presliding as parameters.

    Each gets a column, the derivative at the estimate.

    ``names`` are parameters to add if the model has them; None for those whose value is larger than
    three standard deviations and that the rows separate from the others.
    """
    for term, shape in model.chosen:
        if shape.slope is None:
            continue
        parameter, slope = shape.slope
        column = model.scaled(model.rows.mean(slope(model.coefficients(term.name))))
        larger = replace(
            found.with_column(parameter, column), target=found.target + shape.value * column
        )
        if names is None:
            values, stds = larger.fitted()
            known = smallest_ratio(larger.columns) > _LEAST_RATIO
            wanted = known and bool(values[-1] > _LEAST_DEVIATIONS * stds[-1])
        else:
            wanted = parameter in names
        found = larger if wanted else found
    return found


# Parameters that the status of an estimate depends on
_BASE = frozenset(
    {
        "mass",
        "inertia",
        "viscous_friction",
        "coulomb_friction",
        "offset",
        "two_thirds_friction",  # instead of viscous friction
    }
)
_LOW_SPEED_PARAMETERS = {
    "stribeck": ("static_friction", "stribeck_velocity"),
    "low speed": ("low_speed_friction", "low_speed_velocity"),
}


def nuisance(names: Sequence[str], model: Model, include: Sequence[str]) -> frozenset[str]:
    """Return the parameters of selected terms that may be unidentified in a usable result.

    ``include`` are terms whose parameters are requested.
    """
    requested = {
        name
        for term, shape in model.chosen
        if term.name in include
        for name in (
            *_LOW_SPEED_PARAMETERS.get(term.name, shape.names),
            *(() if shape.slope is None else shape.slope[:1]),
        )
    }
    return frozenset(n for n in names if quantity_name(n) not in _BASE | requested)


_LEAST_DEVIATIONS = 3.0
"""Shape over its standard deviation [-], below which the derivative at the estimate does not hold
over the interval."""

_LEAST_RATIO = SearchTuning.smallest_ratio  # as for a term


def width_slope(width: float) -> Column:
    """Return the derivative of ``sign(v) exp(-(v / width)^2)`` with respect to the width.

    The width is the velocity of a Stribeck effect, or of the friction of low speeds [m/s or rad/s].
    """

    def slope(motion: SlipMotion) -> Float[np.ndarray, " n"]:
        ratio = (motion.velocity / width) ** 2
        return motion.direction * np.exp(-ratio) * 2.0 * ratio / width

    return slope
