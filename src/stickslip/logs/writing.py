"""Logs to files, whole or not at all."""

from pathlib import Path

from stickslip.logs.units import quantity_of
from stickslip.outputs import whole_file
from stickslip.records import AxisLog


def write_csv(log: AxisLog, path: str | Path) -> None:
    """Write a log as text that `read_log` reads back without a schema, value for value.

    The file appears when it is complete; if anything goes wrong, nothing half-written is left.

    Parameters
    ----------
    log
        The log.
    path
        The file; an existing one is replaced.

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
    with whole_file(Path(path), what="the log") as file:
        file.write("\n".join([header, *(",".join(map(repr, row)) for row in rows), ""]))
