"""The columns of a log as they stand in the file, before anyone has said what they mean."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from stickslip.logs.schema import nearest
from stickslip.logs.units import header_unit
from stickslip.records import InputError

__all__ = ["Column", "Table", "combined", "name_columns"]

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
        Says where in the file a sample is, such as ``"row 17"``.
    notes
        What had to be assumed to read the file.
    """

    label: str
    headers: Mapping[str, str]
    units: Mapping[str, str]
    load: Callable[[Sequence[str]], Mapping[str, Column]]
    place: Callable[[int], str]
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
            wanted = [name for name in names if name.partition(":")[0] == short]
            columns = table.load([name.partition(":")[2] for name in wanted])
            loaded |= {name: columns[name.partition(":")[2]] for name in wanted}
        lengths = {name: column.size for name, column in loaded.items()}
        shortest, longest = (
            min(lengths, key=lengths.__getitem__),
            max(lengths, key=lengths.__getitem__),
        )
        if lengths[shortest] != lengths[longest]:
            raise InputError(
                f"{shortest} has {lengths[shortest]} samples and {longest} has {lengths[longest]}",
                where=label,
                remedy="record the files of one log together, sample by sample",
            )
        return {name: loaded[name] for name in names}

    def with_prefix(values: Callable[[Table], Mapping[str, object]]) -> dict[str, object]:
        return {
            f"{short}:{name}": value
            for short, table in tables.items()
            for name, value in values(table).items()
        }

    first = next(iter(tables.values()))
    return Table(
        label=label,
        headers={name: name for name in with_prefix(lambda table: table.headers)},
        units={name: str(unit) for name, unit in with_prefix(lambda table: table.units).items()},
        constants={
            name: table.constants[name.partition(":")[2]]
            for short, table in tables.items()
            for name in (f"{short}:{each}" for each in table.constants)
        },
        load=load,
        place=first.place,
        notes=tuple(f"{table.label}: {note}" for table in tables.values() for note in table.notes),
    )
