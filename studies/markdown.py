"""Tables in Markdown."""

from collections.abc import Sequence


def table(head: Sequence[str], rows: Sequence[Sequence[str]], *, words: int | None = None) -> str:
    """Return a table; with ``words``, columns after that many hold numbers, on the right."""
    left = len(head) if words is None else words
    rule = ["---" if k < left else "---:" for k in range(len(head))]
    lines = ["| " + " | ".join(row) + " |" for row in (head, rule, *rows)]
    return "\n".join(lines) + "\n"


def with_table(page: str, title: str, text: str) -> str:
    """Return a page with the text between the marks of one table replaced."""
    begin, end = f"% begin {title}\n", f"% end {title}\n"
    before, rest = page.split(begin)
    _, after = rest.split(end)
    return f"{before}{begin}\n{text}\n{end}{after}"
