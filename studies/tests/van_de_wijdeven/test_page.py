"""The page of a reproduction holds all it shows, and its pictures depend on their record alone."""

import base64
import re
from dataclasses import replace
from pathlib import Path

import pytest
from pages import Page, browsed
from reproductions import energy_figure, energy_reproduction

from studies.van_de_wijdeven.page import picture, reproduction_page
from studies.van_de_wijdeven.records import EnergyReproduction


@pytest.fixture
def reproduction() -> EnergyReproduction:
    return energy_reproduction()


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


def test_runs_without_a_result_are_counted(reproduction: EnergyReproduction) -> None:
    assert "nothing was identified" not in page_of(reproduction).text
    failed = tuple(replace(each, failed=3) for each in reproduction.variants[:1])
    text = page_of(replace(reproduction, variants=failed)).text
    assert "printed, noise × 0.5: nothing was identified in 3 of 20 runs" in text


def test_a_picture_depends_on_its_record_alone() -> None:
    first = picture(energy_figure())
    assert first[:8] == b"\x89PNG\r\n\x1a\n"
    assert picture(energy_figure()) == first
    moved = replace(energy_figure(), title="Another")
    assert picture(moved) != first


def test_a_browser_shows_the_page_without_a_complaint(
    reproduction: EnergyReproduction, tmp_path: Path
) -> None:
    path = tmp_path / "page.html"
    pictures = {each.number: picture(each) for each in reproduction.figures}
    path.write_text(reproduction_page(reproduction, pictures), encoding="utf-8")
    assert len(re.findall("<img ", browsed(path))) == 2
