"""A rigid axis: one mass or inertia with friction."""

from dataclasses import dataclass
from typing import Any, ClassVar, Generic

from jaxtyping import Float
from numpy import ndarray

from stickslip.plants.friction_law import Law_co
from stickslip.records import AxisKind, positive, quantity_field, unit_of

__all__ = ["SingleMass"]


@dataclass(frozen=True, kw_only=True)
class SingleMass(Generic[Law_co]):
    """One mass (or inertia) moved by an effort against friction (van de Wijdeven 2002 B Eq. 1).

    ``mass * acceleration = effort - offset - friction(velocity)``; at rest it stays while the
    effort less the offset is within the static friction. Its state is ``(position, velocity)``.

    Attributes
    ----------
    mass
        Moving mass [kg], or inertia [kg m^2] of a rotary axis.
    friction
        The friction law: any of `stickslip.friction`.
    kind
        ``"linear"`` or ``"rotary"``; decides the units.

    Raises
    ------
    InputError
        If the mass is not positive and finite.

    Examples
    --------
    >>> from stickslip.friction import CoulombViscousFriction
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=100.0, viscous_friction=700.0)
    >>> SingleMass(mass=150.0, friction=law).mass
    150.0
    """

    mass: float = quantity_field("mass")
    friction: Law_co
    kind: AxisKind = "linear"
    flexible: ClassVar[bool] = False
    parameter_names: ClassVar[tuple[str, ...]] = ("mass",)
    state_names: ClassVar[tuple[str, ...]] = ("position", "velocity")

    def __post_init__(self) -> None:
        object.__setattr__(self, "mass", positive("mass", self.mass, unit_of("mass", self.kind)))

    def kinetic_energy(self, velocity: Float[ndarray, " n"]) -> Float[ndarray, " n"]:
        """Return the kinetic energy [J] at each velocity [m/s or rad/s]."""
        energy: Any = 0.5 * self.mass * velocity**2
        return energy
