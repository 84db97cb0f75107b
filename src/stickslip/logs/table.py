"""The columns of a log as they stand in the file, before they are interpreted."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from stickslip.input_files import nearest
from stickslip.logs.unit_spelling import header_unit
from stickslip.records import InputError

Column = Float[np.ndarray, " n"]

_SPARSE = 0.1  # share of empty cells from which they are those of a slower channel

_FEWEST_ROWS = 20  # least samples of such a channel

_ROUND = str.maketrans("[]", "()")

_UNEVEN = 10.0  # largest over the median number of rows from one of its samples to the next


@dataclass(frozen=True, kw_only=True)
class RateGroup:
    """Columns of one length, sampled together."""

    columns: tuple[str, ...]  # names, in the file's order; the time stamps among them
    time: str | None = None  # column of the time stamps, if the format itself says which
    name: str = ""  # topic, channel group or file; empty where the log has one group only


@dataclass(frozen=True, kw_only=True)
class Table:
    """Named columns of one log, in groups of one length each.

    ``load`` returns the named columns, or raises `InputError` if one of them is not numeric;
    ``place`` locates a sample of a column, as in ``"stage.csv, row 17"``. Columns of the same group
    have the same number of samples; a table made without groups has one.
    """

    label: str  # what the log is called in messages: the file's name
    headers: Mapping[str, str]  # by column name, as they stand in the file, in its order
    units: Mapping[str, str]  # by column name, as its header or the file states them
    load: Callable[[Sequence[str]], Mapping[str, Column]]
    place: Callable[[str, int], str]
    constants: Mapping[str, float] = field(default_factory=dict[str, float])  # single numbers
    notes: tuple[str, ...] = ()  # assumptions made to read the file
    groups: tuple[RateGroup, ...] = ()
    origins: Mapping[str, str] = field(default_factory=dict[str, str])
    """By column name, where the file has it, such as ``"/joint_states (sensor_msgs/JointState)"``;
    a column whose header says all has none."""

    def __post_init__(self) -> None:
        if not self.groups:
            object.__setattr__(self, "groups", (RateGroup(columns=tuple(self.headers)),))

    def group_of(self, name: str) -> RateGroup:
        """Return the group of a column."""
        return self._groups[name]

    @cached_property
    def _groups(self) -> dict[str, RateGroup]:
        return {name: group for group in self.groups for name in group.columns}

    def find(self, name: str) -> str | None:
        """Return the column or constant of that name or header, or None."""
        if name in self.headers or name in self.constants:
            return name
        plain = _plain(name)
        return next((k for k, header in self.headers.items() if plain == _plain(header)), None)

    def missing(self, name: str, wanted: str) -> InputError:
        """Return the error that there is no such column, with near names."""
        known = (*self.headers, *self.constants)
        near = nearest(name, known)
        code = "column_misspelt" if near else "no_such_column"
        return InputError(
            code, where=self.label, name=name, wanted=wanted, near=near, columns=known
        )


def _plain(name: str) -> str:
    """Return a name as it is compared; blanks in an index, as in ``q[:, 3]``, mean nothing."""
    head, bracket, index = name.strip().partition("[:")
    return head + bracket + "".join(index.split()) if bracket else head


def name_columns(headers: Sequence[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Return the headers and the units of columns, by name.

    The unit in a header is no part of the column's name. Columns without a name are left out; of
    columns that share a name each gets its number behind it, so that none is taken for another.
    """
    split = [header_unit(header) for header in headers]
    plain = Counter(name for name, _ in split)
    names = [
        header.strip() if plain[name] > 1 else name
        for header, (name, _) in zip(headers, split, strict=True)
    ]
    names = _numbered(names)
    by_name = {name: headers[k] for k, name in enumerate(names) if name}
    units = {name: unit for name, (_, unit) in zip(names, split, strict=True) if name and unit}
    return by_name, units


def name_titles(titles: Sequence[str]) -> list[str]:
    """Return the names of columns whose units stand elsewhere: brackets of titles are no units."""
    return list(name_columns([title.translate(_ROUND) for title in titles])[0])


def _numbered(names: list[str]) -> list[str]:
    """Return the names, with its number behind each that several columns share."""
    shared = Counter(names)
    taken = {name for name, times in shared.items() if times == 1}
    used: Counter[str] = Counter()
    numbered: list[str] = []
    for name in names:
        each = name
        while name and shared[name] > 1:
            used[name] += 1
            each = f"{name} #{used[name]}"
            if each not in taken:
                break
        numbered.append(each)
    return numbered


def groups_by_length(sizes: Mapping[str, int]) -> tuple[RateGroup, ...]:
    """Return groups of the columns that have as many samples; those of one length have no name."""
    lengths: dict[int, list[str]] = {}
    for name, size in sizes.items():
        lengths.setdefault(size, []).append(name)
    return tuple(
        RateGroup(columns=tuple(names), name=f"{size} samples" if len(lengths) > 1 else "")
        for size, names in lengths.items()
    )


def remembered(table: Table) -> Table:
    """Return a table that loads each column once: most formats read the whole file for any."""
    known: dict[str, Column] = {}

    def load(names: Sequence[str]) -> dict[str, Column]:
        missing = [name for name in dict.fromkeys(names) if name not in known]
        if missing:
            known.update(table.load(missing))
        return {name: known[name] for name in names}

    return replace(table, load=load)


def combined(tables: Mapping[str, Table], label: str) -> Table:
    """Return the columns of several files as one table, each named ``short:column``."""

    def load(names: Sequence[str]) -> dict[str, Column]:
        loaded: dict[str, Column] = {}
        for short, table in tables.items():
            prefix = f"{short}:"
            own = {name: name.removeprefix(prefix) for name in names if name.startswith(prefix)}
            columns = table.load(list(own.values()))
            loaded |= {name: columns[bare] for name, bare in own.items()}
        return loaded

    def place(name: str, sample: int) -> str:
        short, _, bare = name.partition(":")
        return tables[short].place(bare, sample)

    parts = tables.items()
    return Table(
        label=label,
        headers={
            f"{s}:{name}": f"{s}:{each}" for s, t in parts for name, each in t.headers.items()
        },
        units={f"{s}:{name}": unit for s, t in parts for name, unit in t.units.items()},
        constants={f"{s}:{name}": value for s, t in parts for name, value in t.constants.items()},
        load=load,
        place=place,
        notes=tuple(f"{t.label}: {note}" for t in tables.values() for note in t.notes),
        groups=tuple(
            RateGroup(
                columns=tuple(f"{s}:{name}" for name in group.columns),
                time=None if group.time is None else f"{s}:{group.time}",
                name=f"{s}:{group.name}" if group.name else s,
            )
            for s, t in parts
            for group in t.groups
        ),
        origins={f"{s}:{name}": text for s, t in parts for name, text in t.origins.items()},
    )


def is_slower(column: Column) -> bool:
    """Return whether the empty cells of a column are those of a channel slower than its table.

    Otherwise they are values that are missing: few, or many in a row.
    """
    empty = np.isnan(column)
    if np.count_nonzero(empty) < _SPARSE * column.size:
        return False
    rows = np.flatnonzero(~empty)
    if rows.size < _FEWEST_ROWS:
        return False
    between = np.diff(rows)
    longest = max(rows[0], column.size - 1 - rows[-1], between.max())
    return bool(longest <= _UNEVEN * np.median(between))


def check_lengths(columns: Mapping[str, Column], label: str) -> None:
    """Check that all columns have the same number of samples."""
    first = next(iter(columns))
    for name, column in columns.items():
        if column.size != columns[first].size:
            raise InputError(
                "unequal_lengths",
                where=label,
                name=first,
                samples=columns[first].size,
                other=name,
                needed=column.size,
            )
