"""Sought and known parameters of an axis: the plant of their values, and the chain rule back."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, Plant, SingleMass
from stickslip.records import PARAMETER_NAMES, AxisKind, InputError, mass_name

SIDES = ("_positive", "_negative")
_MASSES = ("mass", "inertia", "load_mass", "load_inertia", "stiffness", "stribeck_velocity")
_LEAST_SHARE = 0.2  # of a mass or stiffness that one step leaves of it


def load_name(kind: AxisKind) -> str:
    """Return the name of the second mass of an arm."""
    return "load_mass" if kind == "linear" else "load_inertia"


def without_side(name: str) -> str:
    """Return the name of a friction parameter for both directions."""
    return name.removesuffix(SIDES[0]).removesuffix(SIDES[1])


def coulomb_of(name: str) -> str:
    """Return the name of the Coulomb friction that belongs to a static friction."""
    return name.replace("static", "coulomb")


@dataclass(frozen=True, kw_only=True)
class SoughtParameters:
    """Names of what is sought, in order, and values of what is known [SI].

    A friction parameter without a side holds for both.
    """

    names: tuple[str, ...]
    known: Mapping[str, float]

    def __post_init__(self) -> None:
        object.__setattr__(self, "known", MappingProxyType(dict(self.known)))

    def source(self, name: str) -> str | None:
        """Return the name, sought or known, that holds a parameter such as of one direction."""
        for candidate in (name, without_side(name)):
            if candidate in self.names or candidate in self.known:
                return candidate
        return None

    def value(self, name: str, values: Float[np.ndarray, " p"]) -> float:
        """Return a parameter [SI] for values of what is sought [SI]; 0 if it is not named."""
        source = self.source(name)
        if source is None:
            return 0.0
        return (
            float(values[self.names.index(source)]) if source in self.names else self.known[source]
        )

    def column(self, name: str) -> int | None:
        """Return the place of a parameter among those sought; None if it is not one of them."""
        source = self.source(name)
        return self.names.index(source) if source in self.names else None


@dataclass(frozen=True, kw_only=True)
class AxisParameters(SoughtParameters):
    """Sought and known parameters of a plant that can be simulated.

    Static friction that is neither sought nor known is the Coulomb friction of its direction.
    """

    kind: AxisKind
    flexible: bool

    def __post_init__(self) -> None:
        super().__post_init__()
        possible = (*self._structure, *(n for n in PARAMETER_NAMES if n not in _MASSES))
        foreign = [name for name in (*self.names, *self.known) if name not in possible]
        if foreign:
            raise InputError("not_a_choice", name="parameter", value=foreign[0], choices=possible)
        for name in self._structure:
            if name not in self.names and name not in self.known:
                raise InputError("neither_sought_nor_known", name=name)

    @property
    def _structure(self) -> tuple[str, ...]:
        """Names of masses and stiffness."""
        load = (load_name(self.kind), "stiffness") if self.flexible else ()
        return (mass_name(self.kind), *load)

    def source(self, name: str) -> str | None:
        """Return the name, sought or known, that holds a parameter of the plant."""
        if name in ("mass", "mass_1"):
            name = mass_name(self.kind)
        elif name == "mass_2":
            name = load_name(self.kind)
        found = super().source(name)
        if found is None and name.startswith("static_friction"):
            return super().source(coulomb_of(name))
        return found

    def plant(self, values: Float[np.ndarray, " p"]) -> Plant:
        """Return the plant for values of what is sought [SI]."""
        terms = {
            term + side: self.value(term + side, values)
            for term in ("coulomb_friction", "static_friction", "viscous_friction")
            for side in SIDES
        }
        for side in SIDES:
            static, coulomb = f"static_friction{side}", f"coulomb_friction{side}"
            terms[static] = max(terms[static], terms[coulomb])
        law = CoulombViscousFriction(**terms, offset=self.value("offset", values))
        structure = ("mass_1", "mass_2", "stiffness") if self.flexible else ("mass",)
        plant = FlexibleArm if self.flexible else SingleMass
        known = {name: self.value(name, values) for name in structure}
        return plant(**known, friction=law, kind=self.kind)

    def chain(self, plant_names: Sequence[str]) -> Float[np.ndarray, "m p"]:
        """Return the derivative of a plant's parameters by those sought: zeros and ones."""
        chain = np.zeros((len(plant_names), len(self.names)))
        for row, name in zip(chain, plant_names, strict=True):
            column = self.column(name)
            if column is not None:
                row[column] = 1.0
        return chain

    def bounded(
        self, values: Float[np.ndarray, " p"], before: Float[np.ndarray, " p"]
    ) -> Float[np.ndarray, " p"]:
        """Return the nearest values that a plant can have: masses > 0, friction >= 0."""
        kept = values.copy()
        for k, name in enumerate(self.names):
            if name in self._structure:
                kept[k] = max(kept[k], _LEAST_SHARE * before[k])
            elif name != "offset":
                kept[k] = max(kept[k], 0.0)
        for k, name in enumerate(self.names):
            if name.startswith("static"):
                sides = [name] if name.endswith(SIDES) else [name + side for side in SIDES]
                least = [self.value(coulomb_of(s), kept) for s in sides]
                kept[k] = max(kept[k], *least)
        return kept
