"""When and to what the integral of a PID controller is reset, so that friction costs less time."""

from dataclasses import dataclass
from typing import Literal

from stickslip.compiled import compiled
from stickslip.records import InputError, positive, quantity_field

__all__ = ["COULOMB", "NO_RESET", "STRIBECK", "ResetIntegral", "reset"]

NO_RESET, COULOMB, STRIBECK = 0.0, 1.0, 2.0


@compiled(inline=True)
def reset(
    law: float, alpha: float, band: float, armed: float, u_p: float, u_i: float,
    e: float, e_last: float, moving: bool, stopped: bool,
) -> tuple[float, float]:  # fmt: skip
    """Return the integral action and the logic state after the reset that is due, if any.

    With phi = u_p + u_i, the force of proportional and integral action:

    Coulomb law: the mass has stopped and phi points away from the target, phi e < 0, because the
    integral is still that of the approach: phi+ = -alpha phi.

    Stribeck law, of which the logic state b says which reset is next: b = 1, the error crosses
    zero while the mass moves: phi+ = -phi, b+ = -1, so that the force brakes; b = -1, the mass
    stops: u_i+ = 0, b+ = 1.
    """
    if law == COULOMB:
        if stopped and abs(e) > band and (u_p + u_i) * e < 0.0:
            u_i = -alpha * (u_p + u_i) - u_p
    elif law == STRIBECK:
        if armed > 0.0:
            if moving and e * e_last < 0.0:
                u_i = -(u_p + u_i) - u_p
                armed = -1.0
        elif stopped:
            u_i = 0.0
            armed = 1.0
    return u_i, armed


@dataclass(frozen=True, kw_only=True)
class ResetIntegral:
    """Resets of a PID controller's integral action on an axis with friction.

    A mass that has overshot sticks until the integral action, which still pushes the way of the
    approach, has been emptied and filled again the other way. Let phi be the sum of proportional
    and integral action.

    ``law="coulomb"``: when the mass has stopped beyond its target and phi points away from it, phi
    becomes ``-factor * phi`` (Beerens, Bisoffi, Zaccarian, Heemels, Nijmeijer, van de Wouw, "Reset
    integral control for improved settling of PID-based motion systems with friction", Automatica
    107, 2019). It shortens the rests; where static friction exceeds Coulomb friction the axis hunts
    as without it, only faster.

    ``law="stribeck"``: when the error crosses zero, phi changes its sign, which brakes; when the
    mass has then stopped, the integral action becomes zero (the same authors, "Reset PID design for
    motion systems with Stribeck friction", IEEE Transactions on Control Systems Technology, 2021).

    Both laws are of continuous time, with the velocity known. Here a crossing is seen at the first
    sample after it, and a stop when the controller's velocity has changed its sign or stayed within
    ``rest_speed`` for ``rest_samples`` samples.

    Attributes
    ----------
    law
        ``"coulomb"`` or ``"stribeck"``.
    rest_speed
        Largest velocity taken for rest [m/s or rad/s]; above the noise of the controller's
        velocity.
    rest_samples
        So many samples within it are a rest, 1 at least.
    factor
        Of the law for Coulomb friction [-], 0 to 1.

    Raises
    ------
    InputError
        If a value is out of its range.

    Examples
    --------
    >>> ResetIntegral(law="stribeck", rest_speed=1e-3, rest_samples=2).factor
    1.0
    """

    law: Literal["coulomb", "stribeck"]
    rest_speed: float = quantity_field("velocity")
    rest_samples: int
    factor: float = 1.0

    def __post_init__(self) -> None:
        if self.law not in ("coulomb", "stribeck"):
            raise InputError(f"law is {self.law!r}", remedy="give 'coulomb' or 'stribeck'")
        speed = positive("rest_speed", self.rest_speed, "m/s or rad/s")
        object.__setattr__(self, "rest_speed", speed)
        if not self.rest_samples >= 1:
            raise InputError(
                f"rest_samples is {self.rest_samples}, it must be at least 1",
                remedy="give the number of samples at rest after which the mass counts as stopped",
            )
        if not 0.0 <= self.factor <= 1.0:
            raise InputError(
                f"factor is {self.factor:g} (no unit), it must be 0 to 1", remedy="leave it at 1"
            )
