"""Prose, dense tables and sections of a page, as HTML."""

import html
import re
from collections.abc import Sequence

from stickslip.presentation.page import Markup, Section

_SYMBOL = re.compile(r"\b([A-Za-zÂσ]\u0302?)_([a-z]+\d?(?:,max)?|\d)")
_WORDS = ' class="words"'


def prose(text: str) -> str:
    """Return plain text as HTML, with the indices of its symbols set low."""
    return _SYMBOL.sub(r"<i>\1</i><sub>\2</sub>", html.escape(text))


def wide(table: str) -> str:
    """Return a table that scrolls by itself where the screen is too narrow for it, and says so."""
    return (
        '<p class="scrolls" aria-hidden="true">↔ this table scrolls sideways</p>\n'
        '<div class="wide" tabindex="0" role="region" aria-label="Table, scrolls sideways">'
        f'<table class="dense">{table}</table></div>\n'
    )


def table(heads: Sequence[str], body: str, *, words: Sequence[str] = ()) -> str:
    """Return a wide table with one row of heads; those of columns of words stand on the left."""
    cells = "".join(
        f'<th scope="col"{_WORDS if head in words else ""}>{prose(head)}</th>' for head in heads
    )
    return wide(f"<thead><tr>{cells}</tr></thead>\n<tbody>\n{body}</tbody>")


def row(name: str, cells: Sequence[str]) -> str:
    """Return a row of numbers under its name; the cells are HTML."""
    numbers = "".join(f'<td class="number">{cell}</td>' for cell in cells)
    return f'<tr><th scope="row">{prose(name)}</th>{numbers}</tr>\n'


def typeset(number: str) -> str:
    """Return a number with a minus sign for a hyphen."""
    return number.replace("-", "−")


def section(anchor: str, name: str, body: str) -> Section:
    """Return a section of a page whose body is HTML."""
    return Section(anchor, name, [Markup(body)])
