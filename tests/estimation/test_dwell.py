"""Breakaway friction that grows with the time at rest, on an axis of fine steps."""

import numpy as np
import pytest
from axis_logs import axis_log
from numba import njit
from scipy.stats import binom

from stickslip import identify
from stickslip.estimation.selection import dwell as dwell_module
from stickslip.estimation.selection.dwell import Breakaway
from stickslip.estimation.selection.estimator import SelectedModelEstimator
from stickslip.records import AxisLog

MASS, COULOMB, VISCOUS, OFFSET, BREAKAWAY = 2.0, 1.0, 3.0, 0.1, 1.3
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


def _log(
    seed: int,
    growth: float,
    *,
    moves: int = 14,
    step: float = 0.0,
    rests: tuple[float, float] = (0.2, 4.0),
) -> AxisLog:
    """Return moves to and fro: a ramp of the effort, a constant effort, and a rest without it.

    The logged effort is rounded to multiples of a step, if one is given.
    """
    rng = np.random.default_rng(seed)
    pieces = [np.zeros(1000)]
    for k in range(moves):
        rate, top = rng.uniform(4.0, 20.0), rng.uniform(1.9, 2.6)
        ramp = np.minimum(rate * SAMPLING_TIME * np.arange(round(1e3 * (0.6 + top / rate))), top)
        rest = 0.7 + np.exp(rng.uniform(*np.log(rests)))
        pieces += [(-1) ** k * ramp, np.zeros(round(1e3 * rest))]
    effort = np.concatenate(pieces)
    position = _positions(effort, BREAKAWAY, growth)
    logged = effort + EFFORT_NOISE * rng.standard_normal(effort.size)
    return axis_log(
        SAMPLING_TIME * np.arange(effort.size),
        np.round(logged / step) * step if step else logged,
        position + POSITION_NOISE * rng.standard_normal(effort.size),
    )


@pytest.mark.slow
def test_growth_is_selected_and_inside_its_interval():
    truth = {"breakaway_friction": BREAKAWAY, "breakaway_growth": 0.15, "coulomb_friction": COULOMB}
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
    # Intervals that hold with 95 % have more misses in one of a thousand tests
    assert sum(outside.values()) <= binom.ppf(0.999, RUNS * len(truth), 0.05)


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.02, 0.1])
def test_intervals_hold_with_a_rounded_effort(step):
    """Of steps as large as the noise, and of steps five times as large."""
    outside = tested = 0
    for seed in range(6):
        found = SelectedModelEstimator(include=("dwell",)).fit(_log(seed, 0.15, step=step))
        for name, value in (("breakaway_friction", BREAKAWAY), ("breakaway_growth", 0.15)):
            if name in found.parameters:
                low, high = found.parameters[name].ci95
                tested += 1
                outside += not low <= value <= high
    assert tested
    assert outside <= binom.ppf(0.999, tested, 0.05)


@pytest.mark.parametrize(("long_rests", "known"), [(1, False), (2, True)])
def test_growth_needs_two_long_rests(monkeypatch, long_rests, known):
    """A single level that lies higher is no growth."""
    rng = np.random.default_rng(0)
    dwell = [0.8] * 9 + [4.0] * long_rests
    levels = [
        Breakaway(
            dwell=each, level=0.3 + 0.2 * (each > 1.0) + 0.01 * rng.standard_normal(), std=0.01
        )
        for each in dwell
    ]
    monkeypatch.setattr(dwell_module, "breakaways", lambda *_: levels)
    estimate = SelectedModelEstimator().fit(_log(0, 0.0))
    assert ("breakaway_growth" in estimate.parameters) == known


def test_growth_needs_breakaways_for_friction_that_falls_slowly(monkeypatch):
    levels = [
        Breakaway(dwell=t, level=0.3 + 0.2 * float(np.log10(t)), std=0.01)
        for t in np.arange(1.0, 9.0).tolist()
    ]
    monkeypatch.setattr(dwell_module, "breakaways", lambda *args: levels[: 1 if args[3:] else 8])
    estimate = SelectedModelEstimator(include=("dwell",)).fit(_log(0, 0.0))
    assert "breakaway_growth" not in estimate.parameters
    assert any("falls slowly" in note for note in estimate.diagnostics.notes)
