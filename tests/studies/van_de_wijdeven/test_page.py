"""The page of a reproduction holds all it shows, and its pictures depend on their record alone."""

import base64
import html.parser
import re
import shutil
import struct
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studies.van_de_wijdeven.page import picture, reproduction_page
from studies.van_de_wijdeven.records import (
    Claim,
    Curve,
    EnergyReproduction,
    FiveRuns,
    Panel,
    ReproducedFigure,
    VariantScore,
)

NAMES = ("coulomb_friction", "viscous_friction")


class Page(html.parser.HTMLParser):
    """The tags of a page with their attributes, and its visible text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.text = ""
        self._hidden = False
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, {key: value or "" for key, value in attrs}))
        self._hidden = tag == "style"

    def handle_endtag(self, tag: str) -> None:  # noqa: ARG002 - the base class' signature
        self._hidden = False

    def handle_data(self, data: str) -> None:
        if not self._hidden:
            self.text += data


def figure(number: str = "6.1", *, columns: int = 1, rows: int = 2) -> ReproducedFigure:
    x = np.linspace(0.0, 10.0, 101)
    panel = Panel(
        title="a panel",
        x_label="time [s]",
        y_label="error e_y [J]",
        curves=(
            Curve(label="estimate", role="first", x=x, y=np.sin(x)),
            Curve(label="truth", role="truth", x=x[[0, -1]], y=np.zeros(2)),
        ),
    )
    return ReproducedFigure(
        number=number,
        title="An error <b>",
        caption="Of W_c & others.",
        columns=columns,
        panels=(panel,) * (rows * columns),
    )


def claim(*, agrees: bool) -> Claim:
    return Claim(
        place="Eq. 5.5",
        statement="Noise <i>has</i> no effect on σ_v1².",
        criterion="its mean is 0",
        measured="−0.4 J",
        agrees=agrees,
        why="E{u v} = −K_d σ_v²",
        numbers={"mean": -0.4},
    )


def score(loop: str, noise: float, *, sure: bool) -> VariantScore:
    return VariantScore(
        loop="feedforward" if loop == "feedforward" else "feedback",
        variant="robust" if sure else "printed",
        noise=noise,
        assumed=None if sure else 0.5,
        runs=20,
        failed=0,
        bias=dict(zip(NAMES, (-0.0123, 1.5), strict=True)),
        rmse=dict(zip(NAMES, (0.0234, np.nan if sure else 1.6), strict=True)),
        coverage=dict(zip(NAMES, (0.95, 1.0), strict=True)) if sure else None,
    )


@pytest.fixture
def reproduction() -> EnergyReproduction:
    return EnergyReproduction(
        title="A part",
        setting="With <surrogate> values.",
        values={"truth": {"coulomb_friction": (0.15, "N")}},
        figures=(figure(), figure("6.3", columns=2)),
        five_runs=tuple(
            FiveRuns(
                loop=loop,
                case="without noise",
                values={name: np.array([0.1, -0.2]) for name in NAMES},
                itse=np.array([1.0, 12345.6]),
            )
            for loop in ("feedforward", "feedback")
        ),
        variants=tuple(
            score(loop, noise, sure=sure)
            for loop in ("feedforward", "feedback")
            for noise in (0.5, 1.0)
            for sure in (False, True)
        ),
        claims=(claim(agrees=True), claim(agrees=False), claim(agrees=False)),
        options={"runs": 20, "seed": 1},
        stickslip_version="1.2.3",
    )


def page_of(reproduction: EnergyReproduction) -> Page:
    pictures = {each.number: picture(each) for each in reproduction.figures}
    return Page(reproduction_page(reproduction, pictures))


def test_nothing_is_fetched_and_no_script_is_there(reproduction: EnergyReproduction) -> None:
    page = page_of(reproduction)
    for tag, given in page.tags:
        assert tag not in {"script", "link", "iframe", "object", "embed", "base"}
        for name in ("src", "href", "action", "data", "srcset", "poster"):
            address = given.get(name, "#")
            assert address.startswith(("#", "data:image/png;base64,")), (tag, name)
    policy = next(given["content"] for tag, given in page.tags if "http-equiv" in given)
    assert policy.startswith("default-src 'none'")
    assert "script" not in policy


def test_every_picture_is_on_the_page(reproduction: EnergyReproduction) -> None:
    page = page_of(reproduction)
    images = [given for tag, given in page.tags if tag == "img"]
    assert [given["alt"] for given in images] == [
        "Figure 6.1: An error <b>",
        "Figure 6.3: An error <b>",
    ]
    for given, each in zip(images, reproduction.figures, strict=True):
        data = base64.b64decode(given["src"].partition(",")[2])
        assert data == picture(each)


def test_links_lead_to_what_is_there(reproduction: EnergyReproduction) -> None:
    page = page_of(reproduction)
    anchors = {given["id"] for _, given in page.tags if "id" in given}
    for tag, given in page.tags:
        if tag == "a":
            assert given["href"].removeprefix("#") in anchors


def test_text_stays_text_and_symbols_get_their_indices(reproduction: EnergyReproduction) -> None:
    text = reproduction_page(reproduction, {each.number: b"" for each in reproduction.figures})
    assert "Noise &lt;i&gt;has&lt;/i&gt;" in text
    assert "<i>σ</i><sub>v1</sub>²" in text
    assert "<i>K</i><sub>d</sub>" in text
    assert "&lt;surrogate&gt;" in text


def test_verdicts_are_counted_and_shown(reproduction: EnergyReproduction) -> None:
    text = page_of(reproduction).text
    assert "Of 3 claims of the source, 1 agree" in text
    assert text.count("✓ agrees") == 1
    assert text.count("✗ differs") == 2
    assert text.index("2 differ\n") < text.index("✗ differs")
    assert text.rindex("✗ differs") < text.index("1 agree\n") < text.index("✓ agrees")
    assert text.count("Verdict") == 2


def test_a_page_without_a_difference_says_so(reproduction: EnergyReproduction) -> None:
    text = page_of(replace(reproduction, claims=reproduction.claims[:1])).text
    assert "0 differ\nNone." in text


def test_every_wide_table_says_that_it_scrolls(reproduction: EnergyReproduction) -> None:
    page = page_of(reproduction)
    wide = [given for _, given in page.tags if given.get("class") == "wide"]
    assert len(wide) == 6  # estimates and variants of two loops, prediction errors, intervals
    assert all(given["tabindex"] == "0" and given["aria-label"] for given in wide)
    assert page.text.count("scrolls sideways") == len(wide)


def test_tables_show_every_number_once(reproduction: EnergyReproduction) -> None:
    text = page_of(reproduction).text
    assert text.count("−1.23 (2.34)") == 8
    assert text.count("+150 (160)") == 4
    assert text.count("95.0") == 4
    assert text.count("12\u202f346") == 2
    assert not re.search(r"\bnan\b", text)


def test_runs_without_a_result_are_told(reproduction: EnergyReproduction) -> None:
    assert "nothing was identified" not in page_of(reproduction).text
    failed = tuple(replace(each, failed=3) for each in reproduction.variants[:1])
    text = page_of(replace(reproduction, variants=failed)).text
    assert "printed, noise × 0.5: nothing was identified in 3 of 20 runs" in text


def test_a_picture_depends_on_its_record_alone() -> None:
    first = picture(figure())
    assert first[:8] == b"\x89PNG\r\n\x1a\n"
    assert picture(figure()) == first
    moved = replace(figure(), title="Another")
    assert picture(moved) != first


@pytest.mark.parametrize(("columns", "rows"), [(1, 1), (1, 3), (2, 1), (2, 5)])
def test_pictures_grow_with_their_rows(columns: int, rows: int) -> None:
    width, height = struct.unpack(">II", picture(figure(columns=columns, rows=rows))[16:24])
    assert width == 1440
    assert (height > 1400) == (rows == 5)


def test_a_panel_keeps_the_range_it_is_given() -> None:
    plain = figure(rows=1)
    panel = replace(plain.panels[0], y_range=(-5.0, 5.0))
    assert picture(replace(plain, panels=(panel,))) != picture(plain)


def test_a_browser_shows_the_page_without_a_complaint(
    reproduction: EnergyReproduction, tmp_path: Path
) -> None:
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser is None:
        pytest.skip("no Chromium on this machine to render the page with")
    path = tmp_path / "page.html"
    pictures = {each.number: picture(each) for each in reproduction.figures}
    path.write_text(reproduction_page(reproduction, pictures), encoding="utf-8")
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
            f"--user-data-dir={tmp_path / 'profile'}",
            "--dump-dom",
            path.as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    assert [line for line in outcome.stderr.splitlines() if ":CONSOLE" in line] == []
    assert len(re.findall("<img ", outcome.stdout)) == 2
