"""Friction as a spring that gives way: the solid friction of Dahl."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from stickslip.friction.coulomb_viscous import CoulombViscousFriction
from stickslip.friction.directional import check_magnitudes, check_sliding
from stickslip.records import InputError, quantity_field

__all__ = ["DahlFriction"]


@dataclass(frozen=True, kw_only=True)
class DahlFriction:
    """Solid friction that depends on the way alone, with viscous friction beside it.

    The force F of the solid follows the way x as a stress follows a strain:
    ``dF/dx = sigma_0 |1 - F sgn(v)/f_c|^i sgn(1 - F sgn(v)/f_c)`` (Dahl 1968); in terms of the
    deflection z of bristles with F = sigma_0 z,
    ``z' = v |1 - sigma_0 z sgn(v)/f_c|^i sgn(1 - sigma_0 z sgn(v)/f_c)``. It never exceeds the
    Coulomb friction, so that there is no static peak, and it does not depend on how fast the way is
    gone.

    Attributes
    ----------
    sliding
        Friction of steady motion; its static friction must be its Coulomb friction.
    bristle_stiffness
        Rest stiffness sigma_0 [N/m or N m/rad].
    exponent
        Shape i of the curve [-], at least 1 (a ductile solid). Below 1 the force reaches its limit
        with a kink, in a finite way.

    Raises
    ------
    InputError
        If a static friction is not the Coulomb friction, a Coulomb friction or the stiffness is not
        positive, or the exponent is below 1.

    Examples
    --------
    >>> law = DahlFriction(bristle_stiffness=1e5, sliding=CoulombViscousFriction.symmetric(
    ...     coulomb_friction=1.0, viscous_friction=0.4))
    >>> law.breakaway()
    (1.0, 1.0)
    """

    sliding: CoulombViscousFriction
    bristle_stiffness: float = quantity_field("stiffness")
    exponent: float = 1.0

    def __post_init__(self) -> None:
        check_magnitudes(self, positive=("bristle_stiffness",))
        check_sliding(self.sliding)
        for side in ("positive", "negative"):
            static = getattr(self.sliding, f"static_friction_{side}")
            coulomb = getattr(self.sliding, f"coulomb_friction_{side}")
            if static != coulomb:
                raise InputError(
                    f"static_friction_{side} is {static:g} N or N m, but the friction of Dahl has "
                    f"no peak above its Coulomb friction, {coulomb:g} N or N m",
                    remedy="leave the static friction out, or take LuGreFriction",
                )
        if not 1.0 <= self.exponent < np.inf:
            raise InputError(
                f"the exponent is {self.exponent:g}, it must be at least 1 and finite",
                remedy="leave it at 1",
            )

    @property
    def offset(self) -> float:
        """Constant effort lost whatever the motion [N or N m]."""
        return self.sliding.offset

    def breakaway(self) -> tuple[float, float]:
        """Return the magnitudes of effort beyond which a mass goes on, (positive, negative)."""
        return self.sliding.breakaway()

    def friction(self, velocity: ArrayLike) -> Float[np.ndarray, "..."]:
        """Return the friction force of steady motion [N or N m]; 0 where the velocity is 0.

        Parameters
        ----------
        velocity
            Velocities [m/s or rad/s], any shape.
        """
        return self.sliding.friction(velocity)

    def mirrored(self) -> "DahlFriction":
        """Return the law of the same axis with its direction counted the other way."""
        return replace(self, sliding=self.sliding.mirrored())
