"""The log that a person names, read as they say."""

from pathlib import Path

from stickslip.logs import AxisSchema, LogSchema, read_log, read_schema
from stickslip.records import AxisLog

__all__ = ["log_at"]


def log_at(
    path: Path | str,
    schema: Path | str | LogSchema | None,
    axis: str | int | None,
    columns: AxisSchema | None,
) -> AxisLog:
    """Read a log.

    Parameters
    ----------
    path, schema, axis
        As `stickslip.logs.read_log` takes them.
    columns
        What single columns are, in place of what the schema says of them.

    Raises
    ------
    InputError
        If the log cannot be read.
    """
    if columns is None or columns == AxisSchema():
        return read_log(path, schema, axis)
    if not isinstance(schema, LogSchema):
        schema = LogSchema() if schema is None else read_schema(schema)
    return read_log(path, schema.overridden(axis, columns))
