"""Mechanical plants with friction."""

from stickslip.friction import FrictionLaw
from stickslip.plants.models import FlexibleArm, SingleMass, check_affine

__all__ = ["FlexibleArm", "Plant", "SingleMass", "check_affine"]

Plant = SingleMass[FrictionLaw] | FlexibleArm[FrictionLaw]
"""A plant with any friction law."""
