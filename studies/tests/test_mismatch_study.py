"""The mismatch study, reduced: how often `identify` is ok and wrong on an independent plant."""

from collections.abc import Iterable
from typing import Any

import pytest
from scipy.stats import binom

from studies.mismatch.cases import CASES
from studies.mismatch.judgement import judge_run

pytestmark = pytest.mark.slow

SEEDS = range(3)
CHANCE = 1e-3
"""Probability with which a bound below is passed although the rate is as claimed."""

CRITICAL = 0.01
"""Rate of ok results with a parameter outside its interval by a large error, over all cases."""

REFUSED = 0.05
"""Rate of results that are not ok although the truth is among the candidate models."""

SPURIOUS = 0.05
"""Rate of terms selected for an axis that has none."""


def most(runs: int, rate: float) -> int:
    """Return the count that is passed with the probability `CHANCE` at a given rate."""
    return int(binom.ppf(1.0 - CHANCE, runs, rate))


@pytest.fixture(scope="module")
def judged() -> list[dict[str, Any]]:
    return [judge_run(name, seed, {}) for name in CASES for seed in SEEDS]


def of_groups(runs: Iterable[dict[str, Any]], *groups: str) -> list[dict[str, Any]]:
    return [run for run in runs if CASES[run["case"]].group in groups]


def test_no_log_crashes_identify(judged: list[dict[str, Any]]) -> None:
    assert [run for run in judged if run["status"].startswith(("crash", "refused"))] == []


def test_ok_results_are_seldom_wrong(judged: list[dict[str, Any]]) -> None:
    critical = [run for run in judged if run["ok"] and run["critical"]]
    assert len(critical) <= most(len(judged), CRITICAL), [
        (run["case"], run["seed"]) for run in critical
    ]


def test_truth_among_the_candidates_is_not_refused(judged: list[dict[str, Any]]) -> None:
    runs = of_groups(judged, "ideal", "noise", "in_class")
    refused = [(run["case"], run["seed"], run["status"]) for run in runs if not run["ok"]]
    assert len(refused) <= most(len(runs), REFUSED), refused


def test_plain_axes_get_the_plain_model(judged: list[dict[str, Any]]) -> None:
    runs = of_groups(judged, "ideal", "noise")
    spurious = [(run["case"], run["seed"], run["model"]) for run in runs if not run["plain"]]
    assert len(spurious) <= most(len(runs), SPURIOUS), spurious


def test_intervals_cover_under_noise(judged: list[dict[str, Any]]) -> None:
    runs = [run for run in of_groups(judged, "noise") if run["ok"]]
    values = [value for run in runs for value in run["parameters"].values()]
    missed = sum(not value["covered"] for value in values)
    # Parameters of one log are correlated: as many independent ones as logs
    share = most(len(runs), 0.05) / len(runs)
    assert missed / len(values) <= share


@pytest.mark.parametrize("seed", [5, 12, 20])
def test_two_terms_that_hide_each_other_are_found_together(seed: int) -> None:
    run = judge_run("spring_drift", seed, {})
    assert {"spring", "friction drift"} <= set(run["model"].split(", "))
    assert not run["critical"]


@pytest.mark.parametrize("seed", [2, 12, 50])
def test_noise_of_the_position_is_no_term_of_a_sinusoidal_motion(seed: int) -> None:
    run = judge_run("sine", seed, {})
    assert (run["status"], run["model"]) == ("ok", "")


@pytest.mark.parametrize("seed", [13, 40, 56, 59, 67])
def test_a_log_that_does_not_show_when_the_effort_acts_is_none_of_means(seed: int) -> None:
    """The controller of these steps is four times as fast as the log."""
    run = judge_run("steps_rate", seed, {})
    assert not any("taken for" in note for note in run["notes"])
    assert not run["critical"]
