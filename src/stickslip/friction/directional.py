"""What friction laws with values of their own in each direction have in common."""

from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from stickslip.records import InputError, Quantity, quantity_field

__all__ = ["DirectionalFriction", "check_magnitudes"]

Law = TypeVar("Law", bound="DirectionalFriction")


def check_magnitudes(law: Any, *, positive: tuple[str, ...] = ()) -> None:
    """Check the physical quantities among the fields of a new law, and make them floats.

    Parameters
    ----------
    law
        A frozen dataclass; its fields with a quantity are checked.
    positive
        Names of those that must not be zero either. An offset may have any sign.

    Raises
    ------
    InputError
        If a value is not finite, or has the wrong sign.
    """
    for name, field in law.__dataclass_fields__.items():
        quantity: Quantity | None = field.metadata.get("quantity")
        if quantity is None:
            continue
        value = float(getattr(law, name))
        unit = f"{quantity.linear} or {quantity.rotary}"  # whichever the axis has
        if not np.isfinite(value):
            raise InputError(
                f"{name} is {value:g} {unit}, it must be finite", remedy=f"give the {name}"
            )
        if name in positive and value <= 0:
            raise InputError(
                f"{name} is {value:g} {unit}, it must be positive", remedy=f"give the {name}"
            )
        if value < 0 and name != "offset":
            raise InputError(
                f"{name} is {value:g} {unit}, it must not be negative",
                remedy="give a magnitude; both directions count theirs as positive",
            )
        object.__setattr__(law, name, value)


@dataclass(frozen=True, kw_only=True)
class DirectionalFriction:
    """Coulomb, static and viscous friction in each direction, and a constant offset.

    Attributes
    ----------
    coulomb_friction_positive, coulomb_friction_negative
        Coulomb friction while moving in either direction [N or N m], not negative.
    static_friction_positive, static_friction_negative
        Effort (less the offset) up to which a resting mass stays, towards either direction
        [N or N m]; at least the Coulomb friction.
    viscous_friction_positive, viscous_friction_negative
        Viscous friction in either direction [N s/m or N m s/rad], not negative.
    offset
        Constant effort lost whatever the motion [N or N m], any sign.

    Raises
    ------
    InputError
        If a value is not finite, a magnitude is negative, or a static friction is below the
        Coulomb friction of its direction.
    """

    coulomb_friction_positive: float = quantity_field("coulomb_friction")
    coulomb_friction_negative: float = quantity_field("coulomb_friction")
    static_friction_positive: float = quantity_field("static_friction")
    static_friction_negative: float = quantity_field("static_friction")
    viscous_friction_positive: float = quantity_field("viscous_friction")
    viscous_friction_negative: float = quantity_field("viscous_friction")
    offset: float = quantity_field("offset", default=0.0)

    def __post_init__(self) -> None:
        check_magnitudes(self)
        for side in ("positive", "negative"):
            static = getattr(self, f"static_friction_{side}")
            coulomb = getattr(self, f"coulomb_friction_{side}")
            if static < coulomb:
                raise InputError(
                    f"static_friction_{side} is {static:g} N or N m, below the Coulomb friction of "
                    f"that direction, {coulomb:g} N or N m",
                    remedy="give a static friction of at least the Coulomb friction",
                )

    @property
    def sliding(self: Law) -> Law:
        """The law of steady motion, which is the law itself."""
        return self

    @property
    def bristles(self) -> None:
        """None, as the contact does not bend."""

    def breakaway(self) -> tuple[float, float]:
        """Return the magnitudes of effort that free a resting mass, (positive, negative)."""
        return self.static_friction_positive, self.static_friction_negative

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
