"""Base of the friction laws with bristles: steady motion is that of a law without them."""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from stickslip.friction.coulomb_viscous import CoulombViscousFriction
from stickslip.friction.directional import DirectionalFriction, check_magnitudes
from stickslip.friction.law import Bristles
from stickslip.friction.stribeck import StribeckFriction
from stickslip.records import InputError, quantity_field

__all__ = ["BristleFriction"]

Law = TypeVar("Law", bound="BristleFriction")


@dataclass(frozen=True, kw_only=True)
class BristleFriction:
    """A friction law whose contact bends before it slips.

    Attributes
    ----------
    sliding
        Friction of steady motion.
    bristle_stiffness
        sigma_0 [N/m or N m/rad].
    """

    sliding: CoulombViscousFriction | StribeckFriction
    bristle_stiffness: float = quantity_field("stiffness")

    def __post_init__(self) -> None:
        check_magnitudes(self, positive=("bristle_stiffness",))
        _check_sliding(self.sliding)

    @property
    def affine(self) -> bool:
        """Whether friction is affine in the velocity of each direction (it is not)."""
        return False

    @property
    def bristles(self) -> Bristles:
        """The bristles of the contact."""
        return Bristles(stiffness=self.bristle_stiffness)

    @property
    def offset(self) -> float:
        """Constant effort lost whatever the motion [N or N m]."""
        return self.sliding.offset

    def breakaway(self) -> tuple[float, float]:
        """Return the magnitudes of a slowly rising effort that free a resting mass."""
        return self.sliding.breakaway()

    def friction(self, velocity: ArrayLike) -> Float[np.ndarray, "..."]:
        """Return the friction force of steady motion [N or N m]; 0 where the velocity is 0.

        Parameters
        ----------
        velocity
            Velocities [m/s or rad/s], any shape.
        """
        return self.sliding.friction(velocity)

    def mirrored(self: Law) -> Law:
        """Return the law of the same axis with its direction counted the other way."""
        return replace(self, sliding=self.sliding.mirrored())


def _check_sliding(sliding: DirectionalFriction) -> None:
    """Refuse a friction of steady motion under which bristles would bear nothing.

    Parameters
    ----------
    sliding
        What a law with bristles does in steady motion.

    Raises
    ------
    InputError
        If a Coulomb friction is 0.
    """
    for side in ("positive", "negative"):
        if not getattr(sliding, f"coulomb_friction_{side}") > 0:
            raise InputError(
                f"coulomb_friction_{side} is 0 N or N m, it must be positive: bristles bear it",
                remedy="give a Coulomb friction, or take a law without bristles",
            )
