"""Text logs: columns between commas, semicolons, tabs or blanks."""

import csv
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from stickslip.logs.table import Column, Table, name_columns
from stickslip.logs.units import is_unit
from stickslip.records import InputError

__all__ = ["read_text"]

_SNIFFED_LINES = 500
"""A header must end and data must begin within this many lines."""

_SNIFFED_ROWS = 50
"""Rows of data that decide on the dialect."""

_COMMENTS = ("#", "%", "//")

_BLANKS = " "
"""Stands for columns between runs of blanks, as the delimiters of other dialects are."""

_NUMBER = re.compile(
    r"\s*[+-]?(?:(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|inf(?:inity)?|nan)\s*", re.IGNORECASE
)


@dataclass(frozen=True, kw_only=True)
class _Dialect:
    """How columns and decimals are written."""

    delimiter: str
    decimal: str

    def cells(self, line: str) -> list[str]:
        """Return the cells of one line."""
        if self.delimiter == _BLANKS:
            line = re.sub(r"\s+", " ", line.strip())
        row = next(csv.reader([line], delimiter=self.delimiter, skipinitialspace=True), [])
        return [cell.strip() for cell in row]

    def number(self, cell: str) -> float | None:
        """Return the number in a cell, or None if it holds none."""
        if self.decimal == ",":
            cell = "?" if "." in cell else cell.replace(",", ".")
        return float(cell) if _NUMBER.fullmatch(cell) else None


_DIALECTS = tuple(
    _Dialect(delimiter=delimiter, decimal=decimal)
    for decimal in (".", ",")
    for delimiter in (",", ";", "\t", _BLANKS)
    if decimal != delimiter
)


@dataclass(frozen=True, kw_only=True)
class _Layout:
    """Where things are in a text log; lines are counted from 0."""

    dialect: _Dialect
    headers: tuple[str, ...]
    first_row: int
    notes: tuple[str, ...]


def read_text(path: Path) -> Table:
    """Read the layout of a text log; the rows themselves are read when columns are asked for.

    Understood: ``, ; tab`` and blanks between columns, decimal commas, a header row, a row of units
    below it or units in its names, comment lines and other lines before it, quoted names, and UTF-8,
    UTF-16 and Latin-1 text.

    Raises
    ------
    InputError
        If the file holds no table of numbers.
    """
    text, encoding = _decoded(path.read_bytes(), path.name)
    layout = _layout(list(islice(io.StringIO(text, newline=None), _SNIFFED_LINES)), path.name)
    headers, units = name_columns(layout.headers)
    notes = layout.notes
    if encoding == "latin-1":
        notes = (*notes, "the text is not UTF-8 and was read as Latin-1")
    used = [position for position, header in enumerate(layout.headers) if header.strip()]

    def load(names: Sequence[str]) -> dict[str, Column]:
        positions = {
            name: position for name, position in zip(headers, used, strict=True) if name in names
        }
        same_text = encoding == "utf-8-sig" and layout.dialect.decimal == "."
        rows = _fast(path if same_text else io.StringIO(text.replace(",", ".")), layout)
        if rows is not None and rows.shape[1] == len(layout.headers):
            return {name: rows[:, position] for name, position in positions.items()}
        return _careful(text, layout, positions, path.name)

    def place(sample: int) -> str:
        row = next(islice(_rows(text, layout), sample, None), None)
        return f"row {row[0]}" if row else f"sample {sample}"

    return Table(label=path.name, headers=headers, units=units, load=load, place=place, notes=notes)


def _decoded(content: bytes, label: str) -> tuple[str, str]:
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        encodings = ["utf-16"]
    else:
        encodings = ["utf-8-sig", "latin-1"]
    for encoding in encodings:
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text, encoding
    raise InputError(
        "the file is not text",
        where=label,
        remedy="give it the ending of its format, such as .mat or .parquet",
    )


def _layout(lines: list[str], label: str) -> _Layout:
    content = [
        (number, line)
        for number, line in enumerate(lines)
        if line.strip() and not line.lstrip().startswith(_COMMENTS)
    ]
    dialect = max(_DIALECTS, key=lambda dialect: _score(dialect, content))
    width = _width(dialect, content)
    first = _first_row(dialect, content, width)
    if first is None:
        raise InputError(
            "no rows of numbers were found",
            where=label,
            remedy="give a text log with a header row and one row of numbers a sample",
        )
    return _named(dialect, lines, first, width, label)


def _first_row(dialect: _Dialect, lines: list[tuple[int, str]], width: int) -> int | None:
    """Return the first line of data: all numbers, or half of them right below a line of names."""
    partly: int | None = None
    below_names = False
    for number, line in lines:
        cells = dialect.cells(line)
        filled = sum(map(bool, cells))
        numbers = sum(dialect.number(cell) is not None for cell in cells)
        full = 0 < numbers == filled
        half = 2 * numbers >= filled > 0 and len(cells) == width
        if (full and len(cells) == width) or (below_names and (full or half)):
            return number
        if half and partly is None:
            partly = number
        below_names = len(cells) == width and numbers == 0
    return partly


def _score(dialect: _Dialect, lines: list[tuple[int, str]]) -> tuple[int, int]:
    """Return how many of the last lines are all numbers in a dialect, and how many numbers."""
    rows = [dialect.cells(line) for _, line in lines[-_SNIFFED_ROWS:]]
    numbers = [
        sum(dialect.number(cell) is not None for cell in row) if len(row) > 1 else 0 for row in rows
    ]
    full = [count for count, row in zip(numbers, rows, strict=True) if count == sum(map(bool, row))]
    return sum(count > 0 for count in full), sum(numbers)


def _width(dialect: _Dialect, lines: list[tuple[int, str]]) -> int:
    """Return the most frequent width of lines that have numbers."""
    widths = [
        len(row)
        for row in (dialect.cells(line) for _, line in lines[-_SNIFFED_ROWS:])
        if any(dialect.number(cell) is not None for cell in row)
    ]
    return max(widths, key=widths.count, default=0)


def _named(dialect: _Dialect, lines: list[str], first: int, width: int, label: str) -> _Layout:
    """Find the header above the first row: a line of names, perhaps with units below it."""
    above = [line.strip() for line in lines[:first] if line.strip()]
    headers: list[str] | None = None
    notes: tuple[str, ...] = ()
    if above:
        last = _names(dialect, above[-1], width)
        upper = _names(dialect, above[-2], width) if len(above) > 1 else None
        if last and upper and all(not cell or is_unit(cell) for cell in last):
            headers = [
                f"{name} [{unit.strip('[]() ')}]" if unit else name
                for name, unit in zip(upper, last, strict=True)
            ]
        elif last is not None:
            headers = last
        elif dialect.delimiter != _BLANKS and dialect.delimiter in above[-1]:
            raise InputError(
                f"the header has {len(dialect.cells(above[-1]))} columns and the rows have {width}",
                where=f"{label}, row {first}",
                remedy="give every column one name",
            )
    if headers is None:
        headers = [f"column_{k + 1}" for k in range(width)]
        notes = (f"there is no header row; the columns are called column_1 to column_{width}",)
    return _Layout(dialect=dialect, headers=tuple(headers), first_row=first, notes=notes)


def _names(dialect: _Dialect, line: str, width: int) -> list[str] | None:
    """Return the names in a line, which may be a comment, or None if they are not as many."""
    line = line.lstrip("".join(_COMMENTS)).strip()
    if dialect.delimiter == _BLANKS:
        line = re.sub(r"\s+(?=[\[(])", "", line)
    cells = dialect.cells(line)
    return cells if len(cells) == width and any(cells) else None


def _rows(text: str, layout: _Layout) -> Iterator[tuple[int, str]]:
    """Yield each row with its number as an editor counts it."""
    for number, line in enumerate(io.StringIO(text, newline=None), 1):
        if number > layout.first_row and line.strip() and not line.lstrip().startswith(_COMMENTS):
            yield number, line


def _fast(source: Path | io.StringIO, layout: _Layout) -> np.ndarray | None:
    """Return all columns at once, or None if the rows are not all numbers of one width."""
    delimiter = layout.dialect.delimiter
    try:
        return np.loadtxt(
            source,
            delimiter=None if delimiter == _BLANKS else delimiter,
            skiprows=layout.first_row,
            comments="#",
            quotechar='"',
            ndmin=2,
            encoding="utf-8-sig",
        )
    except ValueError:
        return None


def _careful(
    text: str, layout: _Layout, positions: dict[str, int], label: str
) -> dict[str, Column]:
    """Return the wanted columns, cell by cell, and name the first cell that is at fault."""
    columns: dict[str, list[float]] = {name: [] for name in positions}
    width = len(layout.headers)
    for number, line in _rows(text, layout):
        cells = layout.dialect.cells(line)
        if len(cells) != width:
            raise InputError(
                f"the row has {len(cells)} columns and the header has {width}",
                where=f"{label}, row {number}",
                remedy="repair or remove the row",
            )
        for name, position in positions.items():
            value = layout.dialect.number(cells[position])
            if value is None:
                held = f"the text {cells[position]!r}" if cells[position] else "an empty cell"
                raise InputError(
                    f"column {name!r} has {held} where a number is needed",
                    where=f"{label}, row {number}",
                    remedy="repair or remove the row",
                )
            columns[name].append(value)
    return {name: np.array(values) for name, values in columns.items()}
