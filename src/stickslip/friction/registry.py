"""The registry of friction laws. ``docs/contributing.md`` has the steps to add one."""

from collections.abc import Mapping
from types import MappingProxyType

from stickslip.friction.bristles import DahlFriction, ElastoPlasticFriction, LuGreFriction
from stickslip.friction.coulomb_viscous import CoulombViscousFriction
from stickslip.friction.law import FrictionLaw
from stickslip.friction.stribeck import StribeckFriction

LAWS: Mapping[str, type[FrictionLaw]] = MappingProxyType(
    {
        "coulomb": CoulombViscousFriction,
        "stribeck": StribeckFriction,
        "dahl": DahlFriction,
        "lugre": LuGreFriction,
        "elasto-plastic": ElastoPlasticFriction,
    }
)
"""Every friction law by its name in scenarios."""
