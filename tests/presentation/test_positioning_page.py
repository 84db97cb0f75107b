"""The page of a positioning task holds everything it shows, however many pulses and runs."""

from dataclasses import replace

import numpy as np
import pytest
from pages import MOST_BYTES, page_of
from results import NAME, make, make_run

from stickslip.presentation.positioning.page import estimate_table
from stickslip.records import Ending, LandingPhase

MOST_POINTS = 2100  # what a series is thinned to, with room for its ends


def test_everything_of_a_run_is_on_the_page() -> None:
    page = page_of(make())
    for words in (
        NAME, "Target reached", "−1.23\u00a0µm", "20.0\u00a0µm", "310\u00a0ms", "300\u00a0N",
        "300\u00a0N for 30.0\u00a0ms, −120\u00a0N for 10.0\u00a0ms", "10.0\u00a0mm",
        "9.00\u00a0mm", "−1.00\u00a0mm", "did not move", "Mass", "−0.7 %", "150 kg",
        "estimate <file>.json", "a <note>", "a <task>.toml", "ab" * 32, "1.2.3",
        "constant offset", "below 173", "inside",
    ):  # fmt: skip
        assert words in page.text, words
    plots = page.plots()
    assert set(plots) == {
        "motion-1",
        "pulse-pairs",
        "pulse-ratios",
        "estimate-mass",
        "estimate-coulomb-friction-positive",
    }


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [(130.004, 173.0, "inside"), (None, 129.996, "inside"), (130.06, 173.0, "outside")],
)
def test_the_verdict_on_limits_agrees_with_the_printed_digits(
    low: float | None, high: float, verdict: str
) -> None:
    limits = {"static_friction_positive": (low, high)}
    static = estimate_table(replace(make(), limits=limits)).rows[-1]
    assert static[4] == verdict


def test_an_estimate_that_nothing_has_changed_has_no_value_in_the_end() -> None:
    mass = estimate_table(make(make_run(1, count=0))).rows[0]
    assert mass[1:5] == ["140", "–", "151", "–"]


def test_what_is_drawn_is_what_was_recorded() -> None:
    run = make_run(1)
    traces = page_of(make(run)).plots()["motion-1"]["data"]
    true = next(trace for trace in traces if trace["name"] == "error, true")
    np.testing.assert_allclose(true["y"], 1e3 * run.error, rtol=1e-6)
    effort = next(trace for trace in traces if trace["name"] == "effort")
    held = np.interp(run.time[:-1] + 1e-9, effort["x"], np.arange(len(effort["x"])))
    np.testing.assert_allclose(np.array(effort["y"])[held.astype(int)], run.effort)
    pairs = page_of(make(run)).plots()["pulse-pairs"]["data"]
    ahead = next(trace for trace in pairs if trace["name"] == "forward pulse")
    moved = [pulse for pulse in run.pulses if pulse.moved]
    np.testing.assert_allclose(
        ahead["y"], [1e3 * pulse.achieved_displacement for pulse in moved], rtol=1e-6
    )
    assert ahead["text"][1] == "run 1, pulse 3"


def test_ideal_sensors_draw_no_second_line() -> None:
    for sensed in (True, False):
        traces = page_of(make(make_run(1, sensed=sensed))).plots()["motion-1"]["data"]
        assert any(trace["name"] == "error, measured" for trace in traces) is sensed


def test_a_rotary_axis_has_its_own_units() -> None:
    page = page_of(make(kind="rotary"))
    titles = page.plots()["motion-1"]["layout"]
    assert titles["yaxis"]["title"]["text"] == "error [mrad]"
    assert titles["yaxis2"]["title"]["text"] == "magnified [µrad]"
    assert titles["yaxis3"]["title"]["text"].endswith("[N m]")


@pytest.mark.parametrize("ending", list(Ending))
def test_the_verdict_names_the_ending(ending: Ending) -> None:
    page = page_of(make(make_run(1, ending=ending)))
    assert ending.word in page.text
    # Of a controller's own reason, and of method exact that hunts, the remedy is another
    own = {Ending.STOPPED, Ending.HUNTING}
    assert (ending.text in page.text) is (ending not in own)
    assert ("swings between −72.1\u00a0µm and 114\u00a0µm" in page.text) is (
        ending is Ending.HUNTING
    )
    assert ("stopped, as nothing <helps>; widen" in page.text) is (ending is Ending.STOPPED)


def test_several_runs_are_there_and_the_middle_ones_are_folded() -> None:
    runs = [make_run(k, count=7 - k) for k in range(1, 5)]
    page = page_of(make(*runs))
    assert [tag for tag, _ in page.tags].count("details") == 4  # motion and pulses of runs 2 and 3
    for k in range(1, 5):
        assert f"motion-{k}" in page.plots()
        assert page.text.count(f"Run {k}: target reached, ") == 2
    # Every pulse counts once, and a run begins with the estimate that the one before ended with
    estimate = page.plots()["estimate-mass"]["data"][0]
    assert len(estimate["x"]) == 1 + sum(len(run.pulses) for run in runs)
    assert len(page.plots()["estimate-mass"]["layout"]["shapes"]) == 3


def test_moves_have_a_table() -> None:
    page = page_of(make(make_run(1, moves=3)))
    assert page.text.count("✓ target reached") == 3
    assert "At each new target the error jumps" in page.text


def test_the_error_jumps_at_a_new_target() -> None:
    run = make_run(1, moves=2)
    first, second = run.moves
    moved = replace(run, moves=(first, replace(second, target=first.target - 0.006)))
    traces = page_of(make(moved)).plots()["motion-1"]["data"]
    true = next(trace for trace in traces if trace["name"] == "error, true")
    at = [k for k, time in enumerate(true["x"]) if time == pytest.approx(second.start_time)]
    before, after = (true["y"][k] for k in at)
    assert before - after == pytest.approx(6.0)  # mm


def test_a_controller_without_pulses_has_no_section_of_them() -> None:
    run = replace(make_run(1), estimates={}, estimate_time=np.empty(0))
    moves = tuple(replace(move, pulses=()) for move in run.moves)
    page = page_of(replace(make(replace(run, moves=moves)), learned=None))
    assert set(page.plots()) == {"motion-1"}
    links = [given["href"] for tag, given in page.tags if tag == "a"]
    assert links == ["#motion", "#scenario"]


def test_a_landing_shows_its_phases_and_its_estimates_over_time() -> None:
    run = make_run(1, samples=400)
    end = float(run.time[-1])
    phases = (
        LandingPhase(name="feedback", start_time=0.0, end_time=0.4, reason="the target is <new>"),
        LandingPhase(name="pulses", start_time=0.4, end_time=0.8, reason="the mass rests"),
        LandingPhase(name="done", start_time=0.8, end_time=end, reason="within the tolerance"),
    )
    deviations = {"mass": np.full(run.estimate_time.size, 2.0)}
    landed = replace(run, phases=phases, deviations=deviations)
    page = page_of(replace(make(landed), method="landing"))
    for words in ("the target is <new>", "Why it began", "Shaded are the phases", "over time"):
        assert words in page.text, words
    motion = page.plots()["motion-1"]["layout"]
    assert [shape["x0"] for shape in motion["shapes"]] == [0.0, 0.4, 0.8]
    assert [note["text"] for note in motion["annotations"]] == ["1", "2", "3"]
    mass = page.plots()["estimate-mass"]
    named = {trace["name"]: trace for trace in mass["data"]}
    assert named["estimate"]["x"] == pytest.approx(run.estimate_time.tolist())
    assert "95 % interval" in named
    # What is only known within limits is not drawn, pulses are listed as ever
    assert "estimate-static-friction-positive" not in page.plots()
    assert "pulse-pairs" in page.plots()


def test_a_run_without_a_known_pulse_can_be_shown() -> None:
    page = page_of(make(make_run(1, count=0, ending=Ending.UNDER_WAY)))
    assert "No pulse of this run has ended." in page.text
    assert set(page.plots()) == {"motion-1"}
    assert "from pulse to pulse" not in page.text
    assert "What was learned" in page.text


def test_long_runs_with_hundreds_of_pulses_stay_small() -> None:
    runs = [
        make_run(k, count=800, samples=60_000, ending=Ending.HUNTING, moves=1) for k in range(1, 31)
    ]
    page = page_of(make(*runs))
    assert len(page.source.encode()) < MOST_BYTES
    plots = page.plots()
    motions = [anchor for anchor in plots if anchor.startswith("motion-")]
    assert len(motions) == 8
    assert {"motion-1", "motion-30"} <= set(motions)
    for anchor, plot in plots.items():
        most = 3100 if anchor.startswith("pulse") else MOST_POINTS
        assert all(len(trace["x"]) <= most for trace in plot["data"]), anchor
    assert "755 more pulses, all of them in the JSON file" in page.text
