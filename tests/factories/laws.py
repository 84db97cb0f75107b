"""Friction laws in few words."""

from collections.abc import Sequence

from stickslip.friction import CoulombViscousFriction


def uneven(
    *,
    coulomb: Sequence[float],
    static: Sequence[float],
    viscous: Sequence[float],
    offset: float = 0.0,
) -> CoulombViscousFriction:
    """Return friction whose values in the positive and the negative direction are given [SI]."""
    return CoulombViscousFriction(
        coulomb_friction_positive=coulomb[0],
        coulomb_friction_negative=coulomb[1],
        static_friction_positive=static[0],
        static_friction_negative=static[1],
        viscous_friction_positive=viscous[0],
        viscous_friction_negative=viscous[1],
        offset=offset,
    )
