"""Friction of bristles whose strength falls with speed: the model of Lund and Grenoble."""

from dataclasses import dataclass

from stickslip.friction.bristles import BristleFriction
from stickslip.friction.law import Bristles
from stickslip.friction.stribeck import StribeckFriction
from stickslip.records import quantity_field

__all__ = ["LuGreFriction"]


@dataclass(frozen=True, kw_only=True)
class LuGreFriction(BristleFriction):
    """Bristles that bend, slip and damp.

    With the mean deflection z of the bristles (Canudas de Wit, Olsson, Astrom and Lischinsky 1995):
    ``z' = v - sigma_0 |v|/G(v) z`` and the friction force is ``sigma_0 z + sigma_1 z' + c v``, with
    G(v) the Stribeck curve without its viscous part. In steady motion it is the Stribeck curve
    itself. The force at which it breaks away falls as the effort rises faster.

    A known flaw: under an effort that vibrates below the breakaway force it drifts for ever
    (Dupont, Hayward, Armstrong and Altpeter 2002); `ElastoPlasticFriction` does not.

    Attributes
    ----------
    sliding
        Friction of steady motion.
    bristle_stiffness
        sigma_0 [N/m or N m/rad].
    bristle_damping
        sigma_1 [N s/m or N m s/rad].

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

    sliding: StribeckFriction
    bristle_damping: float = quantity_field("viscous_friction")

    @property
    def bristles(self) -> Bristles:
        """The bristles of the contact."""
        return Bristles(stiffness=self.bristle_stiffness, damping=self.bristle_damping)

    @property
    def passive(self) -> bool:
        """Whether the friction can give back no energy that it has not stored.

        That is so if and only if ``c f_c >= sigma_1 (f_s - f_c)`` in both directions (Barabanov and
        Ortega 2000). Without it, the bristles' damping acts on a strength that falls with speed.
        """
        law = self.sliding
        return all(
            c * fc >= self.bristle_damping * (fs - fc)
            for c, fc, fs in (
                (
                    law.viscous_friction_positive,
                    law.coulomb_friction_positive,
                    law.static_friction_positive,
                ),
                (
                    law.viscous_friction_negative,
                    law.coulomb_friction_negative,
                    law.static_friction_negative,
                ),
            )
        )
