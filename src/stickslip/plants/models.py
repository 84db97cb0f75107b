"""Plants: one mass, or two masses on a spring, with friction on the driven mass."""

from dataclasses import dataclass
from typing import Any, ClassVar, Generic

from jaxtyping import Float
from numpy import ndarray
from typing_extensions import TypeVar

from stickslip.errors import check_class
from stickslip.friction import CoulombViscousFriction, FrictionLaw
from stickslip.records import AxisKind, InputError, positive, quantity_field, unit_of

Law_co = TypeVar("Law_co", bound=FrictionLaw, default=CoulombViscousFriction, covariant=True)
"""``SingleMass`` alone means one with `CoulombViscousFriction`, which is all that plans and
controllers know; ``SingleMass[FrictionLaw]`` has any law, which a simulator supports."""


@dataclass(frozen=True, kw_only=True)
class SingleMass(Generic[Law_co]):
    """One mass (or inertia) moved by an effort against friction (van de Wijdeven 2002 B Eq. 1).

    ``mass * acceleration = effort - offset - friction(velocity)``; at rest it stays while the
    effort less the offset is within the static friction. Its state is ``(position, velocity)``.

    Raises
    ------
    InputError
        If the mass is not positive and finite, or there is no friction law.

    Examples
    --------
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=100.0, viscous_friction=700.0)
    >>> SingleMass(mass=150.0, friction=law).mass
    150.0
    """

    mass: float = quantity_field("mass")  #: Moving mass [kg], or inertia [kg m^2] of a rotary axis.
    friction: Law_co  #: The friction law: any of `stickslip.friction`.
    kind: AxisKind = "linear"  #: ``"linear"`` or ``"rotary"``; decides the units.
    flexible: ClassVar[bool] = False
    parameter_names: ClassVar[tuple[str, ...]] = ("mass",)
    state_names: ClassVar[tuple[str, ...]] = ("position", "velocity")

    def __post_init__(self) -> None:
        check_class("friction", self.friction, FrictionLaw)
        object.__setattr__(self, "mass", positive("mass", self.mass, unit_of("mass", self.kind)))

    def kinetic_energy(self, velocity: Float[ndarray, " n"]) -> Float[ndarray, " n"]:
        """Return the kinetic energy [J] at each velocity [m/s or rad/s]."""
        energy: Any = 0.5 * self.mass * velocity**2
        return energy


@dataclass(frozen=True, kw_only=True)
class FlexibleArm(Generic[Law_co]):
    """Two masses joined by a spring; effort and friction act on the first.

    Van de Wijdeven (2002) A, Eqs. 2.1-2.3 with a stick rule: a resting first mass stays while
    effort less offset less spring force is within the static friction. The second mass has no
    friction. Its state is ``(position, velocity, load_position, load_velocity)``.

    Raises
    ------
    InputError
        If a mass or the stiffness is not positive and finite, or there is no friction law.

    Examples
    --------
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)
    >>> FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law).kind
    'linear'
    """

    #: Driven mass [kg], or inertia [kg m^2] of a rotary axis.
    mass_1: float = quantity_field("mass")
    mass_2: float = quantity_field("mass")  #: Load [kg], or inertia [kg m^2] of a rotary axis.
    stiffness: float = quantity_field("stiffness")  #: Of the spring [N/m or N m/rad].
    friction: Law_co  #: The friction law of the driven mass: any of `stickslip.friction`.
    kind: AxisKind = "linear"  #: ``"linear"`` or ``"rotary"``; decides the units.
    flexible: ClassVar[bool] = True
    parameter_names: ClassVar[tuple[str, ...]] = ("mass_1", "mass_2", "stiffness")
    state_names: ClassVar[tuple[str, ...]] = (
        "position",
        "velocity",
        "load_position",
        "load_velocity",
    )

    def __post_init__(self) -> None:
        check_class("friction", self.friction, FrictionLaw)
        for name, quantity in (("mass_1", "mass"), ("mass_2", "mass"), ("stiffness", "stiffness")):
            value = positive(name, getattr(self, name), unit_of(quantity, self.kind))
            object.__setattr__(self, name, value)

    def kinetic_energy(
        self, velocity: Float[ndarray, " n"], load_velocity: Float[ndarray, " n"]
    ) -> Float[ndarray, " n"]:
        """Return the kinetic energy [J] of both masses (van de Wijdeven 2002 A, from Eq. 3.8)."""
        energy: Any = 0.5 * self.mass_1 * velocity**2 + 0.5 * self.mass_2 * load_velocity**2
        return energy

    def potential_energy(
        self, position: Float[ndarray, " n"], load_position: Float[ndarray, " n"]
    ) -> Float[ndarray, " n"]:
        """Return the energy [J] in the spring (van de Wijdeven 2002 A Eq. 3.7)."""
        energy: Any = 0.5 * self.stiffness * (position - load_position) ** 2
        return energy


def check_affine(plant: Any) -> None:
    """Check that the friction of a `SingleMass` or `FlexibleArm` is affine in the velocity.

    Raises
    ------
    InputError
        If it is not a `CoulombViscousFriction`.
    """
    if not isinstance(plant.friction, CoulombViscousFriction):
        raise InputError("not_affine", law=type(plant.friction).__name__)
