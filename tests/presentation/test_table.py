"""A table is built once; the terminal and the page show the same of it."""

from pathlib import Path

import pytest
from pages import browsed
from terminals import printed_on

from stickslip.presentation import Cell, Column, Table
from stickslip.presentation.page import Markup, Page, Section, rendered
from stickslip.presentation.table import print_table

COLUMNS = (
    Column("Name", "left"),
    Column("RMSE [m]"),
    Column("Only here", only="page"),
    Column("Long heading", short="long\nheading"),
    Column("Why", "left"),
)


def table(count: int) -> Table:
    rows = [(f"row <{k}>", f"-{k} m", "p", "x", Cell("bad", "bad", "a & b")) for k in range(count)]
    return Table(columns=COLUMNS, rows=rows, what="things")


def printed(made: Table, width: int = 100) -> list[str]:
    return printed_on(width, print_table, made).splitlines()


def page(made: Table) -> str:
    section = Section("one", "One", [made])
    return rendered(Page(title="", kicker="", name="", sections=[section], version="0"))


def test_both_show_every_cell_that_is_for_them() -> None:
    made = table(3)
    text, source = "\n".join(printed(made)), page(made)
    for k in range(3):
        assert f"row <{k}>" in text
        assert f"row &lt;{k}&gt;" in source  # escaped
        assert f"-{k} m" in text
        assert f"−{k}\u00a0m" in source
    assert "name" in text.split()
    assert "RMSE [m]" in text
    assert "Only here" in source
    assert "Only here" not in text
    assert "Long heading" in source
    assert "✗ bad" in source
    assert "a &amp; b" in source
    assert "a & b" not in text


@pytest.mark.parametrize(("count", "printed_rows", "page_rows"), [(31, 31, 31), (47, 31, 46)])
def test_long_tables_are_shortened(count: int, printed_rows: int, page_rows: int) -> None:
    """Up to 31 and 46 rows are shown whole; of more, 20 and 10, or 30 and 15, and what is left."""
    made = table(count)
    lines = [line for line in printed(made) if " m " in line or line.strip() == "…"]
    assert len(lines) == printed_rows
    source = page(made)
    assert source.count("<tr>") - 1 == page_rows
    assert ("2 more things, all of them in the JSON file" in source) == (count == 47)


def test_no_console_cuts_a_column() -> None:
    lines = printed(table(2), width=30)
    assert max(map(len, lines)) <= 30
    assert sum("name" in line.split() for line in lines) == 2
    assert "…" not in "".join(lines)


_MEASURED = """<script>addEventListener("load", () => {
  const tables = [...document.querySelectorAll(".wide")];
  document.body.dataset.cut = tables.filter(each => each.scrollWidth > each.clientWidth).length;
});</script>"""


@pytest.mark.parametrize("interval", ["4.99943 ± 0.00098", "0.0361 (0.0243 to 0.0458)"])
def test_a_wide_table_fits_a_page_on_a_desktop(interval: str, tmp_path: Path) -> None:
    """As wide as those of the axes of a log and of estimators: values with intervals in a row."""
    columns = [Column("Axis", "left"), Column("Status", "left")]
    columns += [Column("Viscous friction [N s/m]") for _ in range(7)]
    cells = [Cell("Not identifiable from this log", "bad"), *[interval] * 7]
    section = Section(
        "one", "One", [Table(columns=columns, rows=[["a", *cells]]), Markup(_MEASURED)]
    )
    path = tmp_path / "page.html"
    path.write_text(rendered(Page(title="", kicker="", name="", sections=[section], version="0")))
    assert 'data-cut="0"' in browsed(path, "--window-size=1200,900")
