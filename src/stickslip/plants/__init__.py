"""Mechanical plants with friction."""

from stickslip.friction import FrictionLaw
from stickslip.plants.flexible_arm import FlexibleArm
from stickslip.plants.friction_law import check_affine
from stickslip.plants.single_mass import SingleMass

__all__ = ["FlexibleArm", "Plant", "SingleMass", "check_affine"]

Plant = SingleMass[FrictionLaw] | FlexibleArm[FrictionLaw]
"""A plant with any friction law."""
