"""Bounds of what series of pulses can do, without a linear programme."""

import cmath
import math

import numpy as np

from stickslip.planning.series.programme import Programme
from stickslip.plants import FlexibleArm

__all__ = ["overshoots", "swing_time"]

_BREAKING_AWAY = 64  # first pulses looked at
_ROUNDING = 1e-9  # of the way


def swing_time(arm: FlexibleArm, start: tuple[float, float, float, float], way: float) -> float:
    """Return how long it takes at least to still mass 2, whatever the effort; inf if for ever [s].

    With w = sqrt(ks/m2), the swing z = x2 - x1 + i v2/w obeys z' = -i w z - v1, so that z ends at 0
    after a time t if the integral of v1(s)/d exp(i w s) over it is z(0)/d. While mass 1 only moves
    forward, over the way d, that is a mean of points on the arc exp(i w s), 0 <= s <= t. The arc
    and its chord from 1 to exp(i w t) enclose all such means; as t grows, the chord sweeps over
    each point in the unit disc once.

    Parameters
    ----------
    arm
        Masses and spring.
    start
        State at the begin.
    way
        Of mass 1 [m or rad].
    """
    frequency = math.sqrt(arm.stiffness / arm.mass_2)
    mean = complex(start[2] - start[0], start[3] / frequency) / way
    if abs(mean) >= 1.0:
        return math.inf
    chord = mean - 1.0
    end = 1.0 - 2.0 * chord.real / abs(chord) ** 2 * chord
    return (cmath.phase(end) % (2.0 * math.pi)) / frequency


def overshoots(programme: Programme) -> bool:
    """Tell whether the least effort that frees mass 1 takes it too far already.

    It goes too far if, freed by that and then braked by all there is, it passes the target; as long
    as the position answers an impulse on mass 1 forward, no other efforts keep it farther behind.
    It also does if what mass 2 swings then is more than the way that is left could still (see
    `swing_time`): the integral over the first way a is a to within a w t.
    """
    arm, motion = programme.motion.arm, programme.motion
    effort = np.full(min(programme.pulses, _BREAKING_AWAY), -programme.effort_limit)
    effort[0] = programme.lowest[0]
    states = motion.states(np.repeat(effort, programme.steps_per_pulse))
    backward = np.flatnonzero(np.diff(motion.forced[: states.shape[0], 0]) < 0.0)
    known = states[: backward[0] + 1 if backward.size else None, 0]
    frequency = math.sqrt(arm.stiffness / arm.mass_2)
    # Every instant is a bound of its own: the farther it goes, the later.
    angle = frequency * motion.step * np.arange(known.size)
    swing = complex(motion.start[2] - motion.start[0], motion.start[3] / frequency)
    needed = np.maximum(known, known + np.abs(swing - known) - angle * programme.target)
    return bool(needed.max() > programme.target * (1.0 + _ROUNDING))
