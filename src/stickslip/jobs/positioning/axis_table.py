"""The table of a scenario that says what is simulated."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal, TypeVar

from stickslip.friction import (
    CoulombViscousFriction,
    DahlFriction,
    ElastoPlasticFriction,
    FrictionLaw,
    LuGreFriction,
    StribeckFriction,
)
from stickslip.friction.stribeck import StribeckShape
from stickslip.jobs.positioning.refusals import by_one_name, friction_law
from stickslip.jobs.positioning.tables import BodyTable
from stickslip.plants import FlexibleArm, Plant, SingleMass
from stickslip.records import (
    AxisKind,
    InputError,
    positive,
    prefixed,
    quantity_field,
    unit_of,
)

__all__ = ["LAWS", "AxisTable", "LawName"]

LawName = Literal["coulomb", "stribeck", "dahl", "lugre", "elasto-plastic"]

LAWS: Mapping[LawName, str] = {
    "coulomb": "Coulomb and viscous friction",
    "stribeck": "Stribeck friction",
    "dahl": "the friction of Dahl",
    "lugre": "LuGre friction",
    "elasto-plastic": "elasto-plastic friction",
}
"""Every friction law, in words."""

_STRIBECK = ("stribeck_velocity", "shape")
_USES: Mapping[LawName, tuple[str, ...]] = {
    "coulomb": (),
    "stribeck": _STRIBECK,
    "dahl": ("bristle_stiffness",),
    "lugre": (*_STRIBECK, "bristle_stiffness", "bristle_damping"),
    "elasto-plastic": (*_STRIBECK, "bristle_stiffness", "bristle_damping", "elastic_deflection"),
}
"""Keys of each law besides those of Coulomb and viscous friction."""

_QUANTITIES = {
    "stribeck_velocity": "stribeck_velocity",
    "bristle_stiffness": "stiffness",
    "bristle_damping": "viscous_friction",
    "elastic_deflection": "position",
}

Value = TypeVar("Value")


@dataclass(frozen=True, kw_only=True)
class AxisTable(BodyTable):
    """``[axis]``: what is simulated, which the controller does not see.

    With a load and a spring it is a flexible arm, whose first mass has the friction.

    Attributes
    ----------
    kind
        ``"linear"`` or ``"rotary"``.
    law
        Of the friction: one of `LAWS`.
    stribeck_velocity, shape
        Of the laws that fall from static to Coulomb friction: over which speed [m/s or rad/s], and
        ``"gaussian"`` or ``"exponential"``; None takes the first.
    bristle_stiffness, bristle_damping
        Of the laws with bristles [N/m or N m/rad, N s/m or N m s/rad].
    elastic_deflection
        Of the elasto-plastic law: below it bristles do not slip [m or rad].

    Raises
    ------
    InputError
        If a quantity is missing, out of its range, given twice, or of no use to the law.
    """

    kind: AxisKind = "linear"
    law: LawName = "coulomb"
    stribeck_velocity: float | None = quantity_field("stribeck_velocity", default=None)
    shape: StribeckShape | None = None
    bristle_stiffness: float | None = quantity_field("stiffness", default=None)
    bristle_damping: float | None = quantity_field("viscous_friction", default=None)
    elastic_deflection: float | None = quantity_field("position", default=None)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in _USES["elasto-plastic"]:
            value, users = getattr(self, name), [law for law in LAWS if name in _USES[law]]
            if value is not None and self.law not in users:
                shown = repr(value) if isinstance(value, str) else f"{value:g}"
                raise InputError(
                    f"{name} is {shown}, and law {self.law!r} has no use for it",
                    remedy=f"leave it out, or use law {' or '.join(map(repr, users))}",
                )
        if self.law == "dahl" and self.sides("static_friction") is not None:
            raise InputError(
                "static_friction is given, and law 'dahl' has no peak above its Coulomb friction",
                remedy="leave it out, or use law 'lugre'",
            )
        if self.law == "stribeck":
            _needed(self.sides("static_friction"), "static_friction", self.kind)
        self.plant()

    @property
    def flexible(self) -> bool:
        """Whether it is a flexible arm."""
        return self.load(self.kind) is not None or self.stiffness is not None

    @property
    def bristles(self) -> bool:
        """Whether the law has bristles, on which nothing rests quite."""
        return self.bristle_stiffness is not None

    def friction(self) -> CoulombViscousFriction:
        """Return Coulomb, viscous and static friction and offset, without what a law adds.

        That is all that controllers, estimators and plans know of friction.

        Raises
        ------
        InputError
            If a quantity is missing or out of its range.
        """
        return friction_law(self._pairs(), 0.0 if self.offset is None else self.offset)

    def _pairs(self) -> dict[str, tuple[float, float]]:
        """Return what is given of friction, in the positive and in the negative direction."""
        kind = self.kind
        coulomb = _needed(self.sides("coulomb_friction"), "coulomb_friction", kind)
        viscous = _needed(self.sides("viscous_friction"), "viscous_friction", kind)
        pairs = {"coulomb_friction": coulomb, "viscous_friction": viscous}
        if (static := self.sides("static_friction")) is not None:
            pairs["static_friction"] = static
        return pairs

    def about_law(self) -> tuple[str, ...]:
        """Return what a user should know of a law that nobody who controls or estimates knows."""
        if self.law == "coulomb":
            return ()
        notes = (
            f"The axis is simulated with {LAWS[self.law]}; the controller knows Coulomb, viscous "
            "and static friction only.",
        )
        if self.bristle_stiffness is None:
            return notes
        bent = max(self.friction().breakaway()) / self.bristle_stiffness
        return (
            *notes,
            f"Its bristles bend by up to {prefixed(bent, unit_of('position', self.kind))} before "
            "it breaks away, and as much of a motion may spring back.",
        )

    def plant(self) -> Plant:
        """Return the axis as it is simulated."""
        return self.arm() if self.flexible else self.rigid()

    def arm(self) -> FlexibleArm[FrictionLaw]:
        """Return the flexible arm as it is simulated.

        Raises
        ------
        InputError
            If it is none, or a quantity is missing or out of its range.
        """
        kind, body = self.kind, "mass" if self.kind == "linear" else "inertia"
        spring = _needed(self.stiffness, "stiffness", kind)
        load = _needed(self.load(kind), f"load_{body}", kind)
        own = _needed(self.body(kind), body, kind)
        for name, value, unit in (
            (body, own, unit_of("mass", kind)),
            (f"load_{body}", load, unit_of("mass", kind)),
            ("stiffness", spring, unit_of("stiffness", kind)),
        ):
            positive(name, value, unit)
        return FlexibleArm(
            mass_1=own, mass_2=load, stiffness=spring, friction=self._law(), kind=kind
        )

    def rigid(self) -> SingleMass[FrictionLaw]:
        """Return the rigid axis as it is simulated.

        Raises
        ------
        InputError
            If a quantity is missing or out of its range.
        """
        kind = self.kind
        body = _needed(self.body(kind), "mass" if kind == "linear" else "inertia", kind)
        return SingleMass(mass=body, friction=self._law(), kind=kind)

    def _law(self) -> FrictionLaw:
        try:
            return self._made(self.friction())
        except InputError as error:
            raise by_one_name(error, self._pairs()) from None

    def _made(self, friction: CoulombViscousFriction) -> FrictionLaw:
        if self.law == "coulomb":
            return friction
        if self.law == "dahl":
            return DahlFriction(
                sliding=friction, bristle_stiffness=self._given("bristle_stiffness")
            )
        same: dict[str, Any] = {
            each.name: getattr(friction, each.name) for each in fields(friction)
        }
        sliding = StribeckFriction(
            **same,
            stribeck_velocity=self._given("stribeck_velocity"),
            shape=self.shape or "gaussian",
        )
        if self.law == "stribeck":
            return sliding
        stiffness, damping = self._given("bristle_stiffness"), self._given("bristle_damping")
        if self.law == "lugre":
            return LuGreFriction(
                sliding=sliding, bristle_stiffness=stiffness, bristle_damping=damping
            )
        return ElastoPlasticFriction(
            sliding=sliding,
            bristle_stiffness=stiffness,
            bristle_damping=damping,
            elastic_deflection=self._given("elastic_deflection"),
        )

    def _given(self, name: str) -> float:
        return _needed(getattr(self, name), name, self.kind)


def _needed(value: Value | None, name: str, kind: AxisKind) -> Value:
    """Return what was given; refuse that it was not."""
    if value is None:
        unit = unit_of(_QUANTITIES.get(name, name.removeprefix("load_")), kind)
        raise InputError(
            f"{name} is missing", remedy=f"give the {name.replace('_', ' ')} in {unit}"
        )
    return value
