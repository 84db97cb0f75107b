"""Friction laws: one file each."""

from stickslip.friction.coulomb_viscous import CoulombViscousFriction
from stickslip.friction.dahl import DahlFriction
from stickslip.friction.elasto_plastic import ElastoPlasticFriction
from stickslip.friction.law import FrictionLaw
from stickslip.friction.lugre import LuGreFriction
from stickslip.friction.regressors import FrictionTerms
from stickslip.friction.stribeck import StribeckEffect, StribeckFriction

__all__ = [
    "CoulombViscousFriction",
    "DahlFriction",
    "ElastoPlasticFriction",
    "FrictionLaw",
    "FrictionTerms",
    "LuGreFriction",
    "StribeckEffect",
    "StribeckFriction",
]
