"""How a text log is laid out: what separates its columns, where its header and its rows are."""

import csv
import re
from dataclasses import dataclass

from stickslip.logs.units import is_unit
from stickslip.records import InputError, count_of

__all__ = ["BLANKS", "COMMENTS", "SNIFFED_LINES", "Dialect", "Layout", "find_layout"]

SNIFFED_LINES = 500
"""A header must end and data must begin within this many lines."""

_SNIFFED_ROWS = 50
"""Rows of data that decide on the dialect."""

COMMENTS = ("#", "%", "//")

BLANKS = " "
"""Stands for columns between runs of blanks, as the delimiters of other dialects are."""


@dataclass(frozen=True, kw_only=True)
class Dialect:
    """How columns and decimals are written."""

    delimiter: str
    decimal: str

    def cells(self, line: str) -> list[str]:
        """Return the cells of one line."""
        if '"' not in line:
            row = line.split(None if self.delimiter == BLANKS else self.delimiter)
            return [cell.strip() for cell in row]
        if self.delimiter == BLANKS:
            line = re.sub(r"\s+", " ", line)
        try:
            row = next(csv.reader([line.strip()], delimiter=self.delimiter, skipinitialspace=True))
        except (csv.Error, StopIteration):  # an endless cell, or an empty line
            row = [line]
        return [cell.strip() for cell in row]

    def number(self, cell: str) -> float | None:
        """Return the number in a cell, or None if it holds none."""
        if self.decimal == ",":
            cell = "?" if "." in cell else cell.replace(",", ".")
        try:
            value = float(cell)
        except ValueError:
            return None
        return None if "_" in cell else value


_DIALECTS = tuple(
    Dialect(delimiter=delimiter, decimal=decimal)
    for decimal in (".", ",")
    for delimiter in (",", ";", "\t", BLANKS)
    if decimal != delimiter
)


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Where things are in a text log; lines are counted from 0."""

    dialect: Dialect
    headers: tuple[str, ...]
    first_row: int
    notes: tuple[str, ...]


def find_layout(lines: list[str], label: str) -> Layout:
    """Find out how a text log is laid out from its first lines.

    Raises
    ------
    InputError
        If there are no rows of numbers, or not as many names as columns.
    """
    content = [
        (number, line)
        for number, line in enumerate(lines)
        if line.strip() and not line.lstrip().startswith(COMMENTS)
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


def _first_row(dialect: Dialect, lines: list[tuple[int, str]], width: int) -> int | None:
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


def _score(dialect: Dialect, lines: list[tuple[int, str]]) -> tuple[int, int]:
    """Return how many of the last lines are all numbers in a dialect, and how many numbers."""
    rows = [dialect.cells(line) for _, line in lines[-_SNIFFED_ROWS:]]
    numbers = [
        sum(dialect.number(cell) is not None for cell in row) if len(row) > 1 else 0 for row in rows
    ]
    full = [count for count, row in zip(numbers, rows, strict=True) if count == sum(map(bool, row))]
    return sum(count > 0 for count in full), sum(numbers)


def _width(dialect: Dialect, lines: list[tuple[int, str]]) -> int:
    """Return the most frequent width of lines that have numbers."""
    widths = [
        len(row)
        for row in (dialect.cells(line) for _, line in lines[-_SNIFFED_ROWS:])
        if any(dialect.number(cell) is not None for cell in row)
    ]
    return max(widths, key=widths.count, default=0)


def _named(dialect: Dialect, lines: list[str], first: int, width: int, label: str) -> Layout:
    """Find the header above the first row: a line of names, perhaps with units below it."""
    above = [(number, line.strip()) for number, line in enumerate(lines[:first]) if line.strip()]
    plain = [(number, line) for number, line in above if not line.startswith(COMMENTS)]
    commented = [line for _, line in above if line.startswith(COMMENTS)]
    last, upper = (
        _names(dialect, line, width) for _, line in [*plain[:-3:-1], (0, ""), (0, "")][:2]
    )
    notes: tuple[str, ...] = ()
    if last and upper and all(not cell or is_unit(cell) for cell in last):
        headers = [
            f"{name} [{unit.strip('[]() ')}]" if unit else name
            for name, unit in zip(upper, last, strict=True)
        ]
    elif headers := last or _names(dialect, commented[-1] if commented else "", width):
        pass
    elif plain and dialect.delimiter != BLANKS and dialect.delimiter in plain[-1][1]:
        number, line = plain[-1]
        raise InputError(
            f"the header has {count_of(len(dialect.cells(line)), 'column')} and the rows have "
            f"{width}",
            where=f"{label}, row {number + 1}",
            remedy="give every column one name",
        )
    else:
        headers = [f"column_{k + 1}" for k in range(width)]
        notes = (f"there is no header row; the columns are called column_1 to column_{width}",)
    return Layout(dialect=dialect, headers=tuple(headers), first_row=first, notes=notes)


def _names(dialect: Dialect, line: str, width: int) -> list[str] | None:
    """Return the names in a line, which may be a comment, or None if they are not as many."""
    line = line.lstrip("".join(COMMENTS)).strip()
    if dialect.delimiter == BLANKS:
        line = re.sub(r"\s+(?=[\[(])", "", line)
    cells = dialect.cells(line)
    return cells if len(cells) == width and any(cells) else None
