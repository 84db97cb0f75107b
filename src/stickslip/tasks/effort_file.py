"""Write an effort for a drive as a CSV file: time stamps and the effort held from each."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from stickslip.outputs import whole_file
from stickslip.records import AxisKind, unit_of

__all__ = ["write_effort"]


def write_effort(
    effort: Float[np.ndarray, " n"], sampling_time: float, path: Path | str, *, kind: AxisKind
) -> Path:
    """Write an effort with its time stamps; the file appears when it is complete.

    Parameters
    ----------
    effort
        Held over each sample [N or N m].
    sampling_time
        [s].
    path
        The file to write; an existing one is replaced.
    kind
        ``"linear"`` or ``"rotary"``, for the unit in the heading.

    Raises
    ------
    InputError
        If nothing can be written there.
    """
    target = Path(path)
    with whole_file(target, what="the CSV file") as stream:
        stream.write(f"time [s],effort [{unit_of('effort', kind)}]\n")
        for k, value in enumerate(effort.tolist()):
            stream.write(f"{k * sampling_time:.9g},{value:.9g}\n")
    return target
