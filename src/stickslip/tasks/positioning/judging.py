"""Ending of a move, by the true error and by the outcome that the controller reports."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.records import Ending, PositioningOutcome

Values = Float[np.ndarray, " n"]


@dataclass(frozen=True, kw_only=True)
class EndingTuning:
    """Tuning of the verdict on a move.

    Sensitivities are numbers of verdicts that change at half and at twice the value: of 1024 moves
    cut off at random instants, which are the moves of the example scenarios with three tolerances.
    None of the 164 whole moves changes at either value.
    """

    least_stay: int = 10
    """Samples within the tolerance that settle a move, the last of them at rest [-]. 11, 22."""
    stay: float = 0.1
    """Share of a move within the tolerance that settles an axis which does not rest [-]: one that
    flies through at its end has not arrived. 0, 4."""
    rest: float = 0.25
    """Share of a move, at its end, without any motion, that makes it a rest [-]. 3, 0."""
    fewest_reversals: int = 2
    """Reversals that make a cycle [-]; one corrects an overshoot. 15, 56."""


TUNING = EndingTuning()


def settling_time(
    time: Values, error: Values, tolerance: float, *, rest_motion: float = 0.0
) -> float | None:
    """Return the time until the true error [m or rad] was within the tolerance for good [s].

    None if it never is: if at the end the axis is outside, or moves and has only just come in.
    ``rest_motion`` is the largest motion of an axis at rest [m or rad].
    """
    sample = _settled(error, tolerance, rest_motion)
    return None if sample is None else float(time[sample] - time[0])


def _settled(error: Values, tolerance: float, rest_motion: float = 0.0) -> int | None:
    """Return the sample from which on the error is within the tolerance for good, if any."""
    outside = np.flatnonzero(np.abs(error) > tolerance)
    sample = int(outside[-1]) + 1 if outside.size else 0
    stays = error.size - sample
    if stays >= max(TUNING.least_stay, TUNING.stay * error.size):
        return sample
    return (
        sample
        if stays >= TUNING.least_stay and _rests(error[-TUNING.least_stay :], rest_motion)
        else None
    )


def _rests(error: Values, rest_motion: float) -> bool:
    """Return whether an axis moves no farther than one at rest."""
    return bool(np.ptp(error) <= rest_motion)


def ending(
    error: Values,
    tolerance: float,
    outcome: PositioningOutcome | None,
    *,
    integrates: bool = False,
    rest_motion: float = 0.0,
) -> Ending:
    """Return the ending of a move, by the true error over the whole move [m or rad].

    ``integrates`` is whether the effort grows while the axis rests outside the tolerance, and so
    frees it in the end; ``rest_motion`` is the largest motion of an axis at rest [m or rad].
    """
    if _settled(error, tolerance, rest_motion) is not None:
        return Ending.REACHED
    if hunts(error[error.size // 2 :], tolerance) or (
        integrates and _sticks_and_slips(error, tolerance, rest_motion)
    ):
        return Ending.HUNTING
    if outcome is PositioningOutcome.STOPPED:
        return Ending.STOPPED
    if outcome is PositioningOutcome.REACHED and abs(error[-1]) > tolerance:
        return Ending.MISJUDGED
    late = error[-max(2, int(TUNING.rest * error.size)) :]
    return Ending.STUCK if _rests(late, rest_motion) and not integrates else Ending.UNDER_WAY


def arm_ending(
    error: Values, driven: Values, tolerance: float, outcome: PositioningOutcome | None
) -> Ending:
    """Return the ending of a move of a flexible arm.

    ``error`` is the true one of the mass that is farther from the target, and ``driven`` that of
    mass 1, over the whole move [m or rad].
    """
    if _settled(error, tolerance) is not None:
        return Ending.REACHED
    if outcome is PositioningOutcome.STOPPED:
        return Ending.STOPPED
    # A landing reverses and rests on purpose; it cannot do so for ever
    if outcome is not None:
        outside = np.max(np.abs(error[-TUNING.least_stay :])) > tolerance
        wrong = outcome is PositioningOutcome.REACHED and outside
        return Ending.MISJUDGED if wrong else Ending.UNDER_WAY
    if hunts(driven[driven.size // 2 :], tolerance):
        return Ending.HUNTING
    late = driven[-max(2, int(TUNING.rest * driven.size)) :]
    if not _rests(late, 0.0):
        return Ending.UNDER_WAY
    return Ending.SWINGING if abs(late[-1]) <= tolerance else Ending.STUCK


def _sticks_and_slips(error: Values, tolerance: float, rest_motion: float) -> bool:
    """Return whether an axis, once it was at its target, rested outside and reversed again.

    Its rests may last longer than the remainder of the move.
    """
    there = np.flatnonzero(np.sign(error) != np.sign(error[0]))
    since = error[int(there[0]) - 1 :] if there.size else error[-1:]
    held = (np.abs(np.diff(since)) * TUNING.least_stay <= rest_motion) & (
        np.abs(since[1:]) > tolerance
    )
    moves_on = np.flatnonzero(~np.concatenate(([False], held, [False])))
    return bool(np.max(np.diff(moves_on)) > TUNING.least_stay) and hunts(since, tolerance)


def hunts(position: Values, tolerance: float) -> bool:
    """Return whether a motion that should have ended goes to and fro [m or rad]."""
    return reversals(position, tolerance) >= TUNING.fewest_reversals


def reversals(position: Values, least: float) -> int:
    """Return the number of reversals of a motion [m or rad].

    A path back counts from ``least`` > 0 on, from the farthest point before it; so does the first
    path.
    """
    moved = position[np.flatnonzero(np.diff(position)) + 1]
    turns, direction = 0, 0
    low = high = float(position[0])
    for x in moved.tolist():
        low, high = min(low, x), max(high, x)
        if direction >= 0 and high - x >= least:
            turns += direction
            direction, low, high = -1, x, x
        elif direction <= 0 and x - low >= least:
            turns -= direction
            direction, low, high = 1, x, x
    return turns
