"""Which friction law a plant has, as a parameter of its type."""

from typing import Any

from typing_extensions import TypeVar

from stickslip.friction import CoulombViscousFriction, FrictionLaw
from stickslip.records import InputError

__all__ = ["Law_co", "check_affine"]

Law_co = TypeVar("Law_co", bound=FrictionLaw, default=CoulombViscousFriction, covariant=True)
"""``SingleMass`` alone means one with `CoulombViscousFriction`, which is all that plans and
controllers know; ``SingleMass[FrictionLaw]`` has any law, which a simulator knows."""


def check_affine(plant: Any) -> None:
    """Refuse a plant whose friction is not affine in the velocity, where only that will do.

    Parameters
    ----------
    plant
        A `stickslip.plants.SingleMass` or `stickslip.plants.FlexibleArm`.

    Raises
    ------
    InputError
        If its friction is not a `CoulombViscousFriction`.
    """
    if not isinstance(plant.friction, CoulombViscousFriction):
        raise InputError(
            f"the plant's friction is a {type(plant.friction).__name__}, it must be a "
            "CoulombViscousFriction here",
            remedy="give one that comes near it; simulate the plant as it is",
        )
