"""What every page is put together from: its head, its contents, its sections, and the look."""

import html
from importlib.resources import files
from typing import NamedTuple

__all__ = ["Section", "contents", "head", "section", "template"]


class Section(NamedTuple):
    """A section of a page; its name and body are HTML."""

    anchor: str
    name: str
    body: str


def head(title: str, *, policy: str) -> str:
    """Return the beginning of a page, up to its body.

    Parameters
    ----------
    title
        Plain text.
    policy
        Content security policy: the browser itself refuses to fetch anything for the page.
    """
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(title)}</title>\n<style>\n{template('page.css')}</style>\n"
        "</head>\n<body>\n"
    )


def contents(listed: list[tuple[str, str]]) -> str:
    """Return links to the sections, each given by its anchor and its name."""
    items = "".join(f'<li><a href="#{anchor}">{name}</a></li>' for anchor, name in listed)
    return f'<nav class="contents" aria-label="Contents"><ul>{items}</ul></nav>\n'


def section(anchor: str, name: str, body: str) -> str:
    """Return a section with its heading; name and body are HTML."""
    return f'<section id="{anchor}">\n<h2>{name}</h2>\n{body}</section>\n'


def template(name: str) -> str:
    """Return a file of the look."""
    return files("stickslip.report").joinpath("template", name).read_text(encoding="utf-8")
