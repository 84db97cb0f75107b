"""The side of a transmission that values belong to, and their conversion to the other side."""

import math
from dataclasses import dataclass
from typing import Literal

from stickslip.records import AxisKind, InputError, positive

Side = Literal["motor", "joint"]

TURN = 2.0 * math.pi

# Powers of the ratio n = (motor velocity)/(joint velocity) that a joint-side value carries over
# the motor-side one: an effort n, an effort per velocity n^2, a velocity 1/n.
_POWERS = {
    "mass": 2.0,
    "inertia": 2.0,
    "coulomb_friction": 1.0,
    "static_friction": 1.0,
    "offset": 1.0,
    "viscous_friction": 2.0,
    "quadratic_friction": 3.0,
    "two_thirds_friction": 5.0 / 3.0,
    "stribeck_velocity": -1.0,
    "low_speed_friction": 1.0,
    "low_speed_velocity": -1.0,
}


@dataclass(frozen=True, kw_only=True)
class Transmission:
    """Side that an estimate is of, and the ratio between motor and joint.

    Raises
    ------
    InputError
        If the ratio is 0, a value is not finite, or the lead is not positive.
    """

    #: ``"motor"`` or ``"joint"`` (the load, or the only side of a direct drive).
    side: Side = "joint"
    #: Turns of the motor per turn of the joint [-]; None if it is not given. A negative one counts
    #: the two directions oppositely.
    gear_ratio: float | None = None
    #: Travel of a linear joint per turn of a rotary motor [m]; None for a rotary joint.
    lead: float | None = None

    def __post_init__(self) -> None:
        if self.gear_ratio is not None and not (
            math.isfinite(self.gear_ratio) and self.gear_ratio != 0.0
        ):
            raise InputError("gear_ratio_zero", name="gear_ratio", value=self.gear_ratio)
        if self.lead is not None:
            positive("lead", self.lead, "m")

    def ratio(self) -> float | None:
        """Return motor velocity over joint velocity [- or rad/m]; None if it is not given."""
        if self.gear_ratio is None and self.lead is None:
            return None
        ratio = 1.0 if self.gear_ratio is None else self.gear_ratio
        return ratio if self.lead is None else ratio * TURN / self.lead

    def kind_on(self, side: Side, kind: AxisKind) -> AxisKind:
        """Return the kind of axis on a side, for values of ``kind`` on the side given."""
        if self.lead is None or side == self.side:
            return kind
        return "rotary" if side == "motor" else "linear"


def factor(quantity: str, ratio: float, *, to: Side) -> float | None:
    """Return the factor of a value from one side to the other; None if it has no such factor.

    With the ratio n of motor velocity to joint velocity, power is equal on both sides:
    ``T_joint = n T_motor`` and ``c_joint = n^2 c_motor``. A negative ratio swaps the directions,
    which is the caller's to do; the sign stays with the offset only.
    """
    power = _POWERS.get(quantity)
    if power is None:
        return None
    size = abs(ratio) ** (power if to == "joint" else -power)
    return math.copysign(size, ratio) if quantity == "offset" else size
