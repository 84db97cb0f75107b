"""Last valid state of an online estimator.

An estimator that consists of one vector keeps a copy of its own part of it, every `_INTERVAL`
samples, as long as all numbers are finite. If an estimate is not finite after a step, the copy
replaces them and the reset is counted. The motion then begins again, which is the estimator's task.

The guard is a part of the estimator's state, which begins at an offset ``at``: the number of
resets, the samples since the last copy, then the copy.
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.online.faults.admission import IMPOSSIBLE

_INTERVAL = 64.0
"""Samples from one copy to the next. A reset loses what was learned in so many; a copy of some 60
numbers in every sample would take longer than the step."""

RESETS, _SINCE, _COPY = range(3)


def guard_size(own: int) -> int:
    """Return the room that the guard of a state of ``own`` numbers takes."""
    return _COPY + own


def lay_guard(s: Float[np.ndarray, " s"], at: int, own: int) -> None:
    """Take the first ``own`` numbers of a first state as the valid ones, in place."""
    s[at + _COPY : at + _COPY + own] = s[:own]


@compiled(inline=True)
def keep_state(s: Float[np.ndarray, " s"], at: int, own: int) -> bool:
    """Copy the first ``own`` numbers if all are finite; return whether they are."""
    total = 0.0
    for i in range(own):
        total += 0.0 * s[i]  # not finite if one is not
    if not np.isfinite(total):
        return False
    for i in range(own):
        s[at + _COPY + i] = s[i]
    s[at + _SINCE] = 0.0
    return True


@compiled(inline=True)
def restore_state(s: Float[np.ndarray, " s"], at: int, own: int) -> None:
    """Return to the copy, and count that."""
    for i in range(own):
        s[i] = s[at + _COPY + i]
    s[at + RESETS] += 1.0
    s[at + _SINCE] = 0.0


@compiled(inline=True)
def stays_valid(s: Float[np.ndarray, " s"], at: int, own: int, first: int, p: int) -> bool:
    """Return whether p estimates from ``first`` on are valid after a sample.

    If not, the copy of the estimator's ``own`` numbers, the first of the state, is restored. The
    guard begins at ``at``.
    """
    valid = True
    for i in range(p):
        valid = valid and abs(s[first + i]) <= IMPOSSIBLE  # False for NaN
    s[at + _SINCE] += 1.0
    if valid and s[at + _SINCE] >= _INTERVAL:
        valid = keep_state(s, at, own)
    if not valid:
        restore_state(s, at, own)
    return valid
