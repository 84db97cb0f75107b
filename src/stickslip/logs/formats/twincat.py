"""Text exports of TwinCAT Scope: rows of properties, then one time column a rate group."""

import csv
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice

import numpy as np

from stickslip.logs.table import Column, RateGroup, Table, name_titles
from stickslip.records import InputError

_DELIMITERS = "\t;:, "
_START = "Starttime of export"
_NAME, _SYMBOL, _TYPE, _UNIT = "Name", "SymbolName", "Data-Type", "Unit"
_NEEDED = {_NAME, _TYPE}
_END = "EOF"

_FILETIME = 1e15
"""Stamps above this count 100 ns since 1601, those below are milliseconds since the start."""

_EXACT_DIGITS = 15  # digits that a float holds

_ROWS_AT_ONCE = 50_000  # that are text in memory


def is_twincat(lines: Sequence[str]) -> bool:
    """Return whether the first lines of a text are those of such an export."""
    return any(line.lstrip('"').startswith(_START) for line in lines[:5])


def read_twincat(first: Sequence[str], lines: Iterable[str], label: str) -> Table:
    """Return the columns of an export; groups that share their time stamps become one.

    Values are as scaled by the Scope. A file that separates by blanks and has names with blanks in
    them is named by the symbols of the controller.
    """
    delimiter = _delimiter(first, label)
    properties, start = _properties(first, delimiter, label)
    types = properties[_TYPE]
    stamps = [k for k, cell in enumerate(types) if cell == _TYPE]
    names, notes = properties[_NAME], list[str]()
    if len(names) != len(types):
        names = properties.get(_SYMBOL, [])
        notes.append("the names cannot be separated, so the columns are called by their symbols")
    units = properties.get(_UNIT, [])
    if len(names) != len(types) or not stamps or stamps[0] != 0:
        raise InputError("scope_names_and_types", where=label, names=len(names), types=len(types))
    columns = _read(islice(lines, start, None), delimiter, start, len(types), label)
    units = units if len(units) == len(types) else [""] * len(types)
    return _table(names, units, stamps, columns, (start + 1, label, tuple(notes)))


def _table(
    names: list[str],
    units: list[str],
    stamps: list[int],
    columns: list[np.ndarray],
    context: tuple[int, str, tuple[str, ...]],
) -> Table:
    """Return the table; ``context`` is the row of the first sample, the file and the notes."""
    first, label, notes = context
    own: dict[int, list[int]] = {}  # by the place of the time stamps that a group keeps
    for begin, end in zip(stamps, [*stamps[1:], len(names)], strict=True):
        kept = next((k for k in own if np.array_equal(columns[k], columns[begin])), begin)
        own.setdefault(kept, []).extend(range(begin + 1, end))
    places = [place for stamp, channels in own.items() for place in (stamp, *channels)]
    titles = ["time" if place in own else names[place].strip() or "?" for place in places]
    by_place = dict(zip(places, name_titles(titles), strict=True))
    listed = {by_place[place]: place for place in places}
    absolute = {place for place in own if columns[place].size and columns[place][0] > _FILETIME}
    origin = min((columns[place][0] for place in absolute), default=0.0)
    given = {by_place[k]: units[k].partition(" (")[0] for k in places if k not in own}
    stated = {name: unit for name, unit in given.items() if unit and not unit.startswith("(")}
    stated |= {by_place[place]: "s" if place in absolute else "ms" for place in own}

    def load(wanted: Sequence[str]) -> dict[str, Column]:
        return {
            name: (columns[k] - origin) * 1e-7 if k in absolute else columns[k].astype(np.float64)
            for name in wanted
            for k in (listed[name],)
        }

    return Table(
        label=label,
        headers={by_place[k]: title for k, title in zip(places, titles, strict=True)},
        units=stated,
        load=load,
        place=lambda _, sample: f"{label}, row {first + sample}",
        notes=(*notes, *(["stamps since 1601 are counted from the first"] if absolute else ())),
        groups=tuple(
            RateGroup(
                columns=tuple(by_place[place] for place in (stamp, *channels)),
                time=by_place[stamp],
                name=f"group {number}" if len(own) > 1 else "",
            )
            for number, (stamp, channels) in enumerate(own.items(), 1)
        ),
    )


def _delimiter(lines: Sequence[str], label: str) -> str:
    for line in lines:
        if line.startswith(_TYPE) and len(line) > len(_TYPE):
            delimiter = line[len(_TYPE)]
            if delimiter in _DELIMITERS:
                return delimiter
    raise InputError("scope_without_types", where=label, row=_TYPE)


def _properties(
    lines: Sequence[str], delimiter: str, label: str
) -> tuple[dict[str, list[str]], int]:
    """Return the rows of properties by their title, and how many lines stand before the data.

    The first block describes the file; the second one has a cell for every column.
    """
    begun = False
    properties: dict[str, list[str]] = {}
    for number, line in enumerate(lines):
        if not line.strip():
            if begun and properties.keys() >= _NEEDED:
                return properties, number + 1
            properties, begun = {}, False
            continue
        begun = True
        cells = _cells(line, delimiter)
        properties.setdefault(cells[0], cells)
    raise InputError("scope_properties_do_not_end", where=label)


def _cells(line: str, delimiter: str) -> list[str]:
    line = line.rstrip("\r\n")
    if '"' in line:
        try:
            return next(csv.reader([line], delimiter=delimiter))
        except (csv.Error, StopIteration):
            return [line]
    return line.split(delimiter)


def _read(
    lines: Iterable[str], delimiter: str, start: int, width: int, label: str
) -> list[np.ndarray]:
    """Return all columns; a slower group ends before the others, in blanks or with the row."""
    parts: list[list[np.ndarray]] = [[] for _ in range(width)]
    ended = [False] * width
    for offset, rows in _blocks(lines, delimiter):
        if max(map(len, rows)) > width:
            long = next(k for k, row in enumerate(rows) if len(row) > width)
            where = f"{label}, row {start + offset + long + 1}"
            raise InputError(
                "row_of_other_width", where=where, columns=len(rows[long]), width=width
            )
        for column in range(width):
            cells = [row[column].strip() if len(row) > column else "" for row in rows]
            filled = next((k for k, cell in enumerate(cells) if not cell), len(cells))
            fault = next((k for k in range(filled, len(cells)) if cells[k]), None)
            if ended[column] and filled:
                fault = 0
            if fault is not None:
                raise InputError(
                    "scope_value_below_gap",
                    where=f"{label}, row {start + offset + fault + 1}",
                    column=column + 1,
                )
            parts[column].append(_floats(cells[:filled], column, start + offset + 1, label))
            ended[column] = filled < len(cells)
    columns = [np.concatenate(each) if each else np.empty(0) for each in parts]
    if not columns[0].size:
        raise InputError("scope_without_samples", where=label)
    return columns


def _floats(cells: list[str], column: int, first: int, label: str) -> np.ndarray:
    numbers = [cell.replace(",", ".") for cell in cells]
    try:
        long = bool(numbers) and len(numbers[0]) > _EXACT_DIGITS
        if long and all(map(str.isdigit, numbers)):
            return np.array([int(number) for number in numbers], dtype=np.int64)
        return np.array(numbers, dtype=np.float64)
    except OverflowError:
        return np.array(numbers, dtype=np.float64)
    except ValueError:
        for number, cell in enumerate(numbers):
            try:
                float(cell)
            except ValueError:
                where = f"{label}, row {first + number}"
                raise InputError(
                    "cell_of_text", where=where, name=column + 1, cell=cell, wanted="number"
                ) from None
        raise


def _blocks(lines: Iterable[str], delimiter: str) -> Iterator[tuple[int, list[list[str]]]]:
    """Yield the cells of many rows at once, with the number of the first."""
    source = (line.rstrip("\r\n") for line in lines)
    offset = 0
    while block := list(islice(source, _ROWS_AT_ONCE)):
        rows = [line.split(delimiter) for line in block if line.strip() not in {"", _END}]
        if rows:
            yield offset, rows
        offset += len(block)
