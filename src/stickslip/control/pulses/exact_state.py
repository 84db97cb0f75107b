"""State of the exact pulse controller, and the law of friction that it has learned."""

import math
from typing import Any

import numpy as np

from stickslip.compiled import compiled
from stickslip.control.pulses.kernel import OWN
from stickslip.numerics.named_fields import fields_at

PARAMETERS = 5  # logarithms of m, F+, F-, c+, c-
COULOMB, VISCOUS = 1, 3  # of the positive direction; that of the negative follows
NO_BETTER, EXHAUSTED, HELD_FAST = 1, 2, 3  # reasons to stop

OWN_DTYPE = np.dtype(
    [
        # Settings
        ("period", "f8"),  # sampling time
        ("limit", "f8"),  # of the effort
        ("longest", "f8"),  # most samples in one pulse
        ("noise", "f8"),  # standard deviation of a sampled position
        ("rest_noise", "f8"),  # of the position at rest
        ("max_idle_pulses", "f8"),  # pulses in a row that may bring nothing
        # What changes
        ("walk", "f8"),  # variance by which log F+, F-, c+ and c- walk from pulse to pulse
        ("breakaway", "f8", (2,)),  # estimated, for each direction
        ("held", "f8", (2,)),  # strongest effort that did not free the mass, or Coulomb friction
        ("moved_at", "f8", (2,)),  # weakest effort that freed it
        ("best", "f8"),  # smallest error at rest so far
        ("half_error", "f8"),  # half of what the error was when it was last halved
        ("fruitless", "i8"),  # pulses since then
        ("reason", "i8"),  # why no pulse is fired any more
        ("more", "f8"),  # samples of the shortest pulse beyond one, where shorter ones free nothing
        ("share", "f8", (2,)),  # achieved over predicted displacement, where the law fails
        ("lag", "f8"),  # of the effort behind the command
        ("taught", "i8"),  # 1 if something else than pulses has taught it
        ("vibrates", "i8"),  # 1 if what swings on the axis may hold it, or free it
        ("by_moves", "f8", (PARAMETERS,)),  # values after the last move that the law explains
        ("allowed", "f8"),  # most samples of the next pulse
        ("values", "f8", (PARAMETERS,)),
        ("covariance", "f8", (PARAMETERS, PARAMETERS)),
    ]
)
own_fields = fields_at(OWN_DTYPE, start=OWN)

DIFFERENCE = 1e-6  # of a logarithm, for slopes
STRONGER = 1.5  # times an effort that did not free the mass: the next
WIDEST = 4.0  # samples, at which the fewest samples of a pulse end


@compiled()
def law_of(own: Any, side: int) -> tuple[float, float, float]:
    """Return the estimates of m, F and c in one direction."""
    return (
        math.exp(own.values[0]),
        math.exp(own.values[COULOMB + side]),
        math.exp(own.values[VISCOUS + side]),
    )


@compiled()
def last_pulse(s: Any, own: Any) -> tuple[int, float, float]:
    """Return the direction of the last pulse (0: positive), its effort and its width."""
    f = s.last.levels[0, 0]
    return 0 if f > 0.0 else 1, f, s.last.levels[0, 1] * own.period
