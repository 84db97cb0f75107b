"""The columns of a log as they stand in the file, before anyone has said what they mean."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from stickslip.input_files import nearest
from stickslip.logs.units import header_unit
from stickslip.records import InputError

__all__ = ["Column", "Table", "check_lengths", "combined", "name_columns"]

Column = Float[np.ndarray, " n"]


@dataclass(frozen=True, kw_only=True)
class Table:
    """Named columns of one log.

    Attributes
    ----------
    label
        What the log is called in messages: the file's name.
    headers
        By column name, the header as it stands in the file, in the file's order.
    units
        By column name, the unit that the header or the file gives it.
    constants
        Single numbers that the file holds, by name.
    load
        Returns the named columns. It raises `InputError` if one of them is not numeric.
    place
        Says where a sample of a column is, such as ``"stage.csv, row 17"``.
    notes
        What had to be assumed to read the file.
    """

    label: str
    headers: Mapping[str, str]
    units: Mapping[str, str]
    load: Callable[[Sequence[str]], Mapping[str, Column]]
    place: Callable[[str, int], str]
    constants: Mapping[str, float] = field(default_factory=dict[str, float])
    notes: tuple[str, ...] = ()

    def find(self, name: str) -> str | None:
        """Return the column or constant of that name or header, or None."""
        if name in self.headers or name in self.constants:
            return name
        for column, header in self.headers.items():
            if name.strip() == header.strip():
                return column
        return None

    def missing(self, name: str, wanted: str) -> InputError:
        """Return the error that there is no such column, with near names."""
        known = (*self.headers, *self.constants)
        near = nearest(name, known)
        return InputError(
            f"there is no column {name!r}" + (f" for {wanted}" if wanted else ""),
            where=self.label,
            remedy=f"did you mean {near}?" if near else f"the columns are: {', '.join(known)}",
        )


def name_columns(headers: Sequence[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Return the headers and the units of columns, by name.

    The unit in a header is no part of the column's name. Columns without a name are left out; of
    columns that share a name each gets its number behind it, so that none is taken for another.
    """
    split = [header_unit(header) for header in headers]
    plain = [name for name, _ in split]
    names = [
        header.strip() if plain.count(name) > 1 else name
        for header, name in zip(headers, plain, strict=True)
    ]
    names = [
        f"{name} #{names[: k + 1].count(name)}" if name and names.count(name) > 1 else name
        for k, name in enumerate(names)
    ]
    by_name = {name: headers[k] for k, name in enumerate(names) if name}
    units = {name: unit for name, (_, unit) in zip(names, split, strict=True) if name and unit}
    return by_name, units


def combined(tables: Mapping[str, Table], label: str) -> Table:
    """Return the columns of several files as one table, each named ``short:column``."""

    def load(names: Sequence[str]) -> dict[str, Column]:
        loaded: dict[str, Column] = {}
        for short, table in tables.items():
            own = {name: name.removeprefix(f"{short}:") for name in names}
            own = {name: bare for name, bare in own.items() if bare != name}
            columns = table.load(list(own.values()))
            loaded |= {name: columns[bare] for name, bare in own.items()}
        return loaded

    def place(name: str, sample: int) -> str:
        short, _, bare = name.partition(":")
        return tables[short].place(bare, sample)

    headers: dict[str, str] = {}
    units: dict[str, str] = {}
    constants: dict[str, float] = {}
    notes: list[str] = []
    for short, table in tables.items():
        headers |= {f"{short}:{name}": f"{short}:{each}" for name, each in table.headers.items()}
        units |= {f"{short}:{name}": unit for name, unit in table.units.items()}
        constants |= {f"{short}:{name}": value for name, value in table.constants.items()}
        notes += [f"{table.label}: {note}" for note in table.notes]
    return Table(
        label=label,
        headers=headers,
        units=units,
        constants=constants,
        load=load,
        place=place,
        notes=tuple(notes),
    )


def check_lengths(columns: Mapping[str, Column], label: str) -> None:
    """Refuse columns that do not have the same number of samples."""
    first = next(iter(columns))
    for name, column in columns.items():
        if column.size != columns[first].size:
            raise InputError(
                f"{first} has {columns[first].size} samples and {name} has {column.size}",
                where=label,
                remedy="record what belongs together sample by sample",
            )
