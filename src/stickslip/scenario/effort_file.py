"""Read an effort from a CSV file: time stamps and the effort held from each."""

import csv
from pathlib import Path

import numpy as np
from jaxtyping import Float

from stickslip.records import InputError

__all__ = ["read_effort"]

_UNEVEN = 1e-3  # of a step: time stamps are rounded when they are written


def read_effort(path: Path) -> tuple[Float[np.ndarray, " n"], float]:
    """Read what `stickslip.tasks.write_effort` has written.

    Parameters
    ----------
    path
        The file: a heading, then time stamps [s] in the first column and the effort [N or N m] in
        the last.

    Returns
    -------
    The effort, and the sampling time [s].

    Raises
    ------
    InputError
        If it is missing or is no such file.
    """
    where, remedy = str(path), "give a file of stickslip excite: time [s], effort"
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            rows = [row for row in csv.reader(stream) if row]
        table = np.array([[float(row[0]), float(row[-1])] for row in rows[1:]])
    except FileNotFoundError:
        raise InputError(
            "there is no such file of efforts", where=where, remedy="check the path"
        ) from None
    except OSError as error:
        raise InputError(
            f"the efforts cannot be read ({error.strerror})", where=where, remedy=remedy
        ) from error
    except (ValueError, csv.Error) as error:
        raise InputError(
            f"the efforts are not numbers ({error})", where=where, remedy=remedy
        ) from None
    if len(table) < 2 or not np.all(np.isfinite(table)):
        raise InputError(
            "the file holds no two finite samples of effort", where=where, remedy=remedy
        )
    steps = np.diff(table[:, 0])
    step = float(np.mean(steps))
    if step <= 0 or np.max(np.abs(steps - step)) > _UNEVEN * step:
        raise InputError("the time stamps are not evenly spaced", where=where, remedy=remedy)
    return table[:, 1], step
