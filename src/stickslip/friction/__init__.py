"""Friction laws: one file each."""

from stickslip.friction.coulomb_viscous import CoulombViscousFriction
from stickslip.friction.law import FrictionLaw
from stickslip.friction.regressors import FrictionTerms

__all__ = ["CoulombViscousFriction", "FrictionLaw", "FrictionTerms"]
