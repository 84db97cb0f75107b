"""Coulomb, static and viscous friction with separate values in each direction."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from stickslip.records import InputError, Quantity, quantity_field

if TYPE_CHECKING:
    from stickslip.friction.stribeck import StribeckEffect

Law = TypeVar("Law", bound="DirectionalFriction")


def check_magnitudes(law: Any, *, positive: tuple[str, ...] = ()) -> None:
    """Check the fields of a new frozen law that are quantities, and make them floats.

    None may be negative but an offset; those named in ``positive`` may not be zero either.
    """
    for name, field in law.__dataclass_fields__.items():
        quantity: Quantity | None = field.metadata.get("quantity")
        if quantity is None:
            continue
        value = float(getattr(law, name))
        unit = f"{quantity.linear} or {quantity.rotary}"  # whichever the axis has
        if not np.isfinite(value):
            raise InputError("not_finite", name=name, value=value, unit=unit)
        if name in positive and value <= 0:
            raise InputError("not_positive", name=name, value=value, unit=unit)
        if value < 0 and name != "offset":
            raise InputError("negative", name=name, value=value, unit=unit)
        object.__setattr__(law, name, value)


@dataclass(frozen=True, kw_only=True)
class DirectionalFriction:
    """Coulomb, static and viscous friction in each direction, and a constant offset."""

    #: Coulomb friction while moving in the positive direction [N or N m], not negative.
    coulomb_friction_positive: float = quantity_field("coulomb_friction")
    #: The same in the negative direction.
    coulomb_friction_negative: float = quantity_field("coulomb_friction")
    #: Effort (less the offset) up to which a resting mass stays, towards the positive direction
    #: [N or N m]; at least the Coulomb friction.
    static_friction_positive: float = quantity_field("static_friction")
    #: The same towards the negative direction.
    static_friction_negative: float = quantity_field("static_friction")
    #: Viscous friction in the positive direction [N s/m or N m s/rad], not negative.
    viscous_friction_positive: float = quantity_field("viscous_friction")
    #: The same in the negative direction.
    viscous_friction_negative: float = quantity_field("viscous_friction")
    #: Constant effort lost whatever the motion [N or N m], any sign.
    offset: float = quantity_field("offset", default=0.0)

    def __post_init__(self) -> None:
        check_magnitudes(self)
        for side in ("positive", "negative"):
            static = getattr(self, f"static_friction_{side}")
            coulomb = getattr(self, f"coulomb_friction_{side}")
            if static < coulomb:
                raise InputError(
                    "static_below_coulomb",
                    name=f"static_friction_{side}",
                    value=static,
                    coulomb=coulomb,
                    unit="N or N m",
                )

    @property
    def sliding(self: Law) -> Law:
        """The law of steady motion, which is the law itself."""
        return self

    @property
    def effect(self) -> "StribeckEffect | None":
        """The Stribeck effect; None without one."""
        return None

    @property
    def affine(self) -> bool:
        """Whether friction is affine in the velocity of each direction."""
        return self.effect is None

    @property
    def bristles(self) -> None:
        """None, as the contact does not bend."""

    def breakaway(self) -> tuple[float, float]:
        """Return the magnitudes of effort that free a resting mass, (positive, negative)."""
        return self.static_friction_positive, self.static_friction_negative

    def friction(self, velocity: ArrayLike) -> Float[np.ndarray, "..."]:
        """Return the friction force [N or N m] at velocities [m/s or rad/s]; 0 at rest."""
        v = np.asarray(velocity, dtype=np.float64)
        left = 0.0 if self.effect is None else self.effect.left(v)
        coulomb, static = self.coulomb_friction_positive, self.static_friction_positive
        forward = coulomb + (static - coulomb) * left + self.viscous_friction_positive * v
        coulomb, static = self.coulomb_friction_negative, self.static_friction_negative
        backward = -coulomb - (static - coulomb) * left + self.viscous_friction_negative * v
        return np.where(v > 0, forward, np.where(v < 0, backward, 0.0))

    def mirrored(self: Law) -> Law:
        """Return the law of the same axis with its direction counted the other way."""
        return replace(
            self,
            coulomb_friction_positive=self.coulomb_friction_negative,
            coulomb_friction_negative=self.coulomb_friction_positive,
            static_friction_positive=self.static_friction_negative,
            static_friction_negative=self.static_friction_positive,
            viscous_friction_positive=self.viscous_friction_negative,
            viscous_friction_negative=self.viscous_friction_positive,
            offset=-self.offset,
        )


@dataclass(frozen=True, kw_only=True)
class CoulombViscousFriction(DirectionalFriction):
    """Coulomb and viscous friction with stiction and a constant offset.

    While moving with velocity v > 0 the friction force is ``f_c+ + c+ v``, with v < 0 it is
    ``-(f_c- + c- |v|)`` (van de Wijdeven 2002 A Eq. 2.1, per direction). At rest it balances any
    force between ``-f_s-`` and ``f_s+`` (part B Eq. 1). The offset is subtracted from the effort:
    ``inertia * acceleration = effort - offset - friction(velocity)``.

    Raises
    ------
    InputError
        If a value is not finite, a magnitude is negative, or a static friction is below the
        Coulomb friction of its direction.

    Examples
    --------
    >>> law = CoulombViscousFriction.symmetric(
    ...     coulomb_friction=100.0, viscous_friction=700.0, static_friction=130.0)
    >>> law.friction([-0.1, 0.0, 0.1]).tolist()
    [-170.0, 0.0, 170.0]
    """

    @classmethod
    def symmetric(
        cls,
        *,
        coulomb_friction: float,
        viscous_friction: float,
        static_friction: float | None = None,
        offset: float = 0.0,
    ) -> "CoulombViscousFriction":
        """Return the law with the same values in both directions.

        Parameters
        ----------
        coulomb_friction, viscous_friction
            [N or N m] and [N s/m or N m s/rad].
        static_friction
            [N or N m]; the Coulomb friction if None.
        offset
            Constant effort lost [N or N m].
        """
        static = coulomb_friction if static_friction is None else static_friction
        return cls(**both_directions(coulomb_friction, static, viscous_friction), offset=offset)


def both_directions(coulomb: float, static: float, viscous: float) -> dict[str, float]:
    """Return the values of both directions, by name, of a law that does not differ in them."""
    values = {"coulomb": coulomb, "static": static, "viscous": viscous}
    return {
        f"{name}_friction_{side}": value
        for name, value in values.items()
        for side in ("positive", "negative")
    }
