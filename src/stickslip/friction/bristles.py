"""Friction laws with bristles: the contact bends before it slips.

Steady motion is that of a law without bristles. In terms of the deflection z of the bristles the
laws of Dahl, of Lund and Grenoble (LuGre) and of Dupont et al. (elasto-plastic) are one equation.
"""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from stickslip.friction.coulomb_viscous import CoulombViscousFriction, check_magnitudes
from stickslip.friction.law import Bristles
from stickslip.friction.stribeck import StribeckFriction
from stickslip.records import InputError, quantity_field

Law = TypeVar("Law", bound="BristleFriction")


@dataclass(frozen=True, kw_only=True)
class BristleFriction:
    """A friction law whose contact bends before it slips."""

    sliding: CoulombViscousFriction | StribeckFriction  #: Friction of steady motion.
    #: Rest stiffness sigma_0 [N/m or N m/rad].
    bristle_stiffness: float = quantity_field("stiffness")

    def __post_init__(self) -> None:
        check_magnitudes(self, positive=("bristle_stiffness",))
        for side in ("positive", "negative"):
            if not getattr(self.sliding, f"coulomb_friction_{side}") > 0:
                raise InputError(
                    "no_coulomb_under_bristles", name=f"coulomb_friction_{side}", unit="N or N m"
                )

    @property
    def affine(self) -> bool:
        """Whether friction is affine in the velocity of each direction (it is not)."""
        return False

    @property
    def bristles(self) -> Bristles:
        """The bristles of the contact."""
        default = Bristles(stiffness=self.bristle_stiffness)
        return Bristles(
            stiffness=self.bristle_stiffness,
            damping=getattr(self, "bristle_damping", default.damping),
            exponent=getattr(self, "exponent", default.exponent),
            elastic_deflection=getattr(self, "elastic_deflection", default.elastic_deflection),
        )

    @property
    def offset(self) -> float:
        """Constant effort lost whatever the motion [N or N m]."""
        return self.sliding.offset

    def breakaway(self) -> tuple[float, float]:
        """Return the magnitudes of a slowly rising effort that free a resting mass."""
        return self.sliding.breakaway()

    def friction(self, velocity: ArrayLike) -> Float[np.ndarray, "..."]:
        """Return the steady friction force [N or N m] at velocities [m/s or rad/s]; 0 at rest."""
        return self.sliding.friction(velocity)

    def mirrored(self: Law) -> Law:
        """Return the law of the same axis with its direction counted the other way."""
        return replace(self, sliding=self.sliding.mirrored())


@dataclass(frozen=True, kw_only=True)
class DahlFriction(BristleFriction):
    """Solid friction that depends on the travel alone, with viscous friction beside it.

    The force F of the solid follows the travel x as a stress follows a strain:
    ``dF/dx = sigma_0 |1 - F sgn(v)/f_c|^i sgn(1 - F sgn(v)/f_c)`` (Dahl 1968); in terms of the
    deflection z of bristles with F = sigma_0 z,
    ``z' = v |1 - sigma_0 z sgn(v)/f_c|^i sgn(1 - sigma_0 z sgn(v)/f_c)``. It never exceeds the
    Coulomb friction, so that there is no static peak, and it does not depend on the speed.

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

    #: Friction of steady motion; its static friction must be its Coulomb friction.
    sliding: CoulombViscousFriction
    #: Shape i of the curve [-], at least 1 (a ductile solid). Below 1 the force reaches its limit
    #: with a kink, within a finite travel.
    exponent: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        for side in ("positive", "negative"):
            static = getattr(self.sliding, f"static_friction_{side}")
            coulomb = getattr(self.sliding, f"coulomb_friction_{side}")
            if static != coulomb:
                raise InputError(
                    "dahl_with_peak",
                    name=f"static_friction_{side}",
                    value=static,
                    coulomb=coulomb,
                    unit="N or N m",
                )
        if not 1.0 <= self.exponent < np.inf:
            raise InputError(
                "out_of_range",
                name="exponent",
                value=self.exponent,
                least=1,
                most="any finite number",
                unit="",
            )


@dataclass(frozen=True, kw_only=True)
class LuGreFriction(BristleFriction):
    """Bristles that bend, slip and damp: the model of Lund and Grenoble.

    With the mean deflection z of the bristles (Canudas de Wit, Olsson, Astrom and Lischinsky 1995):
    ``z' = v - sigma_0 |v|/G(v) z`` and the friction force is ``sigma_0 z + sigma_1 z' + c v``, with
    G(v) the Stribeck curve without its viscous part. In steady motion it is the Stribeck curve
    itself. The force at which it breaks away falls as the effort rises faster.

    A known flaw: under an effort that vibrates below the breakaway force it drifts for ever
    (Dupont, Hayward, Armstrong and Altpeter 2002); `ElastoPlasticFriction` does not.

    Raises
    ------
    InputError
        If a Coulomb friction or the stiffness is not positive, or the damping is negative.

    Examples
    --------
    >>> law = LuGreFriction(bristle_stiffness=1e5, bristle_damping=316.0,
    ...     sliding=StribeckFriction.symmetric(coulomb_friction=1.0, static_friction=1.5,
    ...         viscous_friction=0.4, stribeck_velocity=0.001))
    >>> law.breakaway()
    (1.5, 1.5)
    """

    sliding: StribeckFriction  #: Friction of steady motion.
    #: Damping sigma_1 [N s/m or N m s/rad].
    bristle_damping: float = quantity_field("viscous_friction")

    @property
    def passive(self) -> bool:
        """Whether the friction can give back no energy that it has not stored.

        That is so if and only if ``c f_c >= sigma_1 (f_s - f_c)`` in both directions (Barabanov and
        Ortega 2000). Without it, the bristles' damping acts on a strength that falls with speed.
        """
        return all(
            law.viscous_friction_positive * law.coulomb_friction_positive
            >= self.bristle_damping * (law.static_friction_positive - law.coulomb_friction_positive)
            for law in (self.sliding, self.sliding.mirrored())
        )


@dataclass(frozen=True, kw_only=True)
class ElastoPlasticFriction(BristleFriction):
    """Bristles that slip only once they are bent beyond an elastic deflection.

    With the deflection z of the bristles (Dupont, Hayward, Armstrong and Altpeter 2002):
    ``z' = v (1 - alpha(z, v) sgn(v) z/z_ss(v))`` and the friction force is
    ``sigma_0 z + sigma_1 z' + c v``, where z_ss(v) = G(v)/sigma_0 and G(v) is the Stribeck curve
    without its viscous part. The bristles are elastic (alpha = 0) while ``|z| <= z_ba`` or the
    motion unbends them, plastic (alpha = 1) from ``|z| = z_ss`` on, and in between
    ``alpha = 1/2 sin(pi (|z| - (z_ss + z_ba)/2)/(z_ss - z_ba)) + 1/2``. With z_ba = 0 and alpha = 1
    throughout it would be `LuGreFriction`.

    Raises
    ------
    InputError
        If a Coulomb friction, the stiffness or the elastic deflection is not positive, the damping
        is negative, or the elastic deflection is too large.

    Examples
    --------
    >>> law = ElastoPlasticFriction(bristle_stiffness=1e5, bristle_damping=316.0,
    ...     elastic_deflection=7e-6, sliding=StribeckFriction.symmetric(coulomb_friction=1.0,
    ...         static_friction=1.5, viscous_friction=0.4, stribeck_velocity=0.001))
    >>> law.breakaway()
    (1.5, 1.5)
    """

    sliding: StribeckFriction  #: Friction of steady motion.
    #: Damping sigma_1 [N s/m or N m s/rad].
    bristle_damping: float = quantity_field("viscous_friction")
    #: z_ba, up to which nothing slips [m or rad]; less than Coulomb friction bends the bristles.
    elastic_deflection: float = quantity_field("position")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_magnitudes(self, positive=("elastic_deflection",))
        weaker = min(self.sliding.coulomb_friction_positive, self.sliding.coulomb_friction_negative)
        limit = weaker / self.bristle_stiffness
        if self.elastic_deflection >= limit:
            raise InputError(
                "bristles_bend_less",
                name="elastic_deflection",
                value=self.elastic_deflection,
                limit=limit,
                unit="m or rad",
            )
