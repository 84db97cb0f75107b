"""Proportional and derivative action."""

from dataclasses import dataclass

from stickslip.compiled import compiled
from stickslip.records import non_negative, positive

__all__ = ["PD", "pd_effort"]


@compiled(inline=True)
def pd_effort(K_p: float, K_d: float, r: float, x: float, r_dot: float, x_dot: float) -> float:
    """Return u = K_p (r - x) + K_d (r' - x') (van de Wijdeven 2002 A section 6.2)."""
    return K_p * (r - x) + K_d * (r_dot - x_dot)


@dataclass(frozen=True, kw_only=True)
class PD:
    """Proportional and derivative action on the errors of position and velocity.

    Both act on the driven mass: ``u = position_gain (r - x) + velocity_gain (r' - x')``. The
    velocity is the one that the sensors show, so nothing is differentiated here.

    Attributes
    ----------
    position_gain
        [N/m or N m/rad], positive.
    velocity_gain
        [N s/m or N m s/rad], not negative.

    Raises
    ------
    InputError
        If a gain is not finite or out of its range.

    Examples
    --------
    >>> PD(position_gain=2.0, velocity_gain=3.0).velocity_gain
    3.0
    """

    position_gain: float
    velocity_gain: float

    def __post_init__(self) -> None:
        object.__setattr__(
            self,
            "position_gain",
            positive("position_gain", self.position_gain, "N/m or N m/rad"),
        )
        object.__setattr__(
            self,
            "velocity_gain",
            non_negative("velocity_gain", self.velocity_gain, "N s/m or N m s/rad"),
        )
