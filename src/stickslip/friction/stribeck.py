"""Friction that falls from the static to the Coulomb friction as motion sets in (Stribeck)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from stickslip.friction.coulomb_viscous import (
    DirectionalFriction,
    both_directions,
    check_magnitudes,
)
from stickslip.records import one_of, positive, quantity_field

StribeckShape = Literal["gaussian", "exponential"]

_EXPONENTS: dict[StribeckShape, float] = {"gaussian": 2.0, "exponential": 1.0}


@dataclass(frozen=True, kw_only=True)
class StribeckEffect:
    """How much of the step from Coulomb to static friction is left at a speed.

    ``exp(-(|v|/v_s)^delta)``, with delta = 1 (Tustin 1947) or delta = 2 (Armstrong-Helouvry 1991);
    between them stands Bo and Pavelescu (1982).

    Raises
    ------
    InputError
        If the velocity is not positive and finite, or there is no such shape.

    Examples
    --------
    >>> StribeckEffect(velocity=0.01).left([0.0, 0.01]).round(3).tolist()
    [1.0, 0.368]
    """

    #: Stribeck velocity v_s [m/s or rad/s]: 1/e of the step is left there.
    velocity: float = quantity_field("stribeck_velocity")
    #: ``"gaussian"`` (delta = 2) or ``"exponential"`` (delta = 1).
    shape: StribeckShape = "gaussian"

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "velocity", positive("stribeck_velocity", self.velocity, "m/s or rad/s")
        )
        one_of("shape", self.shape, _EXPONENTS)

    @property
    def exponent(self) -> float:
        """The exponent delta [-]."""
        return _EXPONENTS[self.shape]

    def left(self, velocity: ArrayLike) -> Float[np.ndarray, "..."]:
        """Return the share of the step that is left [-] at velocities [m/s or rad/s]; 1 at rest."""
        speed = np.abs(np.asarray(velocity, dtype=np.float64)) / self.velocity
        return np.exp(-(speed**self.exponent))

    def mean_left(
        self, before: Float[np.ndarray, " n"], after: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, " n"]:
        """Return the mean share that is left over the travel of each sample [-].

        By Simpson's rule, with a velocity that changes evenly from its value ``before`` to that
        ``after`` the sample [m/s or rad/s]; speeds are weighted by the travel.
        """
        middle = 0.5 * (before + after)
        speeds = np.abs(np.stack([before, middle, after]))
        weights = np.array([[1.0], [4.0], [1.0]]) * speeds
        travel = np.sum(weights, axis=0)
        share = np.sum(weights * self.left(speeds), axis=0)
        return np.divide(share, travel, out=np.ones_like(travel), where=travel > 0)

    def slope(self, velocity: ArrayLike) -> Float[np.ndarray, "..."]:
        """Return the derivative of `left` by the Stribeck velocity [s/m] at velocities [m/s]."""
        power = (np.abs(np.asarray(velocity, dtype=np.float64)) / self.velocity) ** self.exponent
        return self.exponent * power * np.exp(-power) / self.velocity


@dataclass(frozen=True, kw_only=True)
class StribeckFriction(DirectionalFriction):
    """Coulomb, viscous and static friction, joined by the Stribeck effect.

    While moving with velocity v > 0 the friction force is
    ``f_c + (f_s - f_c) exp(-(v/v_s)^delta) + c v`` (Armstrong-Helouvry, Dupont and Canudas de Wit
    1994), mirrored for v < 0, with values of its own in each direction. At rest it balances
    any force between ``-f_s-`` and ``f_s+``, and motion sets in with just that friction.

    Raises
    ------
    InputError
        As `DirectionalFriction` does, and if the Stribeck velocity is not positive.

    Examples
    --------
    >>> law = StribeckFriction.symmetric(coulomb_friction=1.0, static_friction=1.5,
    ...     viscous_friction=0.4, stribeck_velocity=0.001)
    >>> law.friction([0.0, 1e-9, 0.5]).round(6).tolist()
    [0.0, 1.5, 1.2]
    """

    #: Speed at which 1/e of the step from Coulomb to static friction is left [m/s or rad/s].
    stribeck_velocity: float = quantity_field("stribeck_velocity")
    #: ``"gaussian"`` (delta = 2) or ``"exponential"`` (delta = 1).
    shape: StribeckShape = "gaussian"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_magnitudes(self, positive=("stribeck_velocity",))
        _ = self.effect

    @classmethod
    def symmetric(
        cls,
        *,
        coulomb_friction: float,
        static_friction: float,
        viscous_friction: float,
        stribeck_velocity: float,
        shape: StribeckShape = "gaussian",
        offset: float = 0.0,
    ) -> "StribeckFriction":
        """Return the law with the same values in both directions.

        Parameters
        ----------
        coulomb_friction, static_friction
            [N or N m].
        viscous_friction
            [N s/m or N m s/rad].
        stribeck_velocity
            [m/s or rad/s].
        shape
            ``"gaussian"`` or ``"exponential"``.
        offset
            Constant effort lost [N or N m].
        """
        return cls(
            **both_directions(coulomb_friction, static_friction, viscous_friction),
            stribeck_velocity=stribeck_velocity,
            shape=shape,
            offset=offset,
        )

    @property
    def effect(self) -> StribeckEffect:
        """The decay of the step from Coulomb to static friction with speed."""
        return StribeckEffect(velocity=self.stribeck_velocity, shape=self.shape)
