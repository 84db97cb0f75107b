"""The friction law that the values of an estimate describe."""

from collections.abc import Mapping

from stickslip.friction import CoulombViscousFriction

__all__ = ["identified_law"]


def identified_law(values: Mapping[str, float]) -> CoulombViscousFriction:
    """Return the law that can be simulated and is nearest to some estimated values.

    A negative friction counts as none, and static friction is at least Coulomb friction, also where
    it was not estimated.

    Parameters
    ----------
    values
        By parameter name [SI], for both directions or for each; 0 for what is missing.
    """

    def side(term: str, which: str) -> float:
        return max(values.get(f"{term}_{which}", values.get(term, 0.0)), 0.0)

    ahead, back = side("coulomb_friction", "positive"), side("coulomb_friction", "negative")
    return CoulombViscousFriction(
        coulomb_friction_positive=ahead,
        coulomb_friction_negative=back,
        static_friction_positive=max(side("static_friction", "positive"), ahead),
        static_friction_negative=max(side("static_friction", "negative"), back),
        viscous_friction_positive=side("viscous_friction", "positive"),
        viscous_friction_negative=side("viscous_friction", "negative"),
        offset=values.get("offset", 0.0),
    )
