"""Friction laws and their linear terms."""

from stickslip.friction.bristles import DahlFriction, ElastoPlasticFriction, LuGreFriction
from stickslip.friction.coulomb_viscous import CoulombViscousFriction
from stickslip.friction.law import FrictionLaw
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
