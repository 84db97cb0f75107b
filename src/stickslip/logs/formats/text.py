"""Text logs: columns between commas, semicolons, tabs or blanks."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from stickslip.logs.formats.text_layout import BLANKS, COMMENTS, SNIFFED_LINES, Layout, find_layout
from stickslip.logs.table import Column, Table, name_columns
from stickslip.records import InputError, count_of

__all__ = ["read_text"]


@dataclass(frozen=True, kw_only=True)
class _Text:
    """A file whose encoding is known."""

    path: Path
    encoding: str

    def lines(self) -> Iterator[str]:
        """Yield the lines, whatever ends them."""
        with self.path.open(encoding=self.encoding) as file:
            yield from file


def read_text(path: Path) -> Table:
    """Read the layout of a text log; the rows themselves are read when columns are asked for.

    Understood: commas, semicolons, tabs or blanks between columns, decimal commas, a header row, a
    row of units below it or units in its names, comment lines and other lines before it, quoted
    names, and UTF-8, UTF-16 and Latin-1 text.

    Raises
    ------
    InputError
        If the file holds no table of numbers.
    """
    text = _Text(path=path, encoding=_encoding(path))
    layout = find_layout(list(islice(text.lines(), SNIFFED_LINES)), path.name)
    headers, units = name_columns(layout.headers)
    notes = layout.notes
    if text.encoding == "latin-1":
        notes = (*notes, "the text is not UTF-8 and was read as Latin-1")
    used = [position for position, header in enumerate(layout.headers) if header.strip()]

    def load(names: Sequence[str]) -> dict[str, Column]:
        positions = {
            name: position for name, position in zip(headers, used, strict=True) if name in names
        }
        rows = _fast(text, layout, None)
        if rows is not None and rows.shape[1] == len(layout.headers):
            return {name: rows[:, position] for name, position in positions.items()}
        if _widths_agree(text, layout):  # the columns that are not wanted may hold anything
            rows = _fast(text, layout, list(positions.values()))
            if rows is not None:
                return dict(zip(positions, rows.T, strict=True))
        return _careful(text, layout, positions)

    def place(_: str, sample: int) -> str:
        number, _ = next(islice(_rows(text, layout), sample, None))
        return f"{path.name}, row {number}"

    return Table(label=path.name, headers=headers, units=units, load=load, place=place, notes=notes)


def _encoding(path: Path) -> str:
    content = path.read_bytes()
    utf_16 = content.startswith((b"\xff\xfe", b"\xfe\xff"))
    for encoding in ("utf-16",) if utf_16 else ("utf-8-sig", "latin-1"):
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return encoding
    raise InputError(
        "the file is not text",
        where=path.name,
        remedy="give it the ending of its format, such as .mat or .parquet",
    )


def _rows(text: _Text, layout: Layout) -> Iterator[tuple[int, str]]:
    """Yield each row with its number as an editor counts it."""
    for number, line in enumerate(text.lines(), 1):
        if number > layout.first_row and not line.lstrip().startswith(COMMENTS):
            row = line if '"' in line else _REMARK.sub("", line)
            if row.strip():
                yield number, row


_REMARK = re.compile(r"(?<=\s)#.*")  # a # without a blank before it begins a cell, such as #N/A


def _widths_agree(text: _Text, layout: Layout) -> bool:
    """Return whether all rows are seen at a glance to have the header's width."""
    delimiter = layout.dialect.delimiter
    between = len(layout.headers) - 1
    return delimiter != BLANKS and all(
        line.count(delimiter) == between and '"' not in line
        for line in islice(text.lines(), layout.first_row, None)
    )


def _fast(text: _Text, layout: Layout, positions: list[int] | None) -> np.ndarray | None:
    """Return the columns in these places, or all, at once; None if they are not all numbers."""
    delimiter = layout.dialect.delimiter
    if layout.dialect.decimal == ",":  # no points then: whether they mean thousands is not known
        source = (line.replace(".", "?").replace(",", ".") for line in text.lines())
    else:
        source = str(text.path)
    try:
        return np.loadtxt(
            source,
            delimiter=None if delimiter == BLANKS else delimiter,
            skiprows=layout.first_row,
            comments="#",
            quotechar='"',
            usecols=positions,
            ndmin=2,
            encoding=text.encoding,
        )
    except ValueError:
        return None


def _careful(text: _Text, layout: Layout, positions: dict[str, int]) -> dict[str, Column]:
    """Return the wanted columns, cell by cell, and name the first cell that is at fault."""
    columns: dict[str, list[float]] = {name: [] for name in positions}
    width = len(layout.headers)
    for number, line in _rows(text, layout):
        cells = layout.dialect.cells(line)
        if len(cells) != width:
            raise InputError(
                f"the row has {count_of(len(cells), 'column')} and the header has {width}",
                where=f"{text.path.name}, row {number}",
                remedy="repair or remove the row",
            )
        for name, position in positions.items():
            value = layout.dialect.number(cells[position])
            if value is None:
                held = f"the text {cells[position]!r}" if cells[position] else "an empty cell"
                raise InputError(
                    f"column {name!r} has {held} where a number is needed",
                    where=f"{text.path.name}, row {number}",
                    remedy="repair or remove the row",
                )
            columns[name].append(value)
    return {name: np.array(values) for name, values in columns.items()}
