"""Mechanical plants with friction."""

from stickslip.plants.flexible_arm import FlexibleArm
from stickslip.plants.single_mass import SingleMass

__all__ = ["FlexibleArm", "Plant", "SingleMass"]

Plant = SingleMass | FlexibleArm
