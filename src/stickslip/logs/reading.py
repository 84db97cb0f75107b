"""From a file or a data frame to an `AxisLog` in SI units, checked for plausibility."""

from collections.abc import Iterable, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from stickslip.errors import check_class
from stickslip.logs.columns.assignment import Assignment, assign, one_axis
from stickslip.logs.columns.channels import bind
from stickslip.logs.columns.conversion import axis_log
from stickslip.logs.formats.frames import table_of_frame
from stickslip.logs.opening import open_log
from stickslip.logs.schema import LogSchema, read_schema
from stickslip.logs.table import Table, remembered
from stickslip.records import AxisLog, InputError, LogSource


def read_log(
    path: str | Path, schema: str | Path | LogSchema | None = None, axis: str | int | None = None
) -> AxisLog:
    """Read one axis from a log file, or from a folder of files.

    The format is recognised by the ending of the file; the guide on formats lists all of them.

    Parameters
    ----------
    path
        The file; or a folder, with a schema that names its files.
    schema
        A `LogSchema`, or the path of a TOML file with one. Without it obvious columns are found.
    axis
        Which axis, if the log or the schema has several.

    Returns
    -------
    The log in SI units. Its ``source.assumptions`` states everything that was inferred.

    Raises
    ------
    InputError
        If the log cannot be read or makes no sense; file, row and column are named.
    MissingExtraError
        If the format needs a library that is not installed.

    Examples
    --------
    >>> import os
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "stage.csv")
    ...     rows = ["time [s],pos [mm],force [N]", "0.0,0.0,1", "0.5,0.1,1", "1.0,0.4,1"]
    ...     _ = file.write_text(os.linesep.join(rows))
    ...     log = read_log(file)
    >>> log.kind, log.sampling_time, log.measured_position[-1].item()
    ('linear', 0.5, 0.0004)
    >>> log.source.assumptions[-1]
    'the axis is taken as linear because position is in mm'
    """
    whole, where = schema_at(schema)
    table, source, name = open_log(path, whole.files, where)
    return _axis_of(remembered(table), whole, axis, where, source, name)


def log_from_frame(
    frame: Any, schema: str | Path | LogSchema | None = None, axis: str | int | None = None
) -> AxisLog:
    """Take one axis from a data frame: pandas, polars, pyarrow or any other that narwhals supports.

    Parameters
    ----------
    frame
        The data frame. An index of pandas that has a name or holds times is a column.
    schema, axis
        As for `read_log`.

    Returns
    -------
    The log in SI units.

    Raises
    ------
    InputError
        If the frame cannot be used; row and column are named.

    Examples
    --------
    >>> import pandas as pd
    >>> frame = pd.DataFrame({"t": [0.0, 0.1, 0.2], "q": [0.0, 0.1, 0.3], "tau": [1.0, 1.0, 0.0]})
    >>> log = log_from_frame(frame, LogSchema(kind="rotary"))
    >>> log.unit("effort"), log.effort.tolist()
    ('N m', [1.0, 1.0, 0.0])
    """
    whole, where = schema_at(schema)
    if whole.files:
        raise InputError("frame_with_files", where=where)
    label = "data frame"
    table = table_of_frame(frame, label)
    return _axis_of(table, whole, axis, where, None, label)


def read_axes(
    path: str | Path, schema: str | Path | LogSchema | None = None
) -> dict[str, AxisLog | InputError]:
    """Read every axis of a log.

    Parameters
    ----------
    path, schema
        As for `read_log`.

    Returns
    -------
    By the name of each axis, its log, or the error for which it cannot be read; a log of one axis
    without a name has it under the name of the log.

    Raises
    ------
    InputError
        If the log cannot be read, or none of its axes.
    """
    whole, where = schema_at(schema)
    table, source, name = open_log(path, whole.files, where)
    logs = logs_of_axes(remembered(table), assign(table, whole), where, source, name)
    errors = [each for each in logs.values() if isinstance(each, InputError)]
    if errors and len(errors) == len(logs):
        raise errors[0]
    return logs


def logs_of_axes(
    table: Table,
    every: Mapping[str, Assignment],
    where: str,
    source: LogSource | None,
    name: str,
) -> dict[str, AxisLog | InputError]:
    """Return the log of each axis of a table, or why it has none; one without a name has `name`."""
    logs: dict[str, AxisLog | InputError] = {}
    if len(every) > 1:
        _load_at_once(table, every.values())
    for axis, assigned in every.items():
        try:
            logs[axis or name] = axis_log(
                table,
                assigned.checked(),
                where,
                source,
                default_name=axis if axis and len(every) > 1 else name,
            )
        except InputError as error:
            logs[axis or name] = error
    return logs


def _load_at_once(table: Table, every: Iterable[Assignment]) -> None:
    """Load the columns of all axes, which are in one pass then; faults are found axis by axis."""
    names: list[str] = []
    try:
        for assigned in every:
            if assigned.problem is None:
                bound = bind(table, assigned.schema, assigned.found, "schema")
                names += [name for each in bound.values() for name in each.expression.names]
        table.load([name for name in dict.fromkeys(names) if name in table.headers])
    except InputError:
        return


def schema_at(schema: str | Path | LogSchema | None) -> tuple[LogSchema, str]:
    """Return a schema and its name in messages; empty for none."""
    if schema is None:
        return LogSchema(), ""
    if isinstance(schema, LogSchema):
        return schema, "schema"
    check_class("schema", schema, str, PathLike, LogSchema)
    return read_schema(schema), Path(schema).name


def _axis_of(
    table: Table,
    whole: LogSchema,
    axis: str | int | None,
    where: str,
    source: LogSource | None,
    default_name: str,
) -> AxisLog:
    """Return one axis of a table."""
    if whole.axes:
        try:
            whole.for_axis(axis)
        except InputError as error:
            raise error.at(where) from None
    assigned = assign(table, whole)
    one = one_axis(assigned, axis, label=table.label).checked()
    if one.axis and len(assigned) > 1 and not whole.axes:
        default_name = f"{default_name} {one.axis}"
    return axis_log(table, one, where, source, default_name=default_name)
