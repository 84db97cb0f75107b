"""Coulomb and viscous friction as a sum of known functions times unknown parameters."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.records import InputError

__all__ = ["FrictionTerms"]


@dataclass(frozen=True, kw_only=True)
class FrictionTerms:
    """Which friction parameters are sought, and the regressors that belong to them.

    The law is ``friction = coulomb_friction * d + viscous_friction * v`` with the direction of
    motion d = -1, 0 or +1 (report part A Eq. 2.1), with values of its own in each direction if
    asked for, plus a constant offset. Every parameter enters linearly.

    Attributes
    ----------
    per_direction
        Whether Coulomb and viscous friction differ between the directions.
    offset
        Whether a constant offset force is sought. Together with two Coulomb values it could not be
        told apart from their difference.

    Raises
    ------
    InputError
        If both are asked for.

    Examples
    --------
    >>> FrictionTerms(per_direction=False, offset=True).names
    ('viscous_friction', 'coulomb_friction', 'offset')
    """

    per_direction: bool
    offset: bool

    def __post_init__(self) -> None:
        if self.per_direction and self.offset:
            raise InputError(
                "an offset and friction per direction are both asked for, but an offset is the "
                "same as half the difference of the two Coulomb values",
                remedy="ask for one of them",
            )

    @classmethod
    def asked(cls, *, per_direction: bool, offset: bool | None) -> "FrictionTerms":
        """Return the terms a user asks for; None takes an offset unless ``per_direction``."""
        return cls(
            per_direction=per_direction, offset=not per_direction if offset is None else offset
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters in the order of the columns."""
        if self.per_direction:
            return (
                "viscous_friction_positive",
                "viscous_friction_negative",
                "coulomb_friction_positive",
                "coulomb_friction_negative",
            )
        return ("viscous_friction", "coulomb_friction", *(("offset",) if self.offset else ()))

    def force_columns(
        self, velocity: Float[np.ndarray, " n"], direction: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, "n p"]:
        """Return the regressor of the friction force (report part A Eq. 2.1).

        Parameters
        ----------
        velocity
            [m/s or rad/s].
        direction
            -1, 0 or +1 [-].
        """
        if self.per_direction:
            ahead, back = direction > 0, direction < 0
            columns = [velocity * ahead, velocity * back, 1.0 * ahead, -1.0 * back]
        else:
            columns = [velocity, direction, *([np.ones_like(velocity)] if self.offset else [])]
        return np.column_stack(columns)

    def energy_columns(
        self,
        velocity_squared: Float[np.ndarray, " n"],
        path: Float[np.ndarray, " n"],
        displacement: Float[np.ndarray, " n"],
        direction: Float[np.ndarray, " n"],
    ) -> Float[np.ndarray, "n p"]:
        """Return the regressor of the energy dissipated in each sample (report part A Eq. 4.3).

        Parameters
        ----------
        velocity_squared
            Integral of the squared velocity over each sample [m^2/s or rad^2/s].
        path
            Way travelled in each sample, whatever the direction [m or rad].
        displacement
            Change of position in each sample [m or rad].
        direction
            -1, 0 or +1 [-].
        """
        if self.per_direction:
            ahead, back = direction > 0, direction < 0
            columns = [velocity_squared * ahead, velocity_squared * back, path * ahead, path * back]
        else:
            columns = [velocity_squared, path, *([displacement] if self.offset else [])]
        return np.column_stack(columns)
