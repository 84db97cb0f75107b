"""Masses, spring and friction, as an axis has them and as a controller guesses them."""

from collections.abc import Mapping
from typing import Any

from pydantic import model_validator

from stickslip.friction import CoulombViscousFriction
from stickslip.records import AxisKind, InputError, non_negative, positive, unit_of
from stickslip.scenario.table import Table, key, kind_in

__all__ = ["DIRECTIONAL", "Body", "coulomb_viscous"]

DIRECTIONAL = ("coulomb_friction", "viscous_friction", "static_friction")
"""Quantities that are given for both directions at once, or for each."""

_SIDES = ("positive", "negative")


def _friction(name: str, side: str = "") -> Any:
    words = name.replace("_", " ").replace("coulomb", "Coulomb")
    words += f", {side} direction" if side else ""
    return key(words, name, non_negative)


class Body(Table):
    """Masses, spring and friction, all optional."""

    mass: float | None = key("moving mass; of a flexible arm, mass 1", "mass", positive)
    inertia: float | None = key("the same of a rotary axis", "inertia", positive)
    load_mass: float | None = key("mass 2 of a flexible arm", "mass", positive)
    load_inertia: float | None = key("the same of a rotary axis", "inertia", positive)
    stiffness: float | None = key("spring of a flexible arm", "stiffness", positive)
    coulomb_friction: float | None = _friction("coulomb_friction")
    coulomb_friction_positive: float | None = _friction("coulomb_friction", "positive")
    coulomb_friction_negative: float | None = _friction("coulomb_friction", "negative")
    viscous_friction: float | None = _friction("viscous_friction")
    viscous_friction_positive: float | None = _friction("viscous_friction", "positive")
    viscous_friction_negative: float | None = _friction("viscous_friction", "negative")
    static_friction: float | None = _friction("static_friction")
    static_friction_positive: float | None = _friction("static_friction", "positive")
    static_friction_negative: float | None = _friction("static_friction", "negative")
    offset: float | None = key("constant effort lost, as by gravity", "offset")

    @model_validator(mode="after")
    def _check_alternatives(self, info: Any) -> "Body":
        kind = kind_in(info)
        name, other = ("mass", "inertia") if kind == "linear" else ("inertia", "mass")
        for of in ("", "load_"):
            if getattr(self, of + other) is not None:
                raise InputError(
                    f"{of}{other} is given for a {kind} axis",
                    remedy=f"give its {of}{name} [{unit_of(name, kind)}]",
                )
        for friction in DIRECTIONAL:
            given = [side for side in _SIDES if getattr(self, f"{friction}_{side}") is not None]
            if getattr(self, friction) is not None and given:
                raise InputError(
                    f"{friction} is given for both directions and for one of them apart",
                    remedy=f"keep {friction}, or {friction}_positive and {friction}_negative",
                )
            if len(given) == 1:
                (missing,) = set(_SIDES) - set(given)
                raise InputError(
                    f"{friction}_{given[0]} is given without {friction}_{missing}",
                    remedy=f"give both, or {friction} if it is the same in both directions",
                )
        return self

    @property
    def body(self) -> float | None:
        """Mass or inertia [kg or kg m^2]."""
        return self.inertia if self.mass is None else self.mass

    @property
    def load(self) -> float | None:
        """Mass or inertia of the load of a flexible arm [kg or kg m^2]."""
        return self.load_inertia if self.load_mass is None else self.load_mass

    def sides(self, name: str) -> tuple[float, float] | None:
        """Return a friction in the positive and in the negative direction."""
        both = getattr(self, name)
        if both is not None:
            return both, both
        forward = getattr(self, f"{name}_positive")
        return None if forward is None else (forward, getattr(self, f"{name}_negative"))


def coulomb_viscous(
    pairs: Mapping[str, tuple[float, float]], offset: float, kind: AxisKind
) -> CoulombViscousFriction:
    """Return the law of a friction that is given for both directions or for each."""
    coulomb, viscous = pairs["coulomb_friction"], pairs["viscous_friction"]
    static = pairs.get("static_friction", coulomb)
    unit = unit_of("effort", kind)
    for side, held, slowing in zip(_SIDES, static, coulomb, strict=True):
        for name, pair in pairs.items():
            own = name if pair[0] == pair[1] else f"{name}_{side}"
            non_negative(own, pair[side == "negative"], unit_of(name, kind))
        if held < slowing:
            own = "static_friction" if static[0] == static[1] else f"static_friction_{side}"
            direction = "" if coulomb[0] == coulomb[1] else " of that direction"
            raise InputError(
                f"{own} is {held:g} {unit}, below the Coulomb friction{direction}, {slowing:g} "
                f"{unit}",
                remedy="give a static friction of at least the Coulomb friction",
            )
    return CoulombViscousFriction(
        coulomb_friction_positive=coulomb[0],
        coulomb_friction_negative=coulomb[1],
        viscous_friction_positive=viscous[0],
        viscous_friction_negative=viscous[1],
        static_friction_positive=static[0],
        static_friction_negative=static[1],
        offset=offset,
    )
