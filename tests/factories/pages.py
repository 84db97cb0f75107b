"""What a written page holds, read back."""

import base64
import gzip
import html.parser
import json
import re
from pathlib import Path
from typing import Any

__all__ = ["MOST_BYTES", "Page", "plots_of"]

MOST_BYTES = 1_500_000
"""Size of a page; the drawing library is 0.53 MB of it."""


def plots_of(text: str) -> dict[str, Any]:
    """Return the drawings of a page, by their anchors."""
    found = re.search(r'<script type="text/plain" id="plots">(.*?)</script>', text)
    assert found is not None
    return json.loads(gzip.decompress(base64.b64decode(found[1])))


class Page(html.parser.HTMLParser):
    """Tags with attributes, visible text, styles and drawings of a page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.source = path.read_text()
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.text = ""
        self.styles = ""
        self._inside = ""
        self.feed(self.source)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, {key: value or "" for key, value in attrs}))
        self._inside = tag

    def handle_endtag(self, tag: str) -> None:  # noqa: ARG002 - the base class' signature
        self._inside = ""

    def handle_data(self, data: str) -> None:
        if self._inside == "style":
            self.styles += data
        elif self._inside != "script":
            self.text += data

    def identifiers(self) -> list[str]:
        return [given["id"] for _, given in self.tags if "id" in given]

    def plots(self) -> dict[str, Any]:
        return plots_of(self.source)
