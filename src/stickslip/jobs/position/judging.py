"""How a move ended, by the truth and by what the controller says of it."""

import numpy as np
from jaxtyping import Float

from stickslip.records import Ending, PositioningOutcome

__all__ = ["ending", "hunts", "settling_time"]

_LEAST_STAY = 10
"""Samples within the tolerance that end a move as settled: an axis that flies through does not."""

_REVERSALS = 2
"""Changes of the error's sign that make a to and fro; one is an overshoot."""

_REST = 0.25
"""Share of a move, at its end, without any motion, that makes it a rest."""


def settling_time(
    time: Float[np.ndarray, " n"], error: Float[np.ndarray, " n"], tolerance: float
) -> float | None:
    """Return how long it took until the error was within the tolerance for good.

    Parameters
    ----------
    time
        Sample instants of a move [s].
    error
        The true one [m or rad].
    tolerance
        [m or rad].

    Returns
    -------
    Time from the first sample [s]; None if it is never so for the last samples.
    """
    outside = np.flatnonzero(np.abs(error) > tolerance)
    if not outside.size:
        return 0.0
    inside_from = int(outside[-1]) + 1
    if error.size - inside_from < min(_LEAST_STAY, error.size):
        return None
    return float(time[inside_from] - time[0])


def hunts(error: Float[np.ndarray, " n"], tolerance: float) -> bool:
    """Return whether an axis goes to and fro across its target and does not settle.

    Parameters
    ----------
    error
        The true one over a whole move [m or rad]; the last half of it counts.
    tolerance
        [m or rad].
    """
    late = error[error.size // 2 :]
    if settling_time(late, late, tolerance) is not None:
        return False
    signs = np.sign(late[late != 0.0])
    return int(np.count_nonzero(np.diff(signs))) >= _REVERSALS


def ending(
    error: Float[np.ndarray, " n"], tolerance: float, outcome: PositioningOutcome | None
) -> Ending:
    """Return how a move ended.

    Parameters
    ----------
    error
        The true one over the whole move [m or rad].
    tolerance
        [m or rad].
    outcome
        What the controller says at its end; None for one that says nothing.
    """
    if settling_time(error, error, tolerance) is not None:
        return Ending.REACHED
    if hunts(error, tolerance):
        return Ending.HUNTING
    if outcome is PositioningOutcome.STOPPED:
        return Ending.STOPPED
    if outcome is PositioningOutcome.REACHED:
        return Ending.MISJUDGED
    late = error[-max(2, int(_REST * error.size)) :]
    return Ending.STUCK if np.all(late == late[-1]) else Ending.UNDER_WAY
