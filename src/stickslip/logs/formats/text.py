"""Text logs: columns between commas, semicolons, tabs or blanks, below a header."""

import codecs
import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.logs.formats.twincat import is_twincat, read_twincat
from stickslip.logs.table import Column, RateGroup, Table, is_slower, name_columns
from stickslip.logs.unit_spelling import is_unit
from stickslip.records import InputError

_SNIFFED_LINES = 500  # a header must end and data must begin within this many lines

_SNIFFED_ROWS = 50  # rows of data that decide on the dialect

_LONGEST_LINE = 10_000_000  # characters; what has longer lines is no text log

_LARGE = 20_000_000  # bytes from which a library that takes a while to load is worth its time

_BLOCK = 1 << 24  # bytes decoded or parsed at once

_COMMENTS = ("#", "%", "//")
_REMARK = re.compile(r"(?<=\s)#.*")  # a # without a blank before it begins a cell, such as #N/A

_END_OF_HEADER, _UNITS, _X_VALUE = "***End_of_Header***", "Y_Unit_Label", "X_Value"
"""In a LabVIEW measurement file: the line before the names of columns, that of units, the time."""

_MOMENT = re.compile(
    r"(?:(?:(?P<date>\d{4}([-/])\d\d\2\d\d)|(?P<day>\d\d)\.(?P<month>\d\d)\.(?P<year>\d{4}))[T ])?"
    r"(?P<clock>\d\d:\d\d:\d\d)(?:[.,](?P<fraction>\d{1,9}))?(?P<offset>Z|[+-]\d\d:?\d\d)?"
)
"""A date and time of day, or a time of day: 2024-12-31 (ISO 8601), 2024/12/31 or 31.12.2024."""

_DAY = 86400.0  # [s]

_GROUPED = {
    ".": re.compile(r"[+-]?\d{1,3}(,\d{3})+\.\d*"),
    ",": re.compile(r"[+-]?\d{1,3}(\.\d{3})+,\d*"),
}
"""Numbers with separators of thousands, by the decimal sign that they must have to be clear."""

_BLANKS = " "  # delimiter of columns between runs of blanks


def read_text(path: Path) -> Table:
    """Read the layout of a text log; the rows themselves are read when columns are asked for.

    Understood: commas, semicolons, tabs or blanks between columns, decimal commas, a header row, a
    row of units below it or units in its names, comment lines and other lines before it, the
    header of a LabVIEW measurement file, quoted names, and UTF-8, UTF-16 and Latin-1 text.
    """
    text = _Text(path=path, encoding=_encoding(path))
    lines = text.first_lines()
    if is_twincat(lines):
        return read_twincat(lines, text.lines(), path.name)
    layout = _find_layout(lines, path.name)
    headers, units = name_columns(layout.headers)
    notes = layout.notes
    if text.encoding == "latin-1":
        notes = (*notes, "the text is not UTF-8 and was read as Latin-1")
    used = [position for position, header in enumerate(layout.headers) if header.strip()]
    positions = dict(zip(headers, used, strict=True))
    dated = {name for name, position in positions.items() if position in layout.dated}
    units |= dict.fromkeys(dated, "s")
    notes = (
        *notes,
        *(f"column {name!r} is read as seconds since its first date" for name in dated),
    )

    def load(names: Sequence[str]) -> dict[str, Column]:
        wanted = {name: positions[name] for name in names}
        dates = {name: position for name, position in wanted.items() if name in dated}
        numbers = {name: position for name, position in wanted.items() if name not in dated}
        columns = _numbers(text, layout, numbers) if numbers else {}
        return {**columns, **(_careful(text, layout, dates, dates=True) if dates else {})}

    def place(_: str, sample: int) -> str:
        number, _ = next(islice(_rows(text, layout), sample, None))
        return f"{path.name}, row {number}"

    time = _X_VALUE if layout.labview and _X_VALUE in headers else None
    return Table(
        label=path.name,
        headers=headers,
        units=units,
        load=load,
        place=place,
        notes=notes,
        groups=(RateGroup(columns=tuple(headers), time=time),),
    )


@dataclass(frozen=True, kw_only=True)
class _Text:
    """A file whose encoding is known."""

    path: Path
    encoding: str

    def lines(self) -> Iterator[str]:
        """Yield the lines, whatever ends them."""
        with self.path.open(encoding=self.encoding) as file:
            yield from file

    def first_lines(self) -> list[str]:
        """Return the lines in which the layout must show."""
        with self.path.open(encoding=self.encoding) as file:
            lines = [file.readline(_LONGEST_LINE) for _ in range(_SNIFFED_LINES)]
        if any(len(line) == _LONGEST_LINE for line in lines):
            raise InputError("line_too_long", where=self.path.name, limit=_LONGEST_LINE)
        return [line for line in lines if line]


def _encoding(path: Path) -> str:
    with path.open("rb") as file:
        utf_16 = file.read(2) in {b"\xff\xfe", b"\xfe\xff"}
    for encoding in ("utf-16",) if utf_16 else ("utf-8-sig", "latin-1"):
        try:
            if _decodes(path, encoding):
                return encoding
        except UnicodeDecodeError:
            continue
    raise InputError("not_text", where=path.name)


def _decodes(path: Path, encoding: str) -> bool:
    """Return whether a file has no character zero; what is not in the encoding is an error."""
    decoder = codecs.getincrementaldecoder(encoding)()
    with path.open("rb") as file:
        while block := file.read(_BLOCK):
            if encoding != "utf-16" and block.isascii():  # quicker than to decode it
                if b"\0" in block:
                    return False
                decoder.decode(b"\n" if decoder.getstate()[0] else b"")
            elif "\0" in decoder.decode(block):
                return False
    decoder.decode(b"", final=True)
    return True


@dataclass(frozen=True, kw_only=True)
class _Dialect:
    """Delimiter of columns, and decimal sign."""

    delimiter: str
    decimal: str

    def cells(self, line: str) -> list[str]:
        """Return the cells of one line."""
        if '"' not in line:
            row = line.split(None if self.delimiter == _BLANKS else self.delimiter)
            return [cell.strip() for cell in row]
        if self.delimiter == _BLANKS:
            line = re.sub(r"\s+", " ", line)
        try:
            row = next(csv.reader([line.strip()], delimiter=self.delimiter, skipinitialspace=True))
        except (csv.Error, StopIteration):  # an endless cell, or an empty line
            row = [line]
        return [cell.strip() for cell in row]

    def number(self, cell: str) -> float | None:
        """Return the number in a cell, or None if it holds none."""
        if _GROUPED[self.decimal].fullmatch(cell):
            cell = cell.replace("." if self.decimal == "," else ",", "")
        if self.decimal == ",":
            cell = "?" if "." in cell else cell.replace(",", ".")
        try:
            value = float(cell)
        except ValueError:
            return None
        return None if "_" in cell else value

    def numbers(self, cells: Sequence[str]) -> int:
        """Return how many cells hold a number."""
        return sum(self.number(cell) is not None or bool(_MOMENT.fullmatch(cell)) for cell in cells)


_DIALECTS = tuple(
    _Dialect(delimiter=delimiter, decimal=decimal)
    for decimal in (".", ",")
    for delimiter in (",", ";", "\t", _BLANKS)
    if decimal != delimiter
)


CANDUMP = ("a candump", "python -m can.logconvert in.log out.mf4 and a DBC by asammdf")
"""Name of the format, and the command that converts it."""

_FRAME = re.compile(r"\s*\(\d+\.\d+\)\s+\S+\s+[0-9A-Fa-f]+#")
"""A line of a candump, as in ``(1436509052.249713) vcan0 044#2A366C2B``."""


@dataclass(frozen=True, kw_only=True)
class _Layout:
    """Layout of a text log; lines are counted from 0."""

    dialect: _Dialect
    headers: tuple[str, ...]
    first_row: int
    notes: tuple[str, ...]
    dated: frozenset[int] = frozenset()  # places of columns with a date or a time of day
    labview: bool = False  # whether it is a LabVIEW measurement file


def _find_layout(lines: list[str], label: str) -> _Layout:
    """Return the layout of a text log, from its first lines."""
    ends = [number for number, line in enumerate(lines) if line.startswith(_END_OF_HEADER)]
    begin = ends[-1] + 1 if ends else 0
    content = [
        (number, line)
        for number, line in enumerate(lines[begin:], begin)
        if line.strip() and not line.lstrip().startswith(_COMMENTS)
    ]
    ending = [line for _, line in content[-_SNIFFED_ROWS:]]
    dialect = max(_DIALECTS, key=lambda dialect: _score(dialect, ending))
    # The most frequent width of lines that have numbers
    rows = [dialect.cells(line) for line in ending]
    widths = [len(row) for row in rows if dialect.numbers(row)]
    width = max(widths, key=widths.count, default=0)
    first = _first_row(dialect, content, width)
    if first is None:
        if any(_FRAME.match(line) for line in ending):
            name, command = CANDUMP
            raise InputError("other_format", where=label, format=name, command=command)
        raise InputError("no_rows_of_numbers", where=label)
    return replace(_named(dialect, lines, first, width, label), labview=bool(ends))


def _score(dialect: _Dialect, lines: list[str]) -> tuple[int, int]:
    """Return how many lines are all numbers in a dialect, and how many numbers there are."""
    rows = [dialect.cells(line) for line in lines]
    numbers = [dialect.numbers(row) if len(row) > 1 else 0 for row in rows]
    full = [count for count, row in zip(numbers, rows, strict=True) if count == sum(map(bool, row))]
    return sum(count > 0 for count in full), sum(numbers)


def _first_row(dialect: _Dialect, lines: list[tuple[int, str]], width: int) -> int | None:
    """Return the first line of data: all numbers, or half of them right below a line of names."""
    partly: int | None = None
    below_names = False
    for number, line in lines:
        cells = dialect.cells(line)
        filled, numbers = sum(map(bool, cells)), dialect.numbers(cells)
        full = 0 < numbers == filled
        half = 2 * numbers >= filled > 0 and len(cells) == width
        if (full and len(cells) == width) or (below_names and (full or half)):
            return number
        if half and partly is None:
            partly = number
        below_names = len(cells) == width and numbers == 0
    return partly


def _named(dialect: _Dialect, lines: list[str], first: int, width: int, label: str) -> _Layout:
    """Return the layout with the header above the first row: names, perhaps units below them."""
    above = [(number, line.strip()) for number, line in enumerate(lines[:first]) if line.strip()]
    plain = [(number, line) for number, line in above if not line.startswith(_COMMENTS)]
    commented = [line for _, line in above if line.startswith(_COMMENTS)]
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
    elif plain and dialect.delimiter != _BLANKS and dialect.delimiter in plain[-1][1]:
        number, line = plain[-1]
        raise InputError(
            "header_of_other_width",
            where=f"{label}, row {number + 1}",
            columns=len(dialect.cells(line)),
            width=width,
        )
    else:
        headers = [f"column_{k + 1}" for k in range(width)]
        notes = (f"there is no header row; the columns are called column_1 to column_{width}",)
    headers = _with_labview_units(dialect, lines[:first], headers)
    dated = frozenset(
        k for k, cell in enumerate(dialect.cells(lines[first])) if _MOMENT.fullmatch(cell)
    )
    return _Layout(
        dialect=dialect, headers=tuple(headers), first_row=first, notes=notes, dated=dated
    )


def _with_labview_units(dialect: _Dialect, above: list[str], headers: list[str]) -> list[str]:
    """Return headers with the units that a LabVIEW measurement file states; time is in seconds."""
    rows = [dialect.cells(line) for line in above if line.startswith(_UNITS)]
    if not rows:
        return headers
    units = ["s", *rows[-1][1:]][: len(headers)]
    units += [""] * (len(headers) - len(units))
    return [
        f"{name} [{unit}]" if name and unit else name
        for name, unit in zip(headers, units, strict=True)
    ]


def _names(dialect: _Dialect, line: str, width: int) -> list[str] | None:
    """Return the names in a line, which may be a comment, or None if they are not as many."""
    line = line.lstrip("".join(_COMMENTS)).strip()
    if dialect.delimiter == _BLANKS:
        line = re.sub(r"\s+(?=[\[(])", "", line)
    cells = dialect.cells(line)
    if len(cells) == width + 1 and not cells[-1]:  # of a delimiter that the rows do not end with
        cells.pop()
    return cells if len(cells) == width and any(cells) else None


def _rows(text: _Text, layout: _Layout) -> Iterator[tuple[int, str]]:
    """Yield each row with its number as an editor counts it."""
    for number, line in enumerate(text.lines(), 1):
        if number > layout.first_row and not line.lstrip().startswith(_COMMENTS):
            row = line if '"' in line else _REMARK.sub("", line)
            if row.strip():
                yield number, row


def _widths_agree(text: _Text, layout: _Layout) -> bool:
    """Return whether all rows have the header's width, as far as counting delimiters shows."""
    delimiter = layout.dialect.delimiter
    between = len(layout.headers) - 1
    return delimiter != _BLANKS and all(
        line.count(delimiter) == between and '"' not in line
        for line in islice(text.lines(), layout.first_row, None)
    )


def _fast(text: _Text, layout: _Layout, positions: list[int] | None) -> np.ndarray | None:
    """Return the columns in these places, or all, at once; None if they are not all numbers."""
    delimiter = layout.dialect.delimiter
    if layout.dialect.decimal == ",":  # no points then: whether they mean thousands is not known
        source = (line.replace(".", "?").replace(",", ".") for line in text.lines())
    else:
        source = str(text.path)
    try:
        return np.loadtxt(
            source,
            delimiter=None if delimiter == _BLANKS else delimiter,
            skiprows=layout.first_row,
            comments="#",
            quotechar='"',
            usecols=positions,
            ndmin=2,
            encoding=text.encoding,
        )
    except ValueError:
        return None


def _numbers(text: _Text, layout: _Layout, positions: dict[str, int]) -> dict[str, Column]:
    """Return columns of numbers, by the first way that can read them: the last one reads all."""
    columns = _by_arrow(text, layout, positions)
    if columns is not None:
        return columns
    rows = _fast(text, layout, None)
    if rows is not None and rows.shape[1] == len(layout.headers):
        return {name: rows[:, position] for name, position in positions.items()}
    if _widths_agree(text, layout):  # the columns that are not wanted may hold anything
        rows = _fast(text, layout, list(positions.values()))
        if rows is not None:
            return dict(zip(positions, rows.T, strict=True))
    return _careful(text, layout, positions)


def _by_arrow(text: _Text, layout: _Layout, positions: dict[str, int]) -> dict[str, Column] | None:
    """Return columns of a large file through pyarrow; None without it, or if a cell is no number.

    Nothing is read otherwise than in the ways after this one: an empty cell, a comment and a row of
    another width are errors to pyarrow, and it rounds to the nearest number too.
    """
    delimiter = layout.dialect.delimiter
    if delimiter == _BLANKS or text.encoding != "utf-8-sig":
        return None
    if text.path.stat().st_size < _LARGE:
        return None
    try:
        import pyarrow as pa
        from pyarrow import csv as arrow
    except ImportError:
        return None
    names = [str(k) for k in range(len(layout.headers))]
    wanted = [names[position] for position in positions.values()]
    try:
        table = arrow.read_csv(
            text.path,
            read_options=arrow.ReadOptions(
                skip_rows=layout.first_row, column_names=names, block_size=_BLOCK
            ),
            parse_options=arrow.ParseOptions(delimiter=delimiter),
            convert_options=arrow.ConvertOptions(
                column_types=dict.fromkeys(wanted, pa.float64()),
                include_columns=list(dict.fromkeys(wanted)),
                null_values=[],
                decimal_point=layout.dialect.decimal,
            ),
        )
    except (pa.ArrowException, OSError, ValueError):
        return None
    columns: dict[int, Column] = {}
    for k in dict.fromkeys(positions.values()):
        columns[k] = table.column(names[k]).to_numpy()
        table = table.drop_columns(names[k])  # one copy of all columns at a time
    return {name: columns[k] for name, k in positions.items()}


def _seconds(moments: Sequence[re.Match[str]], name: str, label: str) -> Column:
    """Return dates or times of day as seconds since the first."""
    if len({each["offset"] for each in moments}) > 1:
        raise InputError("several_time_zones", where=label, name=name)
    texts = [f"{_date(each)}T{each['clock']}.{each['fraction'] or '0'}" for each in moments]
    try:
        stamps = np.array(texts, "datetime64[ns]")
    except ValueError as error:
        raise InputError("no_such_date", where=label, name=name, reason=str(error)) from None
    seconds = (stamps - stamps[:1]).astype(np.int64) * 1e-9
    if moments[0]["date"] or moments[0]["day"]:
        return seconds
    return np.unwrap(seconds, period=_DAY)  # a clock begins again at midnight


def _date(moment: re.Match[str]) -> str:
    """Return the date of a moment in the form of ISO 8601; a fixed one for a time of day."""
    if moment["year"]:
        return f"{moment['year']}-{moment['month']}-{moment['day']}"
    return (moment["date"] or "1970-01-01").replace("/", "-")


def _careful(
    text: _Text, layout: _Layout, positions: dict[str, int], *, dates: bool = False
) -> dict[str, Column]:
    """Return the wanted columns, read cell by cell; the first faulty cell is an error."""
    columns: dict[str, list[Any]] = {name: [] for name in positions}
    empty: dict[str, InputError] = {}  # where the first empty cell of a column is
    width = len(layout.headers)
    for number, line in _rows(text, layout):
        cells, where = layout.dialect.cells(line), f"{text.path.name}, row {number}"
        if len(cells) != width:
            raise InputError("row_of_other_width", where=where, columns=len(cells), width=width)
        for name, position in positions.items():
            cell = cells[position]
            value = layout.dialect.number(cell) if not dates else _MOMENT.fullmatch(cell)
            if value is None:
                wanted = "date" if dates else "number"
                code = "cell_of_text" if cell else "cell_empty"
                error = InputError(code, where=where, name=name, cell=cell, wanted=wanted)
                if cell or dates:
                    raise error
                empty.setdefault(name, error)
                value = np.nan
            columns[name].append(value)
    if dates:
        return {name: _seconds(cells, name, text.path.name) for name, cells in columns.items()}
    arrays = {name: np.array(values) for name, values in columns.items()}
    for name, error in empty.items():
        if not is_slower(arrays[name]):
            raise error
    return arrays
