"""Which friction law a plant has, as a parameter of its type."""

from typing_extensions import TypeVar

from stickslip.friction import CoulombViscousFriction, FrictionLaw

__all__ = ["Law_co"]

Law_co = TypeVar("Law_co", bound=FrictionLaw, default=CoulombViscousFriction, covariant=True)
"""``SingleMass`` alone means one with `CoulombViscousFriction`, which is all that plans and
controllers know; ``SingleMass[FrictionLaw]`` has any law, which a simulator knows."""
