"""What every friction law offers, so that plants and figures need not know which one it is."""

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

__all__ = ["FrictionLaw"]


@runtime_checkable
class FrictionLaw(Protocol):
    """A friction law as a plant holds it.

    A law is a frozen record of its parameters. It opposes motion:
    ``inertia * acceleration = effort - offset - friction(velocity)``. What a simulator needs beyond
    this is particular to the kind of law (an affine one is propagated exactly, others are
    integrated), and a simulator refuses a law that it does not know.
    """

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
