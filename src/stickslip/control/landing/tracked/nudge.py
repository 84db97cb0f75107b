"""A pulse that takes mass 1 alone to the target, while mass 2 rests on it or passes it slowly."""

from math import ceil, hypot
from typing import Literal

import numpy as np

from stickslip.control.landing.arm_belief import Swing
from stickslip.control.landing.tuning import TRACKING
from stickslip.planning import PulseLaw


def moment(swing: Swing, error: float, tolerance: float) -> Literal["now", "later", "never"]:
    """Return when mass 2 is near enough to the target for it.

    ``swing`` is that of mass 2 about mass 1 at this time, and ``error`` the way of mass 1 to the
    target [m or rad].
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
    law: PulseLaw,
    error: float,
    *,
    sampling_time: float,
    limits: tuple[float, float],
    frees: float,
    farthest: float,
) -> tuple[int, float, float, bool]:
    """Return samples, effort and way of the pulse, and whether it frees mass 1 for certain.

    Where the effort that leads to the target may not free mass 1, the pulse leads beyond it, as far
    as another one comes back for certain, and at most by ``farthest`` [m or rad]. ``law`` is that
    of a pulse on mass 1 without viscous friction, ``error`` the way of mass 1 to the target [m or
    rad]. ``limits`` of the effort hold in a plan and for the drive, and the effort ``frees`` moves
    mass 1 in any case [N or N m].
    """
    planned, largest = limits
    way = abs(error)
    samples, needed, most = _pulse(law, way, sampling_time, planned)
    if needed < frees < planned:
        least = float(law.displacement(frees, width=sampling_time))
        beyond = way + TRACKING.nudge_return * least
        if beyond <= farthest:
            samples, needed, most = _pulse(law, beyond, sampling_time, planned)
    effort = min(max(needed, min(frees, most)), largest)
    goes = float(law.displacement(effort, width=samples * sampling_time))
    sign = 1.0 if error > 0.0 else -1.0
    return samples, sign * effort, sign * goes, most >= frees


def scaled(scale: float, planned: float, moved: float) -> float:
    """Return the way of pulses over that by their law after one that was planned and has moved."""
    (low, high), ratio = TRACKING.nudge_scales, moved / planned
    if ratio <= 0.0:
        return scale
    return min(max(scale * ratio**TRACKING.nudge_learning, low), high)


def _pulse(
    law: PulseLaw, way: float, sampling_time: float, planned: float
) -> tuple[int, float, float]:
    """Return samples and effort of a pulse over a way, and the most it may take."""
    samples = max(1, ceil(float(law.width_for(way, effort=planned)) / sampling_time))
    ways = way * np.array([1.0, TRACKING.overshoot])
    needed, most = law.effort_for(ways, width=samples * sampling_time).tolist()
    return samples, needed, most
