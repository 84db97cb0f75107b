"""A TOML file about an axis, made a record: refusals name the units of its kind of axis."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from stickslip.jobs.positioning.refusals import told_of
from stickslip.records import InputError
from stickslip.toml_records import read_toml, record_from

__all__ = ["read_axis_file"]

Record = TypeVar("Record")

_OTHER_FILES = (
    ("task", "a positioning task", "stickslip position"),
    ("input", "a scenario to compare estimators on", "stickslip compare"),
    ("effort", "a schema, which says how a log is read", "--schema, beside the log"),
    ("axes", "a schema, which says how a log is read", "--schema, beside the log"),
)
"""A key that files of one sort have and the others do not, what they are, and where they go."""


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
        If it is missing, is not TOML, is a file for something else, has an unknown key (near names
        are suggested) or a value that cannot be.
    """
    document = read_toml(path, what="scenario", line="mass = 150.0")
    _refuse_other_file(document, tuple(get_type_hints(record)), path)
    try:
        found = record_from(record, document, where=str(path), remedy=remedy)
    except InputError as error:
        # Tables are read one by one, and know not which kind of axis they are for
        axis = document.get("axis")
        kind = axis.get("kind", "linear") if isinstance(axis, dict) else "linear"
        raise told_of(kind, error) from None
    return found, hashlib.sha256(path.read_bytes()).hexdigest()


def _refuse_other_file(document: Mapping[str, Any], own: tuple[str, ...], path: Path) -> None:
    """Refuse a file of another sort: its first unknown key would say less."""
    if any(key in own and key in document for key, _, _ in _OTHER_FILES):
        return
    for key, what, where_to in _OTHER_FILES:
        if key in document and key not in own:
            raise InputError(f"this is {what}", where=str(path), remedy=f"give it to {where_to}")
