"""The registry of log formats: one reader a format, chosen by a file's ending.

``docs/contributing.md`` has the steps to add one.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Protocol, runtime_checkable

from stickslip.logs.formats.arrays import read_matlab, read_npz
from stickslip.logs.formats.frames import read_parquet
from stickslip.logs.formats.text import read_text
from stickslip.logs.table import Table
from stickslip.records import InputError


@runtime_checkable
class Reader(Protocol):
    """Reader of one format: the layout of a file at once, columns when the table loads them.

    It raises `InputError` if the file is damaged or holds no numbers, and `MissingExtraError` if a
    library is not installed. Nothing in the file is run.
    """

    def __call__(self, path: Path, /) -> Table:
        """Return the table in a file that exists and is not empty."""
        ...


@dataclass(frozen=True, kw_only=True)
class LogFormat:
    """A format of the registry."""

    name: str  # in prose
    endings: tuple[str, ...]  # of its files, in lower case
    read: Reader


_ENTRIES = (
    LogFormat(
        name="text", endings=(".csv", ".tsv", ".txt", ".dat", ".asc", ".log"), read=read_text
    ),
    LogFormat(name="Parquet", endings=(".parquet", ".pq"), read=read_parquet),
    LogFormat(name="MATLAB", endings=(".mat",), read=read_matlab),
    LogFormat(name="NPZ", endings=(".npz",), read=read_npz),
)

FORMATS: Mapping[str, LogFormat] = MappingProxyType(
    {ending: entry for entry in _ENTRIES for ending in entry.endings}
)
"""The format of every known ending."""


def reader_of(path: Path) -> Reader:
    """Return the reader for a file by its ending, in either case."""
    entry = FORMATS.get(path.suffix.lower())
    if entry is None:
        raise InputError(
            f"the format {path.suffix or 'of a name without an ending'} is unknown",
            where=str(path),
            remedy=f"convert the log to one of: {', '.join(FORMATS)}",
        )
    return entry.read
