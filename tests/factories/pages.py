"""Content of a written page, read back."""

import base64
import gzip
import html.parser
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from stickslip.presentation import results
from stickslip.presentation.page import rendered

MOST_BYTES = 1_500_000
"""Size of a page; the drawing library is 0.53 MB of it."""


def plots_of(text: str) -> dict[str, Any]:
    """Return the drawings of a page, by their anchors."""
    found = re.search(r'<script type="text/plain" id="plots">(.*?)</script>', text)
    return json.loads(gzip.decompress(base64.b64decode(found[1])))


def browsed(page: Path, *options: str) -> str:
    """Return the document of a page after Chromium has run it without a complaint, or skip."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser is None:
        pytest.skip("no Chromium on this machine to render the page with")
    outcome = subprocess.run(
        [
            browser,
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--enable-logging=stderr",
            *options,
            f"--user-data-dir={page.parent / 'profile'}",
            "--dump-dom",
            page.as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    assert [line for line in outcome.stderr.splitlines() if ":CONSOLE" in line] == []
    return outcome.stdout


class Page(html.parser.HTMLParser):
    """Tags with attributes, visible text, styles and drawings of a page."""

    def __init__(self, page: Path | str) -> None:
        super().__init__()
        self.source = page.read_text() if isinstance(page, Path) else page
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


def page_of(result: results.Result) -> Page:
    """Return the page of a result, read back."""
    return Page(rendered(results.page_of(result)))
