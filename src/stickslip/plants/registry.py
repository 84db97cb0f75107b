"""The protocol and the registry of plants. ``docs/contributing.md`` has the steps to add one."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar, Protocol

from stickslip.friction import FrictionLaw
from stickslip.plants.models import FlexibleArm, SingleMass
from stickslip.records import AxisKind


class PlantModel(Protocol):
    """A plant: a frozen record of its parameters and its friction law."""

    flexible: ClassVar[bool]  # whether it has a load on a spring
    parameter_names: ClassVar[tuple[str, ...]]  # masses and stiffness, the driven mass first
    state_names: ClassVar[tuple[str, ...]]

    @property
    def kind(self) -> AxisKind:
        """``"linear"`` or ``"rotary"``."""
        ...

    @property
    def friction(self) -> FrictionLaw:
        """The friction law of the driven mass."""
        ...


PLANTS: Mapping[str, type[PlantModel]] = MappingProxyType(
    {"single-mass": SingleMass, "flexible-arm": FlexibleArm}
)
"""Every plant by its name."""
