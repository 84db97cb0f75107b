"""What the kernels of all plants keep of the events inside a sample."""

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled

__all__ = ["GRAZING", "record_event"]

GRAZING = 1  # flag of a sample: the outcome of an event was too close to call


@compiled()
def record_event(
    event_time: NDArray[np.float64], event_mode: NDArray[np.int8], count: int, time: float,
    mode: int,
) -> int:  # fmt: skip
    """Write an event (its time, the mode after it) at ``count``, if there is room; return the next.

    Events beyond the room are counted all the same, so that the caller knows how much is needed.
    """
    if count < event_time.size:
        event_time[count] = time
        event_mode[count] = mode
    return count + 1
