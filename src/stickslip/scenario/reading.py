"""Scenario files: which tables a file has, and which model reads each."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from stickslip.input_files import read_toml, unknown_key
from stickslip.records import AxisKind, InputError
from stickslip.scenario.table import Table, Variants, table_from

__all__ = ["Document", "Read"]

T = TypeVar("T", bound=Table)
S = TypeVar("S")

_OTHER_FILES = (
    ("task", "a positioning task", "stickslip position"),
    ("input", "a scenario to compare estimators on", "stickslip compare"),
    ("effort", "a schema, which says how a log is read", "--schema, beside the log"),
    ("axes", "a schema, which says how a log is read", "--schema, beside the log"),
)
"""A key that files of one sort have and the others do not, what they are, and where they go."""


class Document:
    """The tables of a scenario file, each to be read by its model.

    Parameters
    ----------
    path
        The file.
    head
        The model of the keys before the first table.
    tables
        The names of its tables.

    Raises
    ------
    InputError
        If it is missing, is not TOML, is a file for something else, or has an unknown table.
    """

    def __init__(self, path: Path, head: type[Table], tables: tuple[str, ...]) -> None:
        self.path = path
        self._values = read_toml(path, what="scenario", line="mass = 150.0")
        known = (*head.model_fields, *tables)
        _check_sort(self._values, known, path)
        for key in self._values:
            if key not in known:
                raise unknown_key(key, known).at(str(path))
        # Read as a table without a name
        self._values[""] = {n: self._values[n] for n in head.model_fields if n in self._values}
        axis = self._values.get("axis")
        kind = axis.get("kind") if isinstance(axis, Mapping) else None
        self._kind: AxisKind = "rotary" if kind == "rotary" else "linear"
        self.sha256 = hashlib.sha256(path.read_bytes()).hexdigest()

    def raw(self, name: str) -> Mapping[str, Any]:
        """Return what the file says of a table; nothing if it is missing or no table."""
        values = self._values.get(name)
        return values if isinstance(values, Mapping) else {}

    def table(self, name: str, of: type[T] | Variants[T], *, optional: bool = False) -> T:
        """Return a table."""
        if not optional and name not in self._values:
            raise InputError(
                f"the table [{name}] is missing",
                where=str(self.path),
                remedy="write it, with its keys on the lines below it",
            )
        try:
            return table_from(of, self._values.get(name, {}), name=name, kind=self._kind)
        except InputError as error:
            raise error.at(str(self.path)) from None


def _check_sort(values: Mapping[str, Any], own: tuple[str, ...], path: Path) -> None:
    """Check that a file is of this sort: its first unknown key would say less."""
    if any(key in own and key in values for key, _, _ in _OTHER_FILES):
        return
    for key, what, where_to in _OTHER_FILES:
        if key in values and key not in own:
            raise InputError(f"this is {what}", where=str(path), remedy=f"give it to {where_to}")


@dataclass(frozen=True, kw_only=True)
class Read(Generic[S]):
    """A scenario with where it was read.

    Attributes
    ----------
    scenario
        What the file says.
    title
        What it calls itself; None for the file's name.
    path
        The file; other files that it names are beside it.
    sha256
        Of its bytes.
    """

    scenario: S
    title: str | None
    path: Path
    sha256: str

    @property
    def name(self) -> str:
        """What to call it."""
        return self.title or self.path.stem.replace("_", " ").replace("-", " ")
