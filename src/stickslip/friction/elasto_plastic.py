"""Bristles that are truly elastic up to a limit: the elasto-plastic friction of Dupont et al."""

from dataclasses import dataclass

from stickslip.friction.bristles import BristleFriction
from stickslip.friction.directional import check_magnitudes
from stickslip.friction.law import Bristles
from stickslip.friction.stribeck import StribeckFriction
from stickslip.records import InputError, quantity_field

__all__ = ["ElastoPlasticFriction"]


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

    Attributes
    ----------
    sliding
        Friction of steady motion.
    bristle_stiffness
        sigma_0 [N/m or N m/rad].
    bristle_damping
        sigma_1 [N s/m or N m s/rad].
    elastic_deflection
        z_ba, up to which nothing slips [m or rad]; less than the Coulomb friction bends the
        bristles.

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

    sliding: StribeckFriction
    bristle_damping: float = quantity_field("viscous_friction")
    elastic_deflection: float = quantity_field("position")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_magnitudes(self, positive=("elastic_deflection",))
        weaker = min(self.sliding.coulomb_friction_positive, self.sliding.coulomb_friction_negative)
        limit = weaker / self.bristle_stiffness
        if self.elastic_deflection >= limit:
            raise InputError(
                f"elastic_deflection is {self.elastic_deflection:g} m or rad, it must be below "
                f"{limit:g} m or rad, by which the Coulomb friction bends the bristles",
                remedy="give less, such as two thirds of that",
            )

    @property
    def bristles(self) -> Bristles:
        """The bristles of the contact."""
        return Bristles(
            stiffness=self.bristle_stiffness,
            damping=self.bristle_damping,
            elastic_deflection=self.elastic_deflection,
        )
