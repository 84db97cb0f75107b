"""A form that friction may have: which terms it is a sum of."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from stickslip.friction import StribeckEffect
from stickslip.records import InputError, positive

__all__ = ["FrictionForm"]

SIDES = ("positive", "negative")


@dataclass(frozen=True, kw_only=True)
class FrictionForm:
    """The terms of a friction law whose parameters enter linearly.

    With the direction d = sign(v), the friction is ``coulomb_friction d +
    viscous_friction d |v|^exponent``, and what is asked for beside it.

    Attributes
    ----------
    coulomb_per_direction, viscous_per_direction
        Whether the friction differs between the directions.
    offset
        Whether a constant force is sought. With two Coulomb values it could not be told apart from
        half their difference.
    exponent
        Of the speed in viscous friction [-]: 1, or 2/3 for the churning of the lubricant in a
        rolling bearing or a ball screw (Palmgren 1959). With another than 1, viscous friction has
        the unit N (s/m)^exponent.
    stribeck
        How friction goes over from ``static_friction`` at the slowest motion to
        ``coulomb_friction`` with growing speed. Where the first is the smaller one, friction rises.
    stiffness
        Whether a force is sought that grows with position (a cable, an inclined guide).
    period
        Of a force that ripples along the way [m or rad], such as that of a motor's poles or of a
        screw; None seeks none.
    harmonics
        Of that ripple.

    Raises
    ------
    InputError
        If two Coulomb values and an offset are asked for, or a number is out of range.

    Examples
    --------
    >>> FrictionForm(viscous_per_direction=True, offset=True).names
    ('viscous_friction_positive', 'viscous_friction_negative', 'coulomb_friction', 'offset')
    """

    coulomb_per_direction: bool = False
    viscous_per_direction: bool = False
    offset: bool = False
    exponent: float = 1.0
    stribeck: StribeckEffect | None = None
    stiffness: bool = False
    period: float | None = None
    harmonics: int = 1

    def __post_init__(self) -> None:
        positive("exponent", self.exponent, "-")
        if self.period is not None:
            positive("period", self.period, "m or rad")
        if self.harmonics < 1:
            raise InputError(
                f"harmonics is {self.harmonics}, it must be at least 1", remedy="leave it out"
            )
        if self.coulomb_per_direction and self.offset:
            raise InputError(
                "an offset and Coulomb friction per direction are both asked for, but an offset is "
                "the same as half the difference of the two",
                remedy="ask for one of them",
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in the order of the columns."""
        names = [
            *_sided("viscous_friction", per_direction=self.viscous_per_direction),
            *_sided("coulomb_friction", per_direction=self.coulomb_per_direction),
        ]
        names += ["static_friction"] * (self.stribeck is not None)
        names += ["offset"] * self.offset + ["stiffness"] * self.stiffness
        for k in self._orders:
            names += [f"ripple_cosine_{k}", f"ripple_sine_{k}"]
        return tuple(names)

    @property
    def size(self) -> int:
        """Number of parameters, those that do not enter linearly included."""
        return len(self.names) + (self.stribeck is not None) + (self.period is not None)

    @property
    def _orders(self) -> range:
        return range(1, 1 + (0 if self.period is None else self.harmonics))

    def columns(self, position: ArrayLike, velocity: ArrayLike) -> Float[np.ndarray, "n p"]:
        """Return what each parameter is multiplied by, a column each.

        Parameters
        ----------
        position, velocity
            [m and m/s, or rad and rad/s], shape (n,).
        """
        x, v = (
            np.atleast_1d(np.asarray(position, float)),
            np.atleast_1d(np.asarray(velocity, float)),
        )
        d = np.sign(v)
        # At rest the slowest friction counts, of which there is but one
        slow = np.zeros_like(v) if self.stribeck is None else self.stribeck.left(v)
        columns = [
            *_split(d * np.abs(v) ** self.exponent, d, per_direction=self.viscous_per_direction),
            *_split(d * (1.0 - slow), d, per_direction=self.coulomb_per_direction),
        ]
        columns += [d * slow] * (self.stribeck is not None)
        columns += [np.ones_like(v)] * self.offset + [x] * self.stiffness
        for k in self._orders:
            angle = 2.0 * np.pi * k * x / (self.period or 1.0)
            columns += [np.cos(angle), np.sin(angle)]
        return np.column_stack(columns)

    def friction(
        self, values: Mapping[str, float], position: ArrayLike, velocity: ArrayLike
    ) -> Float[np.ndarray, " n"]:
        """Return the force of all terms in motion [N or N m].

        Parameters
        ----------
        values
            Of each of `names` [SI].
        position, velocity
            [m and m/s, or rad and rad/s], shape (n,).
        """
        return self.columns(position, velocity) @ [values[name] for name in self.names]


def _sided(name: str, *, per_direction: bool) -> list[str]:
    return [f"{name}_{side}" for side in SIDES] if per_direction else [name]


def _split(
    column: Float[np.ndarray, " n"], direction: Float[np.ndarray, " n"], *, per_direction: bool
) -> list[Float[np.ndarray, " n"]]:
    return [column * (direction > 0), column * (direction < 0)] if per_direction else [column]
