"""Pages: their parts, and how they become one file that needs nothing else."""

import base64
import gzip
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from stickslip.outputs import check_page_suffix, whole_file
from stickslip.presentation.drawing import Plot, legend
from stickslip.presentation.table import Cell, Table
from stickslip.presentation.words import typeset, value_text
from stickslip.records import ScenarioTables

if TYPE_CHECKING:
    import jinja2


class Text(NamedTuple):
    """A paragraph, with its class (``"lead"``, ``"reason"``, ``"missing"``) if it has one."""

    kind = "text"
    text: str
    style: str = ""
    strong: str = ""


class Listed(NamedTuple):
    """Sentences as a list."""

    kind = "listed"
    sentences: Sequence[str]


class Heading(NamedTuple):
    """A heading within a section; code for the name of a table of a file."""

    kind = "heading"
    text: str
    code: bool = False


class Grid(NamedTuple):
    """Figures beside each other, with one legend for all or each with its own."""

    kind = "grid"
    plots: Sequence[Plot]
    shared: bool = True

    @property
    def traces(self) -> list[dict[str, Any]]:
        """Traces of all figures."""
        return [trace for plot in self.plots for trace in plot.traces]


class Fold(NamedTuple):
    """Blocks that are hidden until their summary is clicked."""

    kind = "fold"
    summary: str
    blocks: "Sequence[Block]"


class Markup(NamedTuple):
    """HTML, whose author has escaped what comes from a user."""

    kind = "markup"
    html: str


Block = Text | Listed | Heading | Grid | Fold | Markup | Table | Plot


class Section(NamedTuple):
    """A section of a page, with a link to it at the top."""

    anchor: str
    name: str
    blocks: Sequence[Block]
    link: str = ""  # its text; empty for the name


class Fact(NamedTuple):
    """A figure of merit in the head of a page."""

    term: str
    value: str
    meaning: str = ""
    code: bool = False


class Verdict(NamedTuple):
    """The outcome, at the top of a page."""

    good: bool
    word: str
    text: str
    reasons: Sequence[str] = ()


@dataclass(frozen=True, kw_only=True)
class Page:
    """A page: its head, its sections in their order, and the version that wrote it."""

    title: str  # of the window
    kicker: str  # kind of page, above its name
    name: str
    sections: Sequence[Section]
    version: str
    lead: Sequence[Block] = ()  # below the name
    verdict: Verdict | None = None
    facts: Sequence[Fact] = ()


def headed_list(heading: str, sentences: Sequence[str]) -> list[Block]:
    """Return sentences as a list under a heading; nothing if there are none."""
    return [Heading(heading), Listed(sentences)] if sentences else []


def write_page(page: Page, path: Path | str) -> Path:
    """Write a page, once it is known that it can be, and return where."""
    target = Path(path)
    check_page_suffix(target)
    with whole_file(target, what="the report") as stream:
        stream.write(rendered(page))
    return target


def rendered(page: Page) -> str:
    """Return a page as HTML; it has scripts only if there is something to draw."""
    plots = {each.anchor: each for each in plots_on(page.sections)}
    blocks = [block for section in page.sections for block in section.blocks]
    drawn = bool(plots) or any(
        isinstance(each, Markup) and "<script" in each.html for each in blocks
    )
    data = {anchor: plot.to_plotly() for anchor, plot in plots.items()}
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return filled(
        "page.html",
        page=page,
        drawn=drawn,
        plots=_base64(gzip.compress(text.encode(), mtime=0)),
        plotly=packed_plotly() if drawn else "",
    ).html


def plots_on(sections: Iterable[Section]) -> Iterator[Plot]:
    """Yield the figures of sections, in their order."""

    def of_blocks(blocks: Iterable[Block]) -> Iterator[Plot]:
        for block in blocks:
            if isinstance(block, Plot):
                yield block
            elif isinstance(block, Grid):
                yield from block.plots
            elif isinstance(block, Fold):
                yield from of_blocks(block.blocks)

    for section in sections:
        yield from of_blocks(section.blocks)


def scenario_blocks(scenario: ScenarioTables, file: str, sha256: str) -> list[Block]:
    """Return the contents of a scenario, table by table, and where it came from."""
    blocks: list[Block] = []
    for name, keys in scenario.items():
        if keys:
            facts = [(key, value_text(value, unit)) for key, (value, unit) in keys.items()]
            blocks += [Heading(f"[{name}]", code=True), Table.of_facts(facts)]
    source = Table.of_facts([("Scenario", file), ("SHA-256", Cell(sha256, "code"))])
    return [*blocks, Heading("Provenance"), source]


@cache
def packed_plotly() -> str:
    """Return the basic bundle of plotly.js (scatter, bar and pie), as base64 of its gzip file.

    The browser unpacks it, as it does the figures, which makes a page a third of the size.
    """
    packed = files("stickslip.presentation").joinpath("plotly", "plotly-basic.min.js.gz")
    return _base64(packed.read_bytes())


def filled(template: str, **values: Any) -> Markup:
    """Return a template of this package filled in."""
    return Markup(_environment().get_template(template).render(**values))


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _resource(name: str) -> str:
    return files("stickslip.presentation").joinpath("templates", name).read_text(encoding="utf-8")


@cache
def _environment() -> "jinja2.Environment":
    import jinja2

    made = jinja2.Environment(
        loader=jinja2.PackageLoader("stickslip.presentation"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    filters: dict[str, Any] = {"typeset": typeset, "legend": legend, "resource": _resource}
    made.filters.update(filters)
    return made
