"""The stretches of a log in which an axis moves one way, and which of them are the same move."""

from itertools import pairwise

import numpy as np
from jaxtyping import Int

from stickslip.estimation.regression.law_selection.smooth_motion import RowSettings, SmoothMotion
from stickslip.records import AxisLog

__all__ = ["find_moves", "kinds_of", "stretches"]

_LEAST_WAY = 0.02
"""Way of a move, as a share of the range of positions: less is noise, or a rest that wobbles."""

_ALIKE = 0.05
"""Moves whose ends differ by less than this share of the range are repetitions of one move."""


def find_moves(log: AxisLog, rows: RowSettings | None = None) -> tuple[tuple[int, int], ...]:
    """Return first and last but one sample of each stretch that goes one way without a stop.

    Parameters
    ----------
    log
        Without gaps.
    rows
        How its motion is smoothed.
    """
    return stretches((rows or RowSettings()).motion(log))


def stretches(motion: SmoothMotion) -> tuple[tuple[int, int], ...]:
    """Return first and last but one sample of each stretch of a motion."""
    v = motion.velocity
    way = np.where(np.abs(v) > motion.slow, np.sign(v), 0.0)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(way)) + 1, [v.size]])
    least = _LEAST_WAY * float(np.ptp(motion.position))
    return tuple(
        (start, stop)
        for start, stop in pairwise(edges.tolist())
        if way[start] != 0 and abs(motion.position[stop - 1] - motion.position[start]) > least
    )


def kinds_of(motion: SmoothMotion, found: tuple[tuple[int, int], ...]) -> Int[np.ndarray, " moves"]:
    """Return the number of the kind that each move is of.

    Moves are of a kind if they begin and end at the same places. A motion that is recorded several
    times over teaches nothing new: a law that has memorised one repetition does well on the next.
    """
    alike = _ALIKE * float(np.ptp(motion.position))
    ends: list[tuple[float, float]] = []
    numbers: list[int] = []
    for start, stop in found:
        own = float(motion.position[start]), float(motion.position[stop - 1])
        same = [
            k for k, known in enumerate(ends)
            if max(abs(known[0] - own[0]), abs(known[1] - own[1])) < alike
        ]  # fmt: skip
        if not same:
            ends.append(own)
        numbers.append(same[0] if same else len(ends) - 1)
    return np.array(numbers, dtype=np.int64)
