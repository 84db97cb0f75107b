"""``[axis]``: the simulated plant. The key ``law`` chooses the model."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, ClassVar

from pydantic import model_validator

from stickslip.friction import (
    CoulombViscousFriction,
    DahlFriction,
    ElastoPlasticFriction,
    FrictionLaw,
    LuGreFriction,
    StribeckFriction,
)
from stickslip.friction.stribeck import StribeckShape
from stickslip.plants import FlexibleArm, Plant, SingleMass
from stickslip.presentation.words import prefixed
from stickslip.records import AxisKind, InputError, mass_name, non_negative, positive, unit_of
from stickslip.scenario.table import Table, Variants, key, kind_in, required

DIRECTIONAL = ("coulomb_friction", "viscous_friction", "static_friction")
"""Quantities that are given for both directions at once, or for each direction."""

SIDES = ("positive", "negative")


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
                needed, unit = f"{of}{name}", unit_of(name, kind)
                raise InputError(
                    "key_of_other_kind", name=f"{of}{other}", kind=kind, needed=needed, unit=unit
                )
        for friction in DIRECTIONAL:
            given = [side for side in SIDES if getattr(self, f"{friction}_{side}") is not None]
            if getattr(self, friction) is not None and given:
                raise InputError("both_and_one_direction", name=friction)
            if len(given) == 1:
                (missing,) = set(SIDES) - set(given)
                raise InputError("one_direction", name=friction, given=given[0], missing=missing)
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
    for side, held, slowing in zip(SIDES, static, coulomb, strict=True):
        for name, pair in pairs.items():
            own = name if pair[0] == pair[1] else f"{name}_{side}"
            non_negative(own, pair[side == "negative"], unit_of(name, kind))
        if held < slowing:
            own = "static_friction" if static[0] == static[1] else f"static_friction_{side}"
            raise InputError(
                "static_below_coulomb", name=own, value=held, coulomb=slowing, unit=unit
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


class Axis(Body):
    """The axis of any law. With a load and a spring it is a flexible arm."""

    shows_defaults = False
    title: ClassVar[str]  # the law in words
    bristles: ClassVar[bool] = False  # on which nothing rests exactly
    needs: ClassVar[tuple[str, ...]] = ("coulomb_friction", "viscous_friction")  # no default
    kind: AxisKind = key("kind of motion: decides the units", default="linear")
    law: str = required("friction law")

    @model_validator(mode="after")
    def _check_plant(self) -> "Axis":
        body = mass_name(self.kind)
        needed = {body: self.body}
        if self.flexible:
            needed = {"stiffness": self.stiffness, f"load_{body}": self.load, body: self.body}
        needed |= {name: (self.sides(name) or (None,))[0] for name in self.needs}
        for name, value in needed.items():
            if value is None:
                raise InputError("missing", name=name, unit=unit_of(name, self.kind))
        self._check_law()
        self.build()
        return self

    def _check_law(self) -> None:
        """Check the friction against the law."""

    @property
    def flexible(self) -> bool:
        """Whether it is a flexible arm."""
        return self.load is not None or self.stiffness is not None

    def friction(self) -> CoulombViscousFriction:
        """Return Coulomb, viscous and static friction and offset, the law of controllers."""
        pairs = {name: pair for name in DIRECTIONAL if (pair := self.sides(name)) is not None}
        return coulomb_viscous(pairs, self.offset or 0.0, self.kind)

    def friction_law(self) -> FrictionLaw:
        """Return the simulated friction law."""
        return self.friction()

    def build(self) -> Plant:
        """Return the simulated plant."""
        law = self.friction_law()
        if self.flexible:
            return FlexibleArm(
                mass_1=self.body or 0.0,
                mass_2=self.load or 0.0,
                stiffness=self.stiffness or 0.0,
                friction=law,
                kind=self.kind,
            )
        return SingleMass(mass=self.body or 0.0, friction=law, kind=self.kind)

    def truth(self) -> dict[str, float]:
        """Return mass, friction (also the mean of both directions) and offset by parameter [SI]."""
        law, values = self.friction(), {"mass": self.body or 0.0}
        for name in DIRECTIONAL:
            sides = [float(getattr(law, f"{name}_{side}")) for side in ("positive", "negative")]
            values[name] = 0.5 * (sides[0] + sides[1])
            values[f"{name}_positive"], values[f"{name}_negative"] = sides
        return values | {"offset": law.offset}

    def notes(self) -> tuple[str, ...]:
        """Return notes for the user on a law other than that of controllers."""
        if self.law == "coulomb":
            return ()
        return (
            f"The axis is simulated with {self.title}; the controller knows Coulomb, viscous and "
            "static friction only.",
        )


class CoulombAxis(Axis):
    """Coulomb and viscous friction."""

    title = "Coulomb and viscous friction"


class _FallingAxis(Axis):
    """Friction that falls from static to Coulomb friction."""

    stribeck_velocity: float = required(
        "speed over which friction falls from static to Coulomb", "stribeck_velocity"
    )
    shape: StribeckShape = key("how friction falls with speed", default="gaussian")

    def sliding(self) -> StribeckFriction:
        return StribeckFriction(
            **asdict(self.friction()), stribeck_velocity=self.stribeck_velocity, shape=self.shape
        )

    def truth(self) -> dict[str, float]:
        return super().truth() | {"stribeck_velocity": self.stribeck_velocity}


class StribeckAxis(_FallingAxis):
    """Coulomb, viscous and static friction, joined by the Stribeck effect."""

    title = "Stribeck friction"
    needs = DIRECTIONAL

    def friction_law(self) -> FrictionLaw:
        return self.sliding()


class _BristleAxis(Axis):
    """A law with bristles."""

    bristles = True
    bristle_stiffness: float = required("$\\sigma_0$ of the bristles", "stiffness")

    def _check_law(self) -> None:
        for name in ("coulomb_friction", "coulomb_friction_positive", "coulomb_friction_negative"):
            if getattr(self, name) == 0.0:
                unit = unit_of(name, self.kind)
                raise InputError("no_coulomb_under_bristles", name=name, unit=unit)

    def notes(self) -> tuple[str, ...]:
        bent = max(self.friction().breakaway()) / self.bristle_stiffness
        return (
            *super().notes(),
            f"Its bristles bend by up to {prefixed(bent, unit_of('position', self.kind))} before "
            "it breaks away, and as much of a motion may spring back.",
        )


class DahlAxis(_BristleAxis):
    """Dahl's law: bristles, and no peak above Coulomb friction."""

    title = "the friction of Dahl"

    def _check_law(self) -> None:
        super()._check_law()
        if self.sides("static_friction") is not None:
            raise InputError("dahl_with_static_friction")

    def friction_law(self) -> FrictionLaw:
        return DahlFriction(sliding=self.friction(), bristle_stiffness=self.bristle_stiffness)


class LuGreAxis(_BristleAxis, _FallingAxis):
    """LuGre friction: bristles and the Stribeck effect."""

    title = "LuGre friction"
    bristle_damping: float = required("$\\sigma_1$ of the bristles", "viscous_friction")

    def friction_law(self) -> FrictionLaw:
        return LuGreFriction(
            sliding=self.sliding(),
            bristle_stiffness=self.bristle_stiffness,
            bristle_damping=self.bristle_damping,
        )


class ElastoPlasticAxis(LuGreAxis):
    """Elasto-plastic friction: LuGre whose bristles do not slip below a deflection."""

    title = "elasto-plastic friction"
    elastic_deflection: float = required(
        "deflection below which the bristles do not slip", "position"
    )

    def friction_law(self) -> FrictionLaw:
        return ElastoPlasticFriction(
            sliding=self.sliding(),
            bristle_stiffness=self.bristle_stiffness,
            bristle_damping=self.bristle_damping,
            elastic_deflection=self.elastic_deflection,
        )


_MODELS: Mapping[str, type[Axis]] = {
    "coulomb": CoulombAxis,
    "stribeck": StribeckAxis,
    "dahl": DahlAxis,
    "lugre": LuGreAxis,
    "elasto-plastic": ElastoPlasticAxis,
}
AXES: Variants[Axis] = Variants(key="law", default="coulomb", models=_MODELS)
