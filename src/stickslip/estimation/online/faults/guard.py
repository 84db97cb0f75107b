"""Last valid state of an online estimator.

An estimator that consists of one vector keeps a copy of its own part of it, every `_INTERVAL`
samples, as long as all numbers are finite. If an estimate is not finite after a step, the copy
replaces them and the reset is counted. The motion then begins again, which is the estimator's task.

The guard is a field of the estimator's state, behind the numbers that it keeps.
"""

from typing import Any

import numpy as np

from stickslip.compiled import compiled
from stickslip.estimation.online.faults.admission import IMPOSSIBLE
from stickslip.estimation.online.method import State

_INTERVAL = 64
"""Samples from one copy to the next. A reset loses what was learned in so many; a copy of some 60
numbers in every sample would take longer than the step."""


def guard_dtype(own: int) -> np.dtype[Any]:
    """Return the fields of the guard of a state whose first ``own`` numbers it keeps."""
    return np.dtype(
        [
            ("resets", "i8"),
            ("since", "i8"),  # samples since the last copy
            ("kept", "f8", (own,)),  # last valid numbers
        ]
    )


def set_guard(state: State, guard: Any) -> None:
    """Store the numbers of a first state as valid."""
    guard.kept[:] = state[: guard.kept.size]


@compiled(inline=True)
def keep_state(state: State, guard: Any) -> bool:
    """Copy the numbers of the state if all are finite; return whether they are."""
    own = guard.kept.size
    finite = True
    for i in range(own):
        finite &= np.isfinite(state[i])
    if finite:
        for i in range(own):
            guard.kept[i] = state[i]
        guard.since = 0
    return finite


@compiled(inline=True)
def restore_state(state: State, guard: Any) -> None:
    """Restore the copy and count the reset."""
    for i in range(guard.kept.size):
        state[i] = guard.kept[i]
    guard.resets += 1
    guard.since = 0


@compiled(inline=True)
def stays_valid(state: State, guard: Any, first: int, p: int) -> bool:
    """Return whether p estimates from ``first`` on are valid after a sample.

    If not, the copy is restored.
    """
    valid = True
    for i in range(p):
        valid = valid and abs(state[first + i]) <= IMPOSSIBLE  # False for NaN
    guard.since += 1
    if valid and guard.since >= _INTERVAL:
        valid = keep_state(state, guard)
    if not valid:
        restore_state(state, guard)
    return valid
