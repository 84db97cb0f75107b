"""Efforts for a drive as a CSV file: time stamps and the effort held from each."""

import csv
from pathlib import Path

import numpy as np
from jaxtyping import Float

from stickslip.outputs import check_output, whole_file
from stickslip.records import AxisKind, InputError, unit_of

__all__ = ["read_effort", "write_effort"]

_UNEVEN = 1e-3  # of a step: time stamps are rounded when they are written


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
    check_output(target, what="the CSV file")
    with whole_file(target, what="the CSV file") as stream:
        stream.write(f"time [s],effort [{unit_of('effort', kind)}]\n")
        for k, value in enumerate(effort.tolist()):
            stream.write(f"{k * sampling_time:.9g},{value:.9g}\n")
    return target


def read_effort(path: Path) -> tuple[Float[np.ndarray, " n"], float]:
    """Read what `write_effort` has written.

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
