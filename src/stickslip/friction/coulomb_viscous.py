"""Coulomb, static and viscous friction with values of their own in each direction."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from stickslip.friction.directional import DirectionalFriction

__all__ = ["CoulombViscousFriction"]


@dataclass(frozen=True, kw_only=True)
class CoulombViscousFriction(DirectionalFriction):
    """Coulomb and viscous friction with stiction and a constant offset.

    While moving with velocity v > 0 the friction force is ``f_c+ + c+ v``, with v < 0 it is
    ``-(f_c- + c- |v|)`` (van de Wijdeven 2002 A Eq. 2.1, per direction). At rest it balances any
    force between ``-f_s-`` and ``f_s+`` (part B Eq. 1). The offset is subtracted from the effort:
    ``inertia * acceleration = effort - offset - friction(velocity)``.

    Attributes
    ----------
    coulomb_friction_positive, coulomb_friction_negative
        Coulomb friction while moving in either direction [N or N m], not negative.
    static_friction_positive, static_friction_negative
        Effort (less the offset) up to which a resting mass stays, towards either direction
        [N or N m]; at least the Coulomb friction.
    viscous_friction_positive, viscous_friction_negative
        Viscous friction in either direction [N s/m or N m s/rad], not negative.
    offset
        Constant effort lost whatever the motion [N or N m], any sign.

    Raises
    ------
    InputError
        If a value is not finite, a magnitude is negative, or a static friction is below the
        Coulomb friction of its direction.

    Examples
    --------
    >>> law = CoulombViscousFriction.symmetric(
    ...     coulomb_friction=100.0, viscous_friction=700.0, static_friction=130.0)
    >>> law.friction([-0.1, 0.0, 0.1]).tolist()
    [-170.0, 0.0, 170.0]
    """

    @classmethod
    def symmetric(
        cls,
        *,
        coulomb_friction: float,
        viscous_friction: float,
        static_friction: float | None = None,
        offset: float = 0.0,
    ) -> "CoulombViscousFriction":
        """Return the law with the same values in both directions.

        Parameters
        ----------
        coulomb_friction, viscous_friction
            [N or N m] and [N s/m or N m s/rad].
        static_friction
            [N or N m]; the Coulomb friction if None.
        offset
            Constant effort lost [N or N m].
        """
        static = coulomb_friction if static_friction is None else static_friction
        return cls(
            coulomb_friction_positive=coulomb_friction,
            coulomb_friction_negative=coulomb_friction,
            static_friction_positive=static,
            static_friction_negative=static,
            viscous_friction_positive=viscous_friction,
            viscous_friction_negative=viscous_friction,
            offset=offset,
        )

    @property
    def affine(self) -> bool:
        """Whether friction is affine in the velocity of each direction (it is)."""
        return True

    @property
    def effect(self) -> None:
        """None, as there is no Stribeck effect."""

    def friction(self, velocity: ArrayLike) -> Float[np.ndarray, "..."]:
        """Return the friction force while moving [N or N m]; 0 where the velocity is 0.

        Parameters
        ----------
        velocity
            Velocities [m/s or rad/s], any shape.
        """
        v = np.asarray(velocity, dtype=np.float64)
        forward = self.coulomb_friction_positive + self.viscous_friction_positive * v
        backward = -self.coulomb_friction_negative + self.viscous_friction_negative * v
        return np.where(v > 0, forward, np.where(v < 0, backward, 0.0))
