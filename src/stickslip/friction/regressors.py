"""Friction as a sum of known functions of the motion times unknown parameters."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.friction.stribeck import StribeckEffect
from stickslip.records import InputError

Values = Float[np.ndarray, " n"]


@dataclass(frozen=True, kw_only=True)
class FrictionTerms:
    """Which friction parameters are sought, and the regressors that belong to them.

    The law is ``friction = coulomb_friction * d + viscous_friction * v`` with the direction of
    motion d = -1, 0 or +1 (van de Wijdeven 2002 A Eq. 2.1), with values of its own in each
    direction if asked for, plus a constant offset. With a Stribeck effect e(v) it is
    ``(coulomb_friction (1 - e(v)) + static_friction e(v)) d + viscous_friction * v``. Every
    parameter enters linearly.

    Raises
    ------
    InputError
        If friction per direction and an offset are both asked for.

    Examples
    --------
    >>> FrictionTerms(per_direction=False, offset=True).names
    ('viscous_friction', 'coulomb_friction', 'offset')
    >>> FrictionTerms(per_direction=False, offset=False,
    ...     stribeck=(StribeckEffect(velocity=0.01),)).names
    ('viscous_friction', 'coulomb_friction', 'static_friction')
    """

    per_direction: bool  #: Whether the frictions differ between the directions.
    #: Whether a constant offset force is sought. Together with two Coulomb values it could not be
    #: separated from their difference.
    offset: bool
    #: How the step from static to Coulomb friction fades with speed, if static friction is sought;
    #: of several, each has a step of its own above Coulomb friction, named ``step_0`` and so on.
    stribeck: tuple[StribeckEffect, ...] = ()

    def __post_init__(self) -> None:
        if self.per_direction and self.offset:
            raise InputError("offset_and_directions")

    @classmethod
    def asked(
        cls,
        *,
        per_direction: bool,
        offset: bool | None,
        stribeck: StribeckEffect | tuple[StribeckEffect, ...] | None = None,
    ) -> "FrictionTerms":
        """Return the terms a user asks for; None takes an offset unless ``per_direction``."""
        several = stribeck if isinstance(stribeck, tuple) else (stribeck,)
        return cls(
            per_direction=per_direction,
            offset=not per_direction if offset is None else offset,
            stribeck=tuple(effect for effect in several if effect is not None),
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters in the order of the columns."""
        terms = ["viscous_friction", "coulomb_friction"]
        if len(self.stribeck) == 1:
            terms.append("static_friction")
        else:
            terms += [f"step_{k}" for k in range(len(self.stribeck))]
        if self.per_direction:
            return tuple(f"{term}_{side}" for term in terms for side in ("positive", "negative"))
        return (*terms, *(("offset",) if self.offset else ()))

    def force_columns(self, velocity: Values, direction: Values) -> Float[np.ndarray, "n p"]:
        """Return the regressor of the friction force (van de Wijdeven 2002 A Eq. 2.1).

        From velocities [m/s or rad/s] and directions (-1, 0 or +1).
        """
        left = [effect.left(velocity) for effect in self.stribeck]
        terms = [velocity, *(direction * share for share in self._shares(left))]
        return self._arranged(terms, direction, np.ones_like(velocity))

    def energy_columns(
        self,
        velocity_squared: Values,
        path: Values,
        displacement: Values,
        direction: Values,
        velocity: Float[np.ndarray, " n+1"],
    ) -> Float[np.ndarray, "n p"]:
        """Return the regressor of the energy dissipated a sample (van de Wijdeven 2002 A Eq. 4.3).

        Parameters
        ----------
        velocity_squared
            Integral of the squared velocity over each sample [m^2/s or rad^2/s].
        path, displacement
            Distance travelled in each sample, and change of position [m or rad].
        direction
            -1, 0 or +1 [-].
        velocity
            At the ends of the samples [m/s or rad/s]; for a Stribeck effect only.
        """
        left = [effect.mean_left(velocity[:-1], velocity[1:]) for effect in self.stribeck]
        terms = [velocity_squared, *(path * share for share in self._shares(left))]
        return self._arranged(terms, direction, displacement)

    def _shares(self, left: list[Values]) -> list[Values | float]:
        """Return what Coulomb friction and what goes with the Stribeck effects is multiplied by."""
        return [1.0 - left[0] if len(left) == 1 else 1.0, *left]

    def _arranged(
        self, terms: list[Values], direction: Values, offset: Values
    ) -> Float[np.ndarray, "n p"]:
        """Return the columns in the order of `names`."""
        if self.per_direction:
            ahead, back = direction > 0, direction < 0
            return np.column_stack([term * side for term in terms for side in (ahead, back)])
        return np.column_stack([*terms, *([offset] if self.offset else [])])
