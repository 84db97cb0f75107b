"""Parquet files, of which only the columns in use are read."""

from collections.abc import Sequence
from pathlib import Path

from stickslip.logs.formats.frames import table_of_frame
from stickslip.logs.table import Column, Table
from stickslip.records import InputError, MissingExtraError

__all__ = ["read_parquet"]


def read_parquet(path: Path) -> Table:
    """Read a Parquet file.

    Raises
    ------
    InputError
        If the file is damaged.
    MissingExtraError
        If pyarrow is not installed.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise MissingExtraError(
            f"{path.name} is a Parquet file; reading it", extra="parquet"
        ) from None

    damaged = InputError(
        "the file is no Parquet file, or is cut short or damaged",
        where=path.name,
        remedy="save or copy it again",
    )
    try:
        empty = pq.read_schema(path).empty_table()
    except (pa.ArrowException, OSError, ValueError) as error:
        raise damaged from error
    layout = table_of_frame(empty, path.name)

    def load(names: Sequence[str]) -> dict[str, Column]:
        headers = [layout.headers[name] for name in names]
        try:
            with pq.ParquetFile(path, page_checksum_verification=True) as file:
                content = file.read(columns=headers)
        except (pa.ArrowException, OSError, ValueError) as error:
            raise damaged from error
        return dict(table_of_frame(content, path.name).load(names))

    return Table(
        label=path.name,
        headers=layout.headers,
        units=layout.units,
        load=load,
        place=layout.place,
    )
