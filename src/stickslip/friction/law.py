"""The protocol of friction laws."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from stickslip.friction.coulomb_viscous import CoulombViscousFriction
    from stickslip.friction.stribeck import StribeckFriction


@dataclass(frozen=True, kw_only=True)
class Bristles:
    """The contact of a law whose bristles bend before they slip."""

    stiffness: float  # sigma_0 [N/m or N m/rad]
    damping: float = 0.0  # sigma_1 [N s/m or N m s/rad]
    exponent: float = 1.0  # of Dahl's curve
    elastic_deflection: float | None = None  # nothing slips up to it [m or rad]; None for none


@runtime_checkable
class FrictionLaw(Protocol):
    """A friction law as a plant holds it: a frozen record of its parameters.

    It opposes motion: ``inertia * acceleration = effort - offset - friction(velocity)``. The
    simulator propagates an affine law exactly and integrates the others; it accepts the laws of
    `stickslip.friction.registry`.
    """

    @property
    def affine(self) -> bool:
        """Whether friction is affine in the velocity of each direction."""
        ...

    @property
    def sliding(self) -> "CoulombViscousFriction | StribeckFriction":
        """The law of steady motion, without bristles."""
        ...

    @property
    def bristles(self) -> Bristles | None:
        """The bristles of the contact; None if it has none."""
        ...

    @property
    def offset(self) -> float:
        """Constant effort lost whatever the motion [N or N m]."""
        ...

    def breakaway(self) -> tuple[float, float]:
        """Return the magnitudes of effort that free a resting mass, (positive, negative)."""
        ...

    def friction(self, velocity: ArrayLike) -> Float[np.ndarray, "..."]:
        """Return the steady friction force at each velocity; 0 at rest."""
        ...

    def mirrored(self) -> "FrictionLaw":
        """Return the law of the same axis with its direction counted the other way."""
        ...
