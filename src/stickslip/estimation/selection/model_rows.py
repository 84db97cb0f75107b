"""A selected model as a regression, with the shapes of its terms among the parameters."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.intervals import robust_uncertainty
from stickslip.estimation.fit.rows import Regression, least_squares, summarise_motion
from stickslip.estimation.prepare import PreparedLog
from stickslip.estimation.selection.motion import SlipMotion, SlipMotions
from stickslip.estimation.selection.search import Model
from stickslip.estimation.selection.terms import DELAY, Column

__all__ = ["ModelRows", "model_rows"]

_STEP = 1e-3  # relative, of a shape's value for its derivative


@dataclass(frozen=True, kw_only=True)
class ModelRows:
    """Named columns and a target.

    Attributes
    ----------
    names
        Parameter of each column.
    columns
        Shape (n, p) [SI].
    target
        Shape (n,) [N or N m].
    """

    names: tuple[str, ...]
    columns: Float[np.ndarray, "n p"]
    target: Float[np.ndarray, " n"]

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
        found = robust_uncertainty(left, to_values, self.target - self.columns @ values)
        return values, np.sqrt(np.diag(found.covariance))

    def regression(
        self,
        log: PreparedLog,
        motions: SlipMotions,
        model: Model,
        *,
        shifts: Float[np.ndarray, "k p"] | None,
        notes: Sequence[str],
    ) -> Regression:
        """Return the rows with what is known about their noise.

        Parameters
        ----------
        log, motions
            As prepared.
        model
            Of these rows.
        shifts
            By which the parameters may be off beyond their sampling error [SI]; None for none.
        notes
            For the user.
        """
        weight = model.rows.weight
        noise = np.zeros(len(self.names))
        speed_noise = motions.position_noise * float(np.linalg.norm(weight.first()))
        for k, name in enumerate(self.names):
            if name in {"mass", "inertia"}:
                noise[k] = motions.position_noise * float(np.linalg.norm(weight.second()))
            elif name.startswith("viscous_friction"):
                noise[k] = speed_noise
        return Regression(
            kind=log.log.kind,
            names=self.names,
            time=model.rows.time,
            target=self.target,
            regressors=self.columns,
            regressor_noise=noise,
            quantity="effort",
            motion=summarise_motion(
                [m.position for m in motions.stretches],
                [m.velocity for m in motions.stretches],
                log.sampling_time,
                (log.position_noise, speed_noise),
            ),
            samples=len(log.log),
            notes=tuple(notes),
            effect=float(np.linalg.norm(model.rows.effort)),
            shifts=shifts,
            slow_residual=True,
            shapes_estimated=True,
        )


def model_rows(model: Model, inertia_name: str) -> ModelRows:
    """Return the rows of a model in the parameters that are reported.

    A direction of its own has its own Coulomb and viscous friction, with the offset in them. A
    Stribeck effect has static friction f_s besides Coulomb friction f_c:
    ``(1 - g) f_c + g f_s`` with ``g = exp(-(v / v_s)^2)``. What enters a column nonlinearly (the
    delay, v_s) gets a column of its own, the derivative at the estimate.

    Parameters
    ----------
    model
        As selected.
    inertia_name
        ``"mass"`` or ``"inertia"``.
    """
    rows = model.rows
    velocity, sign = rows.velocity, rows.direction
    ways = {"": np.ones(rows.size)}
    if "direction" in model.names:
        ways = {"_positive": (sign > 0).astype(float), "_negative": (sign < 0).astype(float)}
    named: dict[str, Float[np.ndarray, " n"]] = {}
    if model.inertia is None:
        named[inertia_name] = rows.acceleration
    for way, on in ways.items() if model.viscous else ():
        named[f"viscous_friction{way}"] = velocity * on
    for way, on in ways.items():
        named[f"coulomb_friction{way}"] = sign * on
    if "direction" not in model.names and model.offset:
        named["offset"] = np.ones(rows.size)
    target = model.target()
    for term, shape in model.chosen:
        if term.name == "direction":
            continue
        own = model.term_columns(term, shape)
        if term.name == DELAY:
            T = rows.weight.sampling_time
            named["effort_delay"] = own[:, 0] / T
            target = target + rows.delay * own[:, 0]
        elif term.name == "stribeck":
            rise = own[:, 0] * sign  # g, positive
            excess = float(model.coefficients("stribeck")[0])
            for way, on in ways.items():
                named[f"coulomb_friction{way}"] = named[f"coulomb_friction{way}"] - sign * rise * on
            for way, on in ways.items():
                named[f"static_friction{way}"] = sign * rise * on
            width = shape.value

            named["stribeck_velocity"] = excess * rows.mean(_stribeck_slope(width))
            target = target + width * named["stribeck_velocity"]
        else:
            for k, name in enumerate(shape.names):
                named[name] = own[:, k]
    return ModelRows(
        names=tuple(named), columns=np.column_stack(list(named.values())), target=target
    )


def _stribeck_slope(width: float) -> Column:
    """Return the derivative of ``sign(v) exp(-(v / width)^2)`` with respect to the width."""

    def slope(motion: SlipMotion) -> Float[np.ndarray, " n"]:
        ratio = (motion.velocity / width) ** 2
        return motion.direction * np.exp(-ratio) * 2.0 * ratio / width

    return slope
