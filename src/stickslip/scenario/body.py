"""Masses, spring and friction, as an axis has them and as a controller guesses them."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import model_validator

from stickslip.friction import CoulombViscousFriction
from stickslip.records import AxisKind, InputError, non_negative, positive, unit_of
from stickslip.scenario.table import Key, Table, kind_in

__all__ = ["DIRECTIONAL", "Body", "coulomb_viscous"]

DIRECTIONAL = ("coulomb_friction", "viscous_friction", "static_friction")
"""Quantities that are given for both directions at once, or for each."""

_SIDES = ("positive", "negative")


def _friction(name: str, side: str = "") -> Key:
    words = name.replace("_", " ").replace("coulomb", "Coulomb")
    return Key(f"{words}, {side} direction" if side else words, name, non_negative)


class Body(Table):
    """Masses, spring and friction, all optional."""

    mass: Annotated[
        float | None, Key("moving mass; of a flexible arm, mass 1", "mass", positive)
    ] = None
    inertia: Annotated[float | None, Key("the same of a rotary axis", "inertia", positive)] = None
    load_mass: Annotated[float | None, Key("mass 2 of a flexible arm", "mass", positive)] = None
    load_inertia: Annotated[float | None, Key("the same of a rotary axis", "inertia", positive)] = (
        None
    )
    stiffness: Annotated[float | None, Key("spring of a flexible arm", "stiffness", positive)] = (
        None
    )
    coulomb_friction: Annotated[float | None, _friction("coulomb_friction")] = None
    coulomb_friction_positive: Annotated[
        float | None, _friction("coulomb_friction", "positive")
    ] = None
    coulomb_friction_negative: Annotated[
        float | None, _friction("coulomb_friction", "negative")
    ] = None
    viscous_friction: Annotated[float | None, _friction("viscous_friction")] = None
    viscous_friction_positive: Annotated[
        float | None, _friction("viscous_friction", "positive")
    ] = None
    viscous_friction_negative: Annotated[
        float | None, _friction("viscous_friction", "negative")
    ] = None
    static_friction: Annotated[float | None, _friction("static_friction")] = None
    static_friction_positive: Annotated[float | None, _friction("static_friction", "positive")] = (
        None
    )
    static_friction_negative: Annotated[float | None, _friction("static_friction", "negative")] = (
        None
    )
    offset: Annotated[float | None, Key("constant effort lost, as by gravity", "offset")] = None

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
    """Return the law of a friction that is given for both directions or for each.

    Parameters
    ----------
    pairs
        Coulomb, viscous and static friction by name, in the positive and in the negative direction
        [N or N m, N s/m or N m s/rad]; static friction defaults to Coulomb friction.
    offset
        Constant effort lost [N or N m].
    kind
        Of the axis.

    Raises
    ------
    InputError
        If a value is negative, or a static friction is below the Coulomb friction. What is alike in
        both directions is called by its one name.
    """
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
