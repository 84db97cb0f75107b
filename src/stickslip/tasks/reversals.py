"""Number of reversals of a motion, which distinguishes a limit cycle from a rest."""

import numpy as np
from jaxtyping import Float

__all__ = ["hunts", "reversals"]

_FEWEST = 2
"""Turns that make a cycle; one corrects an overshoot."""


def hunts(position: Float[np.ndarray, " n"], tolerance: float) -> bool:
    """Return whether a motion that should have ended goes to and fro.

    Parameters
    ----------
    position
        At all samples in which it should rest [m or rad].
    tolerance
        How long each way is at least [m or rad].
    """
    return reversals(position, tolerance) >= _FEWEST


def reversals(position: Float[np.ndarray, " n"], least: float) -> int:
    """Return how often a motion turned round.

    A way back counts from ``least`` on, from the farthest point of the way there; so does the
    first way.

    Parameters
    ----------
    position
        At all samples [m or rad].
    least
        [m or rad], positive.
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
