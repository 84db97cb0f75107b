"""Friction as a spring that gives way: the solid friction of Dahl."""

from dataclasses import dataclass

import numpy as np

from stickslip.friction.bristles import BristleFriction
from stickslip.friction.coulomb_viscous import CoulombViscousFriction
from stickslip.friction.law import Bristles
from stickslip.records import InputError

__all__ = ["DahlFriction"]


@dataclass(frozen=True, kw_only=True)
class DahlFriction(BristleFriction):
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
    exponent: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
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
    def bristles(self) -> Bristles:
        """The bristles of the contact."""
        return Bristles(stiffness=self.bristle_stiffness, exponent=self.exponent)
