"""Logs to files, whole or not at all."""

import os
import tempfile
from pathlib import Path

from stickslip.logs.units import quantity_of
from stickslip.records import AxisLog, InputError

__all__ = ["write_csv"]


def write_csv(log: AxisLog, path: str | Path) -> None:
    """Write a log as text that `read_log` reads back without a schema, value for value.

    The file appears when it is complete; whatever goes wrong, nothing half-written is left.

    Parameters
    ----------
    log
        The log.
    path
        The file; one that exists is replaced.

    Raises
    ------
    InputError
        If the file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import numpy as np
    >>> log = AxisLog(name="stage", kind="linear", time=np.array([0.0, 0.1]), effort=np.ones(2),
    ...               measured_position=np.array([0.0, 0.005]))
    >>> with TemporaryDirectory() as folder:
    ...     write_csv(log, Path(folder, "stage.csv"))
    ...     print(Path(folder, "stage.csv").read_text())
    time [s],position [m],effort [N]
    0.0,0.0,1.0
    0.1,0.005,1.0
    <BLANKLINE>
    """
    path = Path(path)
    columns = {
        "time": log.time,
        "position": log.measured_position,
        "velocity": log.measured_velocity,
        "load_position": log.measured_load_position,
        "load_velocity": log.measured_load_velocity,
        "effort": log.effort,
    }
    measured = {name: values for name, values in columns.items() if values is not None}
    header = ",".join(f"{name} [{log.unit(quantity_of(name))}]" for name in measured)
    rows = zip(*(values.tolist() for values in measured.values()), strict=True)
    try:
        _write_whole(path, "\n".join([header, *(",".join(map(repr, row)) for row in rows), ""]))
    except OSError as error:
        raise InputError(
            f"the file cannot be written ({error.strerror or error})",
            where=str(path),
            remedy="give a path in a folder that exists and can be written to",
        ) from error


def _write_whole(path: Path, text: str) -> None:
    """Write beside the target, then put it in the target's place in one step."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=".part")
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="\n") as file:
            file.write(text)
        Path(name).chmod(0o666 & ~_umask())
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _umask() -> int:
    """Return the rights that new files are made without; it can be read only by setting it."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
