"""Let mass 1 rest on the way, where it would only creep.

A series of least time or effort often lets mass 1 wait while mass 2 swings over. Planned as slow
motion the effort there just balances friction, and an error of friction grows all the while.
Resting, mass 1 is held by static friction with an effort in the middle of what holds it: what is
left of an error is what it did before the rest, and the swing meets mass 1 where it is.
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from stickslip.planning.arm_motion import resting_motion
from stickslip.planning.move import FEWEST_PULSES, Move
from stickslip.planning.programme import Programme, Solution, landed
from stickslip.planning.tuning import TUNING


class Rest(NamedTuple):
    """A series in two parts, with a rest of mass 1 between them."""

    effort: Float[np.ndarray, " n"]  # of every pulse [N or N m]
    states: Float[np.ndarray, "k 4"]  # at every step
    begin: int  # first pulse of the rest
    end: int  # first pulse after it


def with_rest(move: Move, programme: Programme, solution: Solution, gap: float) -> Rest | None:
    """Return the series with its longest creeping made a rest; None if there is none to make.

    A rest near the begin is none: what followed it could be planned with the same rest for ever.
    ``gap`` is that of the impulse of the second part.
    """
    effort = landed(programme, solution)
    states = programme.states(effort)
    each = programme.steps_per_pulse
    speed = states[::each, 1]
    creeping = _longest(speed < TUNING.creep_share * speed.max())
    if creeping is None:
        return None
    first, last = creeping
    brief = TUNING.min_rest / math.sqrt(move.arm.stiffness / move.arm.mass_2) / move.pulse_width
    if last - first < max(TUNING.min_rest_pulses, brief):
        return None
    if states[first * each, 0] < TUNING.least_before_rest * move.travel:
        return None
    tried = 0
    for begin in range(first, last - TUNING.min_rest_pulses):
        stopped = _stopped(move, programme, effort[:begin])
        if stopped is None:
            continue
        tried += 1
        found = _second_part(move, programme, stopped, last, gap)
        if found is not None or tried == TUNING.rest_trials:
            return found
    return None


def _second_part(
    move: Move, programme: Programme, stopped: Float[np.ndarray, " p"], last: int, gap: float
) -> Rest | None:
    """Return the series that rests once it has stopped; None if there is no second part."""
    each, first = programme.steps_per_pulse, stopped.size
    before = programme.states(stopped)
    earliest = max(first + TUNING.min_rest_pulses, last - TUNING.earlier_pulses)
    for end in range(last, earliest - 1, -1):
        resting = resting_motion(
            move.arm,
            move.losses,
            sampling_time=programme.motion.step,
            start=before[-1],
            samples=(end - first) * each,
        )
        held = _holding(move, resting, each)
        if held is None or programme.pulses - end < FEWEST_PULSES:
            continue
        x1 = float(resting[-1, 0])
        second_move = replace(
            move,
            start=(0.0, 0.0, float(resting[-1, 2]) - x1, float(resting[-1, 3])),
            travel=move.travel - x1,
        )
        after = second_move.solved(programme.pulses - end, gap=gap)
        if after.effort is not None:
            second = second_move.programme(programme.pulses - end)
            ending = landed(second, after)
            if second.minima(ending)[:, 2].min(initial=np.inf) <= 0.0:
                continue
            ahead = second.states(ending) + np.array([x1, 0.0, x1, 0.0])
            effort = np.concatenate([stopped, held, ending])
            return Rest(effort, np.vstack([before[:-1], resting[:-1], ahead]), first, end)
    return None


def _stopped(
    move: Move, programme: Programme, effort: Float[np.ndarray, " p"]
) -> Float[np.ndarray, " p"] | None:
    """Return the efforts with the last one so that mass 1 stops at its end; None if it cannot."""
    stop = effort.copy()
    gain = float(programme.motion.forced[programme.steps_per_pulse, 1])
    stop[-1] -= programme.states(stop)[-1, 1] / gain
    # Braking by more than friction alone, mass 1 neither turns back before nor goes on after it.
    if abs(stop[-1]) > move.effort_limit or programme.minima(stop)[:, 2].min(initial=0.0) < 0.0:
        return None
    return stop


def _longest(slow: np.ndarray) -> tuple[int, int] | None:
    """Return the first and the last of the longest run of slow instants between the ends."""
    padded = np.concatenate([[0], slow[1:-1].astype(np.int8), [0]])
    turns = np.diff(padded)
    begins, ends = np.flatnonzero(turns == 1), np.flatnonzero(turns == -1)
    if begins.size == 0:
        return None
    k = int(np.argmax(ends - begins))
    return int(begins[k]) + 1, int(ends[k])


def _holding(
    move: Move, states: Float[np.ndarray, "k 4"], each: int
) -> Float[np.ndarray, " p"] | None:
    """Return an effort for each pulse in the middle of what holds mass 1; None if none does."""
    law = move.arm.friction
    spring = move.arm.stiffness * (states[:, 0] - states[:, 2])
    spring -= move.losses.damping * states[:, 3]
    pulses = (spring.size - 1) // each
    within = np.lib.stride_tricks.sliding_window_view(spring, each + 1)[::each]
    low, high = within.min(axis=1), within.max(axis=1)
    middle = 0.5 * (low + high) + law.offset
    effort = np.clip(middle, -move.effort_limit, move.effort_limit)[:pulses]
    backward = (high + law.offset - effort).max(initial=0.0)
    forward = (effort - law.offset - low).max(initial=0.0)
    held = (
        backward <= TUNING.held_share * law.static_friction_negative
        and forward <= TUNING.held_share * law.static_friction_positive
    )
    return effort if held else None
