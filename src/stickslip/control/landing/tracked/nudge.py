"""A pulse that takes mass 1 alone to the target, while mass 2 rests on it or passes it slowly."""

from math import ceil, hypot
from typing import Literal

import numpy as np

from stickslip.control.landing.arm_belief import Swing
from stickslip.control.landing.tuning import TRACKING
from stickslip.planning import PulseLaw


def moment(swing: Swing, error: float, tolerance: float) -> Literal["now", "later", "never"]:
    """Return when mass 2 is near enough to the target for it.

    Parameters
    ----------
    swing
        Of mass 2 about mass 1, at this time.
    error
        Way of mass 1 to the target [m or rad].
    tolerance
        [m or rad].
    """
    rate = swing.velocity / swing.frequency
    load = hypot(swing.offset - error, rate)  # mass 2 from the target
    least = abs(swing.amplitude - abs(error))  # once in a period
    leaves = rate * error < 0.0
    beside, wide = TRACKING.nudge_beside * tolerance, 0.5 * abs(error)
    close = max(0.5 * beside, least + TRACKING.nudge_passing * abs(error))
    if least > max(beside, wide):
        return "never"
    return "now" if load <= (max(beside, wide) if leaves else close) else "later"


def nudge(
    law: PulseLaw, error: float, *, sampling_time: float, limits: tuple[float, float], frees: float
) -> tuple[int, float, bool]:
    """Return samples and effort of the pulse, and whether it frees mass 1 for certain.

    Parameters
    ----------
    law
        Of a pulse on mass 1 without viscous friction.
    error
        Way of mass 1 to the target [m or rad].
    sampling_time
        [s].
    limits
        Of the effort, in a plan and of the drive [N or N m].
    frees
        Effort that frees mass 1 [N or N m].
    """
    planned, largest = limits
    samples = max(1, ceil(float(law.width_for(abs(error), effort=planned)) / sampling_time))
    ways = abs(error) * np.array([1.0, TRACKING.overshoot])
    needed, most = law.effort_for(ways, width=samples * sampling_time).tolist()
    effort = min(max(needed, min(frees, most)), largest)
    return samples, effort if error > 0.0 else -effort, most >= frees
