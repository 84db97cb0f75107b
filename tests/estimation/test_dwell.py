"""Breakaway friction that grows with the time at rest, on an axis of fine steps."""

import numpy as np
import pytest
from numba import njit
from scipy.stats import binom

from stickslip import identify
from stickslip.estimation.selection.estimator import SelectedModelEstimator
from stickslip.records import AxisLog

MASS, COULOMB, VISCOUS, OFFSET = 2.0, 1.0, 3.0, 0.1
SAMPLING_TIME, FINE_STEP = 1e-3, 2e-5
EFFORT_NOISE, POSITION_NOISE = 0.02, 1e-6
RUNS = 8


@njit
def _positions(effort, breakaway_after_1_s, growth):
    """Semi-implicit Euler steps; static friction grows with the logarithm of the time at rest."""
    x = v = 0.0
    dwell = 1.0
    positions = np.empty(effort.size)
    for k in range(effort.size):
        positions[k] = x
        force = effort[k] - OFFSET
        for _ in range(round(SAMPLING_TIME / FINE_STEP)):
            if v == 0.0:
                static = breakaway_after_1_s + growth * np.log10(max(dwell, 1e-3))
                dwell += FINE_STEP
                if abs(force) <= static:
                    continue
            way = np.sign(force) if v == 0.0 else np.sign(v)
            new = v + FINE_STEP * (force - way * COULOMB - VISCOUS * v) / MASS
            if v * new < 0.0:
                new = 0.0
            x += 0.5 * FINE_STEP * (v + new)
            dwell = dwell if v == 0.0 and new == 0.0 else 0.0
            v = new
    return positions


def _log(seed: int, growth: float, *, breakaway: float = 1.3, moves: int = 14) -> AxisLog:
    """Return moves to and fro: a ramp of the effort, a constant effort, and a rest without it."""
    rng = np.random.default_rng(seed)
    pieces = [np.zeros(1000)]
    for k in range(moves):
        rate, top = rng.uniform(4.0, 20.0), rng.uniform(1.9, 2.6)
        ramp = np.minimum(rate * SAMPLING_TIME * np.arange(round(1e3 * (0.6 + top / rate))), top)
        rest = 0.7 + np.exp(rng.uniform(np.log(0.2), np.log(4.0)))
        pieces += [(-1) ** k * ramp, np.zeros(round(1e3 * rest))]
    effort = np.concatenate(pieces)
    position = _positions(effort, breakaway, growth)
    return AxisLog(
        name="axis",
        kind="linear",
        time=SAMPLING_TIME * np.arange(effort.size),
        effort=effort + EFFORT_NOISE * rng.standard_normal(effort.size),
        measured_position=position + POSITION_NOISE * rng.standard_normal(effort.size),
    )


def test_growth_is_selected_and_inside_its_interval():
    truth = {"breakaway_friction": 1.3, "breakaway_growth": 0.15, "coulomb_friction": COULOMB}
    outside = dict.fromkeys(truth, 0)
    for seed in range(RUNS):
        estimate = identify(_log(seed, 0.15)).estimate
        assert "dwell" in estimate.selection.selected
        assert "grows with the time at rest" in estimate.selection.summary
        for name, value in truth.items():
            low, high = estimate.parameters[name].ci95
            outside[name] += not low <= value <= high
        assert estimate.parameters["breakaway_growth"].std < 0.03
        assert estimate.covariance.shape == (len(estimate.parameters),) * 2
    # 99.9 % of intervals that hold with 95 % have no more misses
    assert max(outside.values()) <= binom.ppf(0.999, RUNS, 0.05)


def test_breakaway_without_growth_is_not_selected():
    for seed in range(RUNS):
        estimate = identify(_log(seed, 0.0)).estimate
        score = next(each for each in estimate.selection.scores if each.term == "dwell")
        assert not score.selected
        assert "breakaway_growth" not in estimate.parameters


@pytest.mark.parametrize("options", [{"exclude": ("dwell",)}, {"select": False}])
def test_growth_is_left_out_if_excluded(options):
    estimate = SelectedModelEstimator(**options).fit(_log(0, 0.15))
    assert "breakaway_growth" not in estimate.parameters
    assert "dwell" not in {score.term for score in estimate.selection.scores}


def test_growth_is_included_without_a_test():
    estimate = SelectedModelEstimator(include=("dwell",)).fit(_log(0, 0.0))
    low, high = estimate.parameters["breakaway_growth"].ci95
    assert low < 0.0 < high


def test_growth_that_a_log_does_not_show_is_noted():
    estimate = SelectedModelEstimator(include=("dwell",)).fit(_log(0, 0.15, moves=4))
    assert "breakaway_growth" not in estimate.parameters
    assert any("'dwell' is left out" in note for note in estimate.diagnostics.notes)
