"""How a move ended, by the truth and by what the controller says of it."""

import numpy as np
from jaxtyping import Float

from stickslip.jobs.reversals import hunts
from stickslip.records import Ending, PositioningOutcome

__all__ = ["ending", "settling_time"]

_LEAST_STAY = 10
"""Samples within the tolerance that end a move as settled: an axis that flies through does not."""

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
    sample = _settled(error, tolerance)
    return None if sample is None else float(time[sample] - time[0])


def _settled(error: Float[np.ndarray, " n"], tolerance: float) -> int | None:
    """Return the sample from which on the error is within the tolerance for good, if any."""
    outside = np.flatnonzero(np.abs(error) > tolerance)
    sample = int(outside[-1]) + 1 if outside.size else 0
    return sample if error.size - sample >= _LEAST_STAY else None


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
    if _settled(error, tolerance) is not None:
        return Ending.REACHED
    if hunts(error[error.size // 2 :], tolerance):
        return Ending.HUNTING
    if outcome is PositioningOutcome.STOPPED:
        return Ending.STOPPED
    if outcome is PositioningOutcome.REACHED:
        return Ending.MISJUDGED
    late = error[-max(2, int(_REST * error.size)) :]
    return Ending.STUCK if np.all(late == late[-1]) else Ending.UNDER_WAY
