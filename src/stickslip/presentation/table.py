"""Tables: built once, rendered to a terminal and to a page."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import rich.table
    from rich.console import Console

Row = Sequence["str | Cell"]
Style = Literal["dense", "parameters", "options", "phases"]
Tone = Literal["", "good", "bad", "code"]

_ON_TERMINAL = (20, 10)  # first and last rows of a long table that are printed
_ON_PAGE = (30, 15)  # likewise on a page
_STYLES = {"": "", "good": "green", "bad": "red", "code": ""}


@dataclass(frozen=True)
class Cell:
    """A cell that is more than text."""

    text: str  #: Its words.
    tone: Tone = ""  #: Whether it is good or bad news; ``"code"`` for text in a fixed width.
    note: str = ""  #: Text that follows on a page.
    symbol: str = ""  #: Letter of a quantity, as HTML, on a page.
    swatch: str = ""  #: Colour that is shown before the text on a page.


@dataclass(frozen=True)
class Column:
    """A column of a table."""

    head: str  #: Its heading.
    align: Literal["left", "right", "center"] = "right"  #: Of text left, of numbers right.
    #: ``"page"`` or ``"terminal"`` for a column that the other leaves out.
    only: Literal["", "page", "terminal"] = ""
    short: str = ""  #: Heading on a terminal; empty for ``head``.
    css: str = ""  #: Class of its cells on a page, as well as that of its alignment.
    width: int = 0  #: Least width on a terminal [characters].

    @property
    def terminal_head(self) -> str:
        """Heading on a terminal, in lower case unless it begins with an abbreviation."""
        begins = self.head[1:2].isupper()
        return self.short or (self.head if begins else self.head[:1].lower() + self.head[1:])


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table, for a terminal and for a page."""

    kind = "table"
    columns: Sequence[Column]  #: Of which the first names the rows.
    rows: Sequence[Row]  #: Cells, as text or with more to them, as many as columns.
    style: Style = "dense"  #: Its class on a page.
    title: str = ""  #: Above it.
    caption: str = ""  #: Above it on a page, in small print.
    what: str = "rows"  #: What a row is, in the plural.

    @staticmethod
    def of_facts(facts: Iterable[tuple[str, str | Cell]]) -> "Table":
        """Return a table of facts, each a name and a text, without headings."""
        columns = (Column("", "left"), Column("", "left"))
        return Table(columns=columns, rows=list(facts), style="options")

    def shown(self, where: Literal["page", "terminal"]) -> list[tuple[int, Column]]:
        """Return the columns that are shown there, with their place in each row."""
        return [(k, each) for k, each in enumerate(self.columns) if each.only in {"", where}]

    def page_rows(self) -> tuple[list[list[Cell]], int, list[list[Cell]]]:
        """Return the rows on a page: the first, how many are left out, and the last."""
        first, left_out, last = _shortened(self.rows, *_ON_PAGE)
        places = [k for k, _ in self.shown("page")]
        begin, end = ([[_cell(row[k]) for k in places] for row in rows] for rows in (first, last))
        return begin, left_out, end

    def to_rich(self, places: Sequence[int] | None = None) -> "rich.table.Table":
        """Return the table for a terminal, with the columns at some places only."""
        from rich import box
        from rich.table import Table as RichTable
        from rich.text import Text

        title = self.title or None
        made = RichTable(box=box.SIMPLE_HEAD, pad_edge=False, title=title, title_justify="left")
        places = [k for k, _ in self.shown("terminal")] if places is None else places
        for k in places:
            column = self.columns[k]
            # The last column of text is one of sentences: it is wrapped where it must be
            wraps = k == len(self.columns) - 1 and column.align == "left"
            made.add_column(
                Text(column.terminal_head),  # "[s]" is a unit, not a style
                justify=column.align,
                no_wrap=not wraps,
                min_width=column.width or None,
            )
        first, left_out, last = _shortened(self.rows, *_ON_TERMINAL)
        for row in [*first, *([["…", *[""] * len(self.columns)]] if left_out else []), *last]:
            cells = [_cell(row[k]) for k in places]
            made.add_row(*(Text(each.text, style=_STYLES[each.tone]) for each in cells))
        return made


def print_table(console: "Console", table: Table) -> None:
    """Print the columns in as many tables as it takes that the console cuts none of them."""
    from rich.measure import Measurement

    unbounded = console.options.update(max_width=10_000)
    (first, _), *others = table.shown("terminal")
    taken: list[int] = []
    for k, _ in others:
        wider = Measurement.get(console, unbounded, table.to_rich([first, *taken, k]))
        if taken and wider.maximum > console.width:
            console.print(table.to_rich([first, *taken]))
            taken = []
        taken.append(k)
    console.print(table.to_rich([first, *taken]))


def _cell(cell: str | Cell) -> Cell:
    return Cell(cell) if isinstance(cell, str) else cell


def _shortened(rows: Sequence[Row], first: int, last: int) -> tuple[list[Row], int, list[Row]]:
    """Return the first rows, how many are left out, and the last rows."""
    if len(rows) <= first + last + 1:
        return list(rows), 0, []
    return list(rows[:first]), len(rows) - first - last, list(rows[-last:])
