"""``[axis]``: what is simulated. The key ``law`` chooses the model."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import ClassVar

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
from stickslip.records import AxisKind, InputError, unit_of
from stickslip.scenario.body import DIRECTIONAL, Body, coulomb_viscous
from stickslip.scenario.table import Variants, key, required

__all__ = ["AXES", "Axis", "CoulombAxis", "DahlAxis", "ElastoPlasticAxis", "LuGreAxis"]


class Axis(Body):
    """What all laws have in common. With a load and a spring it is a flexible arm."""

    shows_defaults: ClassVar[bool] = False
    title: ClassVar[str]
    """The law in words."""

    bristles: ClassVar[bool] = False
    """Whether the law has bristles, on which nothing rests exactly."""

    needs: ClassVar[tuple[str, ...]] = ("coulomb_friction", "viscous_friction")
    """Frictions without a default."""

    kind: AxisKind = key("kind of motion: decides the units", default="linear")
    law: str = required("friction law")

    @model_validator(mode="after")
    def _check_plant(self) -> "Axis":
        body = "mass" if self.kind == "linear" else "inertia"
        needed = {body: self.body}
        if self.flexible:
            needed = {"stiffness": self.stiffness, f"load_{body}": self.load, body: self.body}
        needed |= {name: (self.sides(name) or (None,))[0] for name in self.needs}
        for name, value in needed.items():
            if value is None:
                words, unit = name.replace("_", " "), unit_of(name, self.kind)
                raise InputError(f"{name} is missing", remedy=f"give the {words} in {unit}")
        self._check_law()
        self.build()
        return self

    def _check_law(self) -> None:
        """Check what a law needs of the friction."""

    @property
    def flexible(self) -> bool:
        """Whether it is a flexible arm."""
        return self.load is not None or self.stiffness is not None

    def friction(self) -> CoulombViscousFriction:
        """Return Coulomb, viscous and static friction and offset, without what a law adds.

        Controllers, estimators and plans know no more of friction.
        """
        pairs = {name: pair for name in DIRECTIONAL if (pair := self.sides(name)) is not None}
        return coulomb_viscous(pairs, self.offset or 0.0, self.kind)

    def friction_law(self) -> FrictionLaw:
        """Return the law as it is simulated."""
        return self.friction()

    def build(self) -> Plant:
        """Return the plant as it is simulated."""
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
        """Return mass and friction by the names of parameters; of both directions, the mean [SI].

        The offset stands by itself.
        """
        law, values = self.friction(), {"mass": self.body or 0.0}
        for name in DIRECTIONAL:
            sides = [float(getattr(law, f"{name}_{side}")) for side in ("positive", "negative")]
            values[name] = 0.5 * (sides[0] + sides[1])
            values[f"{name}_positive"], values[f"{name}_negative"] = sides
        return values | {"offset": law.offset}

    def notes(self) -> tuple[str, ...]:
        """Return what a user should know of a law that controllers do not know."""
        if self.law == "coulomb":
            return ()
        return (
            f"The axis is simulated with {self.title}; the controller knows Coulomb, viscous and "
            "static friction only.",
        )


class CoulombAxis(Axis):
    """Coulomb and viscous friction."""

    title: ClassVar[str] = "Coulomb and viscous friction"


class _FallingAxis(Axis):
    """Friction that falls from static to Coulomb friction."""

    stribeck_velocity: float = required(
        "speed over which friction falls from static to Coulomb", "stribeck_velocity"
    )
    shape: StribeckShape = key("how friction falls with speed", default="gaussian")

    def sliding(self) -> StribeckFriction:
        """Return the friction of steady motion."""
        return StribeckFriction(
            **asdict(self.friction()), stribeck_velocity=self.stribeck_velocity, shape=self.shape
        )

    def truth(self) -> dict[str, float]:
        """Return also the Stribeck velocity [SI]."""
        return super().truth() | {"stribeck_velocity": self.stribeck_velocity}


class StribeckAxis(_FallingAxis):
    """Coulomb, viscous and static friction, joined by the Stribeck effect."""

    title: ClassVar[str] = "Stribeck friction"
    needs: ClassVar[tuple[str, ...]] = DIRECTIONAL

    def friction_law(self) -> FrictionLaw:
        """Return the law as it is simulated."""
        return self.sliding()


class _BristleAxis(Axis):
    """A law with bristles."""

    bristles: ClassVar[bool] = True
    bristle_stiffness: float = required("$\\sigma_0$ of the bristles", "stiffness")

    def _check_law(self) -> None:
        for name in ("coulomb_friction", "coulomb_friction_positive", "coulomb_friction_negative"):
            if getattr(self, name) == 0.0:
                raise InputError(
                    f"{name} is 0 {unit_of(name, self.kind)}, it must be positive: bristles bear "
                    "it",
                    remedy="give a Coulomb friction, or take a law without bristles",
                )

    def notes(self) -> tuple[str, ...]:
        """Return also how far the bristles bend."""
        bent = max(self.friction().breakaway()) / self.bristle_stiffness
        return (
            *super().notes(),
            f"Its bristles bend by up to {prefixed(bent, unit_of('position', self.kind))} before "
            "it breaks away, and as much of a motion may spring back.",
        )


class DahlAxis(_BristleAxis):
    """Dahl's law: bristles, and no peak above Coulomb friction."""

    title: ClassVar[str] = "the friction of Dahl"

    def _check_law(self) -> None:
        super()._check_law()
        if self.sides("static_friction") is not None:
            raise InputError(
                "static_friction is given, and law 'dahl' has no peak above its Coulomb friction",
                remedy="leave it out, or use law 'lugre'",
            )

    def friction_law(self) -> FrictionLaw:
        """Return the law as it is simulated."""
        return DahlFriction(sliding=self.friction(), bristle_stiffness=self.bristle_stiffness)


class LuGreAxis(_BristleAxis, _FallingAxis):
    """LuGre friction: bristles and the Stribeck effect."""

    title: ClassVar[str] = "LuGre friction"
    bristle_damping: float = required("$\\sigma_1$ of the bristles", "viscous_friction")

    def friction_law(self) -> FrictionLaw:
        """Return the law as it is simulated."""
        return LuGreFriction(
            sliding=self.sliding(),
            bristle_stiffness=self.bristle_stiffness,
            bristle_damping=self.bristle_damping,
        )


class ElastoPlasticAxis(LuGreAxis):
    """Elasto-plastic friction: LuGre whose bristles do not slip below a deflection."""

    title: ClassVar[str] = "elasto-plastic friction"
    elastic_deflection: float = required(
        "deflection below which the bristles do not slip", "position"
    )

    def friction_law(self) -> FrictionLaw:
        """Return the law as it is simulated."""
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
