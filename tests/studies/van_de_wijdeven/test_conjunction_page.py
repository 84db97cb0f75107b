"""The page of the conjunction: its own sections, and text that stays text."""

import numpy as np
import pytest

from studies.van_de_wijdeven.page import reproduction_page
from studies.van_de_wijdeven.records import (
    Claim,
    ConjunctionReproduction,
    FrictionErrorEffect,
    LandingScore,
    ReferenceSeries,
    Spread,
    SuccessiveSeries,
)


def score(controller: str, case: str, *, lands: bool) -> LandingScore:
    spread = Spread(median=2e-7, upper_95=4e-7, worst=5e-7)
    return LandingScore(
        controller=controller,
        case=case,
        arms=3,
        moves=6,
        landed=1.0 if lands else 0.0,
        landed_in_four=1.0 if lands else None,
        error_1=spread,
        error_2=spread,
        swing=spread,
        time_ratio=Spread(median=6.0, upper_95=7.5, worst=8.0) if lands else None,
        series=Spread(median=2.0, upper_95=3.0, worst=3.0) if lands else None,
        misjudged=0.0 if lands else None,
        farthest=0.3,
        peak_effort=0.987,
    )


@pytest.fixture(scope="module")
def page() -> str:
    reproduction = ConjunctionReproduction(
        title="The arm <lands>",
        setting="Surrogate values.",
        values={},
        figures=(),
        claims=(
            Claim(
                place="Concluding remarks",
                statement="It lands.",
                criterion="it does",
                measured="it did",
                agrees=True,
                why="learning",
            ),
        ),
        reference_series=(
            ReferenceSeries(
                pulse_width=0.5,
                pulses=10,
                expected_duration=5.0,
                duration=5.5,
                impulse=1.25,
                peak_effort=0.75,
                residual=2e-15,
            ),
        ),
        friction_errors=(
            FrictionErrorEffect(
                friction_error=-0.01,
                expected_error=0.0049,
                expected_swing=0.002,
                error=0.00487,
                swing=0.00199,
            ),
        ),
        successive_series=(
            SuccessiveSeries(
                friction_error=0.05,
                learning=True,
                error=np.array([0.025, -2e-6, 1e-9]),
                swing=np.array([0.01, 1e-6, 3e-9]),
            ),
            SuccessiveSeries(
                friction_error=-0.05, learning=False, error=np.array([0.5]), swing=np.array([0.6])
            ),
        ),
        landing_scores=(
            score("landing", "no noise", lands=True),
            score("PID <fast>", "no noise", lands=False),
        ),
        how_compared="All are told the same.",
        options={"arms": 3, "seed": 1},
        stickslip_version="0.1.0",
    )
    return reproduction_page(reproduction, {})


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
        "All are told the same.",
        "The arm &lt;lands&gt;",
    ],
)
def test_the_sections_show_the_numbers(page: str, words: str) -> None:
    assert words in page


def test_what_a_controller_does_not_know_is_a_dash(page: str) -> None:
    (line,) = [each for each in page.splitlines() if "PID &lt;fast&gt;" in each]
    assert line.count('<td class="number">–</td>') == 2
    assert "<fast>" not in page
