"""Tables in Markdown."""

from collections.abc import Sequence


def table(head: Sequence[str], rows: Sequence[Sequence[str]], *, words: int | None = None) -> str:
    """Return a table; with ``words``, columns after that many hold numbers, on the right."""
    left = len(head) if words is None else words
    rule = ["---" if k < left else "---:" for k in range(len(head))]
    lines = ["| " + " | ".join(row) + " |" for row in (head, rule, *rows)]
    return "\n".join(lines) + "\n"
