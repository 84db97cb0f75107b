"""The page of a flexible arm shows both masses, phases, series, estimates, and the arm moving."""

import json
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pages import MOST_BYTES, page_of, plots_of
from results import make_arm, make_landing

from stickslip.records import Ending

MOST_FILM = 200_000  # of what the film shows, however long the run
MOST_POINTS = 2100  # what a series is thinned to, with room for its ends


def data(text: str, anchor: str) -> Any:
    found = re.search(rf'<script type="application/json" id="{anchor}">(.*?)</script>', text)
    return json.loads(found[1])


def test_everything_of_an_arm_is_on_the_page() -> None:
    text = page_of(make_landing()).source
    assert len(text) < MOST_BYTES
    for word in (
        "flexible arm, linear",
        "Both masses stay within the tolerance.",
        "Swing left",
        "23.5\u00a0µm",
        "80 pulses in all",
        "because &lt;2&gt;",
        "Pulse series",
        "The end, magnified",
        "Mass 2 at most by",
        "100\u00a0µm",  # what mass 1 missed its series' target by
        "120\u00a0µm",  # and mass 2 in its swing
        "not\u00a0at\u00a0rest",
        "Load mass",
        "Coulomb friction",
        "taken as known",
        "load_mass",
        "ab" * 32,
    ):
        assert word in text, word
    assert "<b>" not in text.split("<script", maxsplit=1)[0].replace("<body>", "")
    plots = plots_of(text)
    assert {
        "motion-1",
        "end-1-1",
        "series-1-1",
        "series-1-2",
        "estimate-coulomb-friction",
        "estimate-viscous-friction",
    } == set(plots)
    for anchor in plots:
        assert f'id="{anchor}"' in text


def test_the_motion_lies_on_its_phases() -> None:
    motion = plots_of(page_of(make_landing()).source)["motion-1"]
    names = [trace["name"] for trace in motion["data"]]
    assert {"mass 1", "mass 2", "target", "tolerance", "effort"} == set(names)
    shades = motion["layout"]["shapes"]
    assert [each["x0"] for each in shades] == [0.0, 8.0, 12.0, 16.0]
    assert len({each["fillcolor"] for each in shades}) == 4
    assert [each["text"] for each in motion["layout"]["annotations"]] == ["1", "2", "3", "4"]
    # A rest that changes nothing is left out at first
    assert motion["layout"]["xaxis"]["range"][1] == pytest.approx(1.15 * 16.0)


def test_estimates_have_bands_and_the_truth() -> None:
    plots = plots_of(page_of(make_landing()).source)
    drawn = [trace["name"] for trace in plots["estimate-coulomb-friction"]["data"]]
    assert "95 % interval" in drawn
    assert "true value" in drawn
    assert "error of the estimate" in drawn
    alone = [trace["name"] for trace in plots["estimate-viscous-friction"]["data"]]
    assert "95 % interval" not in alone  # the controller has no deviation of it


def test_the_film_shows_what_happened() -> None:
    result = make_landing()
    text = page_of(result).source
    film = data(text, "film")
    run = result.runs[0]
    assert run.arm is not None
    frames = len(film["position"])
    for name in ("load_position", "target", "effort", "resting", "gauge", "load_gauge"):
        assert len(film[name]) == frames
    time = film["step"] * np.arange(frames)
    assert time[-1] == pytest.approx(1.15 * 16.0)
    gap = float(run.time[1])
    for name in ("position", "load_position"):
        shown = np.interp(time, run.time, getattr(run.arm, name))
        fastest = np.max(np.abs(np.diff(getattr(run.arm, name)))) / gap
        assert np.max(np.abs(shown - film[name])) <= fastest * gap
    # Masses never overlap, and never leave the stage
    first = film["left"] + film["scale"] * np.array(film["position"])
    second = film["left"] + film["apart"] + film["scale"] * np.array(film["load_position"])
    assert np.min(second - first) > 2 * film["half"]
    assert np.min(first) >= film["half"]
    assert np.max(second) <= 960 - film["half"]
    assert film["phases"][2] == {"start": 12.0, "word": "Pulse series", "reason": "because <2>"}
    assert film["effort_limit"] == 1.0
    for name in ("film-play", "film-time", "film-speed", "film-clock", "film-phases"):
        assert f'id="{name}"' in text
    assert "prefers-reduced-motion" in text
    assert text.count('aria-label="to phase') == 4


def test_the_gauge_is_of_powers_of_ten() -> None:
    film = data(page_of(make_landing()).source, "film")
    arm = make_arm().arm
    assert arm is not None
    gauge = np.array(film["gauge"])
    assert gauge[0] == pytest.approx(max(film["gauge"]))  # farthest at first
    errors = np.abs(np.array(film["target"]) - np.array(film["position"]))
    seen = errors > 2e-5
    slope = np.diff(gauge[seen]) / np.diff(np.log10(errors[seen]))
    moving = np.abs(np.diff(np.log10(errors[seen]))) > 1e-2
    np.testing.assert_allclose(slope[moving], np.median(slope[moving]), rtol=0.1)


@pytest.mark.parametrize("moves", [1, 40])
def test_a_long_task_stays_a_page(moves: int) -> None:
    result = make_landing(make_arm(samples=60_000, moves=moves, series=60))
    text = page_of(result).source
    assert len(text) < MOST_BYTES
    assert len(json.dumps(data(text, "film"))) < MOST_FILM
    plots = plots_of(text)
    for plot in plots.values():
        for trace in plot["data"]:
            assert len(trace["x"]) <= 2 * MOST_POINTS
    assert sum(anchor.startswith("series-") for anchor in plots) <= 10
    assert sum(anchor.startswith("end-") for anchor in plots) <= 7
    assert "more series" in text


def test_a_controller_without_phases_has_a_page_too() -> None:
    run = make_arm(phases=False, sensed=False)
    move = replace(run.moves[0], ending=Ending.SWINGING, settling_time=None)
    text = page_of(replace(make_landing(run), runs=(replace(run, moves=(move,)),))).source
    assert "Mass 1 rests within the tolerance" in text
    assert "Series of pulses" not in text
    assert "Shaded are the phases" not in text
    assert "film-phases" not in text.split("<script>", maxsplit=1)[0]
    assert data(text, "film")["phases"] == []
    assert "end-1-1" in plots_of(text)


def test_several_runs_have_sections_of_their_own() -> None:
    text = page_of(make_landing(make_arm(), make_arm(number=2))).source
    plots = plots_of(text)
    assert {"motion-1", "motion-2", "series-2-1"} <= set(plots)
    assert "Run 2: target reached" in text
    assert "The arm of run 2" in text
    times = plots["estimate-coulomb-friction"]["data"][-1]["x"]
    assert times[-1] == pytest.approx(60.0)  # one run after the other


def test_an_arm_that_stays_is_drawn_too() -> None:
    run = make_arm()
    assert run.arm is not None
    still = np.zeros_like(run.time)
    arm = replace(
        run.arm,
        target=still + 1.0,
        position=still,
        load_position=still,
        measured_position=still,
        measured_load_position=still,
        series=(),
    )
    held = replace(run, arm=arm, phases=(), error=arm.error, effort=np.zeros_like(run.effort))
    film = data(page_of(make_landing(held)).source, "film")
    assert set(film["position"]) == {0.0}
