"""The page of the conjunction: its own sections, and text that stays text."""

import pytest
from reproductions import conjunction_reproduction

from studies.van_de_wijdeven.page import reproduction_page


@pytest.fixture(scope="module")
def page() -> str:
    return reproduction_page(conjunction_reproduction(), {})


@pytest.mark.parametrize(
    "words",
    [
        "van de Wijdeven (2002), concluding remarks",
        "10 pulses of 0.5 s",
        '<td class="number">5.00</td><td class="number">5.50</td>',
        '<td class="number">2e−15</td>',
        '<th scope="row">−1 %</th><td class="number">+0.49</td><td class="number">+0.487</td>',
        '+5 %, learns</th><td class="number">25.0 mm</td><td class="number">2.00 µm</td>',
        '−5 %, stays</th><td class="number">600 mm</td><td class="number">–</td>',
        '<td class="number">6 (7.5)</td><td class="number">2 (3)</td>',
        "PID &lt;fast&gt;",
        "All know the same parameters.",
        "The arm &lt;lands&gt;",
    ],
)
def test_the_sections_show_the_numbers(page: str, words: str) -> None:
    assert words in page


def test_what_a_controller_does_not_know_is_a_dash(page: str) -> None:
    (line,) = [each for each in page.splitlines() if "PID &lt;fast&gt;" in each]
    assert line.count('<td class="number">–</td>') == 2
    assert "<fast>" not in page
