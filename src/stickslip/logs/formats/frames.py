"""Data frames of any library that narwhals supports, and files of Arrow, as columns of a log."""

from collections.abc import Callable, Sequence
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.errors import RequiredExtra
from stickslip.logs.table import Column, Table, is_slower, name_columns
from stickslip.records import InputError


def table_of_frame(frame: Any, label: str) -> Table:
    """Return a data frame as a table.

    Dates and durations become seconds; dates count from the first.
    """
    import narwhals as nw
    from narwhals.exceptions import DuplicateError

    try:
        data = nw.from_native(frame)
    except TypeError:
        raise InputError("not_a_frame", where=label, found=type(frame).__name__) from None
    except DuplicateError:
        raise InputError("frame_with_equal_names", where=label) from None
    if isinstance(data, nw.LazyFrame):
        data = data.collect()
    index = nw.maybe_get_index(data)
    if index is not None and (name := _name_of_index(index)) not in {None, *data.columns}:
        data = nw.from_native(nw.to_native(data).reset_index(names=name))
    titles = [str(title) for title in data.columns]
    headers, units = name_columns(titles)
    if not headers:
        raise InputError("frame_without_columns", where=label)
    named = [k for k, title in enumerate(titles) if title.strip()]
    positions = dict(zip(headers, named, strict=True))
    timed = nw.Datetime | nw.Duration
    units |= {name: "s" for name, k in positions.items() if isinstance(data[:, k].dtype, timed)}

    def place(_: str, sample: int) -> str:
        return f"{label}, row {sample} (counted from 0)"

    def load(names: Sequence[str]) -> dict[str, Column]:
        return {name: _numbers(data[:, positions[name]], name, place) for name in names}

    return Table(label=label, headers=headers, units=units, load=load, place=place)


def _name_of_index(index: Any) -> str | None:
    """Return the name of the index of a pandas frame; ``time`` for times, None for row numbers."""
    if index.nlevels > 1:
        return None
    return (
        str(index.name) if index.name is not None else "time" if index.dtype.kind in "mM" else None
    )


def _numbers(series: Any, name: str, place: Callable[[str, int], str]) -> Column:
    import narwhals as nw

    if isinstance(series.dtype, nw.Datetime):
        series = series - series.min()
    if isinstance(series.dtype, nw.Duration):
        return series.dt.total_nanoseconds().cast(nw.Float64).to_numpy() * 1e-9
    if isinstance(series.dtype, nw.Object):
        values: list[Any] = series.to_list()
        if all(value is None or isinstance(value, Real) for value in values):
            return np.array([np.nan if value is None else value for value in values], np.float64)
    if not (series.dtype.is_numeric() or isinstance(series.dtype, nw.Boolean)):
        raise InputError(
            "column_not_numeric", where=place(name, 0), name=name, found=str(series.dtype)
        )
    empty = np.flatnonzero(series.is_null().to_numpy())
    column = np.array(series.cast(nw.Float64).to_numpy(), dtype=np.float64)
    column[empty] = np.nan
    if empty.size and not is_slower(column):
        raise InputError(
            "column_with_gaps",
            where=place(name, int(empty[0])),
            name=name,
            count=empty.size,
            samples=len(series),
        )
    return column


def read_parquet(path: Path) -> Table:
    """Read a Parquet file, and of its columns only those in use."""
    with RequiredExtra("parquet", f"{path.name} is a Parquet file; reading it"):
        import pyarrow.parquet as pq

    def read(columns: list[str]) -> Any:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            return file.read(columns=columns)

    return _table_of_columns(path, pq.read_schema(path), read)


def read_feather(path: Path) -> Table:
    """Read a Feather file or stream (Arrow IPC); of a file only the columns in use."""
    with RequiredExtra("parquet", f"{path.name} is a Feather file; reading it"):
        import pyarrow as pa
        from pyarrow import feather

    try:
        with pa.OSFile(str(path)) as file:
            layout = pa.ipc.open_file(file).schema
    except pa.ArrowInvalid:
        stream = pa.ipc.open_stream(path.read_bytes()).read_all()
        return _table_of_columns(path, stream.schema, stream.select)

    def read(columns: list[str]) -> Any:
        return feather.read_table(path, columns=columns, memory_map=False)

    return _table_of_columns(path, layout, read)


def _table_of_columns(path: Path, schema: Any, read: Callable[[list[str]], Any]) -> Table:
    """Return a file as a table, by the Arrow schema of its columns and a reader of some of them."""
    layout = table_of_frame(schema.empty_table(), path.name)

    def load(names: Sequence[str]) -> dict[str, Column]:
        content = read([layout.headers[name] for name in names])
        return dict(table_of_frame(content, path.name).load(names))

    return Table(
        label=path.name, headers=layout.headers, units=layout.units, load=load, place=layout.place
    )
