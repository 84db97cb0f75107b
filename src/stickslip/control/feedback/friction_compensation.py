"""Compensation of Coulomb and viscous friction."""

from dataclasses import dataclass
from typing import Literal

from stickslip.compiled import compiled
from stickslip.control.feedback.online_friction import OnlineFriction
from stickslip.friction import CoulombViscousFriction
from stickslip.records import InputError, non_negative, quantity_field

__all__ = ["FrictionCompensation", "compensating_effort", "physical"]

_DIRECTIONS = ("reference", "measured")


@compiled(inline=True)
def compensating_effort(
    f_pos: float, f_neg: float, c_pos: float, c_neg: float, v: float, dead_band: float
) -> float:
    """Return f_c sign(v) + c v, 0 where abs(v) <= dead_band (van de Wijdeven 2002 A Eq. 2.1)."""
    if v > dead_band:
        return f_pos + c_pos * v
    if v < -dead_band:
        return c_neg * v - f_neg
    return 0.0


@compiled(inline=True)
def physical(estimate: float) -> float:
    """Return an estimate that friction can have: not negative, and 0 where there is none (NaN)."""
    return estimate if estimate > 0.0 else 0.0


@dataclass(frozen=True, kw_only=True)
class FrictionCompensation:
    """Adds the effort that friction takes: Coulomb and viscous friction.

    Van de Wijdeven (2002) does not state which velocity gives the sign. By default it is that of
    the reference: the compensation is then a feedforward, which cannot make the loop unstable
    however wrong running estimates are at first, does not flip with the sensors' noise, and already
    pushes the right way when the axis is still at rest. Friction taken for twice what it is leaves
    the surrogate arm at rest after its moves.

    The measured velocity closes a positive feedback, which takes away the damping that friction
    gives: the same wrong estimate keeps that arm swinging without end. Use it, with a dead band of
    some standard deviations of the velocity's noise and friction rather under- than overestimated,
    where an axis moves without its reference.

    Attributes
    ----------
    friction
        The law if it is known (static friction is not used), or the estimator that runs along.
    velocity
        ``"reference"`` or ``"measured"``: the velocity that is compensated for.
    dead_band
        Nothing is added while the magnitude of that velocity is within it [m/s or rad/s].

    Raises
    ------
    InputError
        If the friction is neither of the two, the velocity is not one of the two, or the dead
        band is negative or not finite.

    Examples
    --------
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)
    >>> FrictionCompensation(friction=law).velocity
    'reference'
    """

    friction: CoulombViscousFriction | OnlineFriction
    velocity: Literal["reference", "measured"] = "reference"
    dead_band: float = quantity_field("velocity", default=0.0)

    def __post_init__(self) -> None:
        known = isinstance(self.friction, CoulombViscousFriction | OnlineFriction)  # pyright: ignore[reportUnnecessaryIsInstance] - a caller need not check types
        if not known:
            raise InputError(
                "friction must be a CoulombViscousFriction or an OnlineFriction, it is a "
                f"{type(self.friction).__name__}",
                remedy="give the law, or OnlineFriction.of(estimator, ...) for one that is learned",
            )
        if self.velocity not in _DIRECTIONS:
            raise InputError(
                f"velocity is {self.velocity!r}, there is no such one",
                remedy=f"use one of {', '.join(map(repr, _DIRECTIONS))}",
            )
        band = non_negative("dead_band", self.dead_band, "m/s or rad/s")
        object.__setattr__(self, "dead_band", band)
