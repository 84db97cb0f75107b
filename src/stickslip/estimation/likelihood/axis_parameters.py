"""From the parameters that a fit seeks to a plant, and back from its sensitivities."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, Plant, SingleMass
from stickslip.records import PARAMETER_NAMES, AxisKind, InputError

__all__ = ["AxisParameters", "load_name", "mass_name"]

_SIDES = ("_positive", "_negative")
_LEAST_SHARE = 0.2  # of a mass or stiffness that one step leaves of it


def mass_name(kind: AxisKind) -> str:
    """Return what the driven mass is called."""
    return "mass" if kind == "linear" else "inertia"


def load_name(kind: AxisKind) -> str:
    """Return what the second mass of an arm is called."""
    return "load_mass" if kind == "linear" else "load_inertia"


@dataclass(frozen=True, kw_only=True)
class AxisParameters:
    """Which parameters of an axis are sought, and the values of those that are known.

    A friction parameter without a side holds for both. Static friction that is neither sought nor
    known is the Coulomb friction of its direction.

    Attributes
    ----------
    kind
        ``"linear"`` or ``"rotary"``.
    names
        Of what is sought, such as ``("inertia", "viscous_friction", "coulomb_friction")``.
    known
        Values of the others by name [SI]; an offset or viscous friction not named is 0.
    flexible
        Whether the axis is a flexible arm.
    """

    kind: AxisKind
    names: tuple[str, ...]
    known: Mapping[str, float]
    flexible: bool

    def __post_init__(self) -> None:
        object.__setattr__(self, "known", MappingProxyType(dict(self.known)))
        foreign = [name for name in (*self.names, *self.known) if name not in self._possible]
        if foreign:
            raise InputError(
                f"{foreign[0]!r} is no parameter of this axis",
                remedy=f"use some of {', '.join(self._possible)}",
            )
        for name in self._structure:
            if name not in self.names and name not in self.known:
                raise InputError(
                    f"the {name} of the axis is neither sought nor known",
                    remedy=f"give the {name}, or let it be estimated",
                )

    @property
    def _structure(self) -> tuple[str, ...]:
        load = (load_name(self.kind), "stiffness") if self.flexible else ()
        return (mass_name(self.kind), *load)

    @property
    def _possible(self) -> tuple[str, ...]:
        masses = ("mass", "inertia", "load_mass", "load_inertia", "stiffness", "stribeck_velocity")
        return (*self._structure, *(name for name in PARAMETER_NAMES if name not in masses))

    @cached_property
    def _sources(self) -> dict[str, str | None]:
        """The name, sought or known, that the value of each parameter of a plant comes from."""
        masses = ("mass", "mass_1", "mass_2")
        return {name: self._source(name) for name in (*masses, *PARAMETER_NAMES, *self._possible)}

    def _source(self, name: str) -> str | None:
        if name in ("mass", "mass_1"):
            name = mass_name(self.kind)
        elif name == "mass_2":
            name = load_name(self.kind)
        for side in _SIDES:
            both = name.removesuffix(side)
            for candidate in (name, both):
                if candidate in self.names or candidate in self.known:
                    return candidate
        if name.startswith("static_friction"):
            return self._source(name.replace("static", "coulomb"))
        return None

    def value(self, name: str, values: Float[np.ndarray, " p"]) -> float:
        """Return the value [SI] of a plant's parameter for values of what is sought [SI]."""
        source = self._sources[name]
        if source is None:
            return 0.0
        if source in self.names:
            return float(values[self.names.index(source)])
        return self.known[source]

    def plant(self, values: Float[np.ndarray, " p"]) -> Plant:
        """Return the plant for values of what is sought [SI], in the order of the names."""

        def sides(name: str) -> list[float]:
            return [self.value(name + side, values) for side in _SIDES]

        coulomb, viscous = sides("coulomb_friction"), sides("viscous_friction")
        static = [max(pair) for pair in zip(sides("static_friction"), coulomb, strict=True)]
        law = CoulombViscousFriction(
            coulomb_friction_positive=coulomb[0],
            coulomb_friction_negative=coulomb[1],
            static_friction_positive=static[0],
            static_friction_negative=static[1],
            viscous_friction_positive=viscous[0],
            viscous_friction_negative=viscous[1],
            offset=self.value("offset", values),
        )
        if not self.flexible:
            return SingleMass(mass=self.value("mass", values), friction=law, kind=self.kind)
        return FlexibleArm(
            mass_1=self.value("mass_1", values),
            mass_2=self.value("mass_2", values),
            stiffness=self.value("stiffness", values),
            friction=law,
            kind=self.kind,
        )

    def chain(self, plant_names: Sequence[str]) -> Float[np.ndarray, "m p"]:
        """Return the derivative of a plant's parameters by those sought: zeros and ones."""
        chain = np.zeros((len(plant_names), len(self.names)))
        for i, name in enumerate(plant_names):
            source = self._source(name)
            if source in self.names:
                chain[i, self.names.index(source)] = 1.0
        return chain

    def bounded(
        self, values: Float[np.ndarray, " p"], before: Float[np.ndarray, " p"]
    ) -> Float[np.ndarray, " p"]:
        """Return values as near as a plant can have them: masses stay positive, friction >= 0."""
        kept = values.copy()
        for k, name in enumerate(self.names):
            if name in self._structure:
                kept[k] = max(kept[k], _LEAST_SHARE * before[k])
            elif name != "offset":
                kept[k] = max(kept[k], 0.0)
        for k, name in enumerate(self.names):
            if name.startswith("static"):
                sides = [name] if name.endswith(_SIDES) else [name + side for side in _SIDES]
                least = [self.value(s.replace("static", "coulomb"), kept) for s in sides]
                kept[k] = max(kept[k], *least)
        return kept
