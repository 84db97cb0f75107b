"""Part B's page: its own tables, and readings one by one."""

import re
from dataclasses import replace

import pytest
from reproductions import pulse_reproduction

from studies.van_de_wijdeven.page import reproduction_page
from studies.van_de_wijdeven.records import PulseReproduction


@pytest.fixture
def reproduction() -> PulseReproduction:
    return pulse_reproduction()


def page_of(reproduction: PulseReproduction) -> str:
    return reproduction_page(reproduction, {each.number: b"png" for each in reproduction.figures})


def text_of(page: str) -> str:
    return re.sub(r"<[^>]+>", "", page)


def test_it_has_its_own_sections_and_none_of_part_a(reproduction: PulseReproduction) -> None:
    page = page_of(reproduction)
    anchors = re.findall(r'<section id="([^"]+)"', page)
    assert anchors == [
        "claims", "numbers", "runs", "controllers", "resolution", "figures", "provenance",
    ]  # fmt: skip
    assert "van de Wijdeven (2002), part B" in page
    assert "ITSE" not in page
    for anchor in re.findall(r'href="#([^"]+)"', page):
        assert f'id="{anchor}"' in page


def test_claims_that_hold_in_part_stand_by_themselves(reproduction: PulseReproduction) -> None:
    page = page_of(reproduction)
    text = text_of(page)
    assert "1 agree with what was measured, 1 agree in part of the readings and 1 differ" in text
    assert text.count("◐ partly") == 1
    assert text.index("✗ differs") < text.index("◐ partly") < text.index("✓ agrees")
    assert page.count('<li class="yes">') == 3
    assert page.count('<li class="no">') == 3
    assert "&lt;one&gt;: 1" in page
    every = page_of(replace(reproduction, claims=reproduction.claims[:1]))
    assert "in part of the readings" not in every


def test_the_reports_numbers_stand_beside_ours(reproduction: PulseReproduction) -> None:
    page = page_of(reproduction)
    section = page[page.index('id="numbers"') : page.index('id="runs"')]
    text = text_of(section)
    for words in ("150 kg", "700 N s/m", "Pulse effort fp", "0.071", "0.07071", "+0.4", "−1.0"):
        assert words in text, words
    assert section.count("mark-yes") == section.count("mark-no") == 1


def test_the_document_says_which_part_it_is(reproduction: PulseReproduction) -> None:
    document = reproduction.to_dict()
    assert document["part"] == "B"
    assert document["figures"][0]["panels"][0]["curves"][0]["staircase"] is False
    assert document["claims"][1]["verdict"] == "partly"
    assert document["claims"][1]["measures"][1] == {
        "case": "<other>",
        "quantity": "pulses",
        "unit": "1",
        "value": 0.0,
        "low": 1.0,
        "high": None,
        "agrees": False,
    }
    assert "five_runs" not in document
    assert document["resolution_scores"][0]["friction_change"] == 0.01
