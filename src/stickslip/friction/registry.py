"""The registry of friction laws.

To add a law: write a frozen class that obeys `stickslip.friction.FrictionLaw`, add it here, give it
a table in `stickslip.scenario.axis` and an example in ``tests/friction/test_contract.py``.
"""

from collections.abc import Mapping
from types import MappingProxyType

from stickslip.friction.coulomb_viscous import CoulombViscousFriction
from stickslip.friction.dahl import DahlFriction
from stickslip.friction.elasto_plastic import ElastoPlasticFriction
from stickslip.friction.law import FrictionLaw
from stickslip.friction.lugre import LuGreFriction
from stickslip.friction.stribeck import StribeckFriction

__all__ = ["LAWS"]

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
