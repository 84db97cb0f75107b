"""A TOML file about an axis, made a record: refusals name the units of its kind of axis."""

import hashlib
from pathlib import Path
from typing import TypeVar

from stickslip.jobs.position.refusals import told_of
from stickslip.records import InputError
from stickslip.toml_records import read_toml, record_from

__all__ = ["read_axis_file"]

Record = TypeVar("Record")


def read_axis_file(path: Path, record: type[Record], *, remedy: str) -> tuple[Record, str]:
    """Return the record that a file holds, and the SHA-256 of the file.

    Parameters
    ----------
    path
        The file.
    record
        A dataclass with a table ``axis``, as of `stickslip.toml_records.record_from`.
    remedy
        Where the keys are explained, for the message.

    Raises
    ------
    InputError
        If it is missing, is not TOML, has an unknown key (near names are suggested) or a value
        that cannot be.
    """
    document = read_toml(path, what="scenario", line="mass = 150.0")
    try:
        found = record_from(record, document, where=str(path), remedy=remedy)
    except InputError as error:
        # Tables are read one by one, and know not which kind of axis they are for
        axis = document.get("axis")
        kind = axis.get("kind", "linear") if isinstance(axis, dict) else "linear"
        raise told_of(kind, error) from None
    return found, hashlib.sha256(path.read_bytes()).hexdigest()
