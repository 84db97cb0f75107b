"""Efforts that are held, sampled or averaged, found from the log or given."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from axis_logs import axis_log
from refusals import refuses
from two_sines import TRUTH, Motion, log_of, plain_effort

from stickslip.estimation import SelectedModelEstimator, predict_effort
from stickslip.records import AxisLog, FrictionEstimate


def uneven(kind: str, seed: int = 5) -> AxisLog:
    """Return a log with time steps of 4 or 10 ms, as of a bus, whose effort is of one kind."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.choice([0.004, 0.010], size=4000))
    if kind == "sampled":
        effort = plain_effort(Motion(time=time))
    else:  # the mean over each step, of a fine integral
        fine = np.arange(0.0, time[-1] + 0.02, 1e-4)
        work = np.concatenate(([0.0], np.cumsum(plain_effort(Motion(time=fine + 5e-5))))) * 1e-4
        sums = np.interp(time, np.append(fine, fine[-1] + 1e-4), work)
        mean = np.diff(sums) / np.diff(time)
        effort = np.append(mean, mean[-1]) if kind == "held" else np.append(mean[0], mean)
    return axis_log(
        time,
        effort + 0.002 * rng.standard_normal(time.size),
        Motion(time=time).position,
        name="stage",
    )


def found(kind: str, log: AxisLog) -> FrictionEstimate:
    """Return the estimate of a log, whose effort is found to be of a kind and noted unless held."""
    estimate = SelectedModelEstimator().fit(log)
    assert estimate.selection is not None
    assert estimate.selection.effort_kind == kind
    noted = any("taken for" in note for note in estimate.diagnostics.notes)
    assert noted == (kind != "held")
    return estimate


@pytest.mark.parametrize("kind", ["held", "sampled", "mean"])
def test_the_kind_of_an_effort_with_uneven_time_stamps_is_found(kind: str) -> None:
    estimate = found(kind, uneven(kind))
    assert estimate.selection is not None
    assert abs(estimate.selection.effort_delay) < 2e-4  # the kind leaves no delay
    for name, value in TRUTH.items():
        assert estimate.value(name) == pytest.approx(value, rel=2e-3, abs=2e-3), name


@pytest.mark.parametrize(("kind", "delay"), [("held", 0.0), ("sampled", -0.5e-3), ("mean", -1e-3)])
def test_a_given_kind_replaces_the_delay_of_an_even_log(kind: Any, delay: float) -> None:
    log = log_of(delay=delay)  # logged so much later than a held effort
    estimate = SelectedModelEstimator(effort_kind=kind).fit(log)
    assert estimate.selection is not None
    assert estimate.selection.selected == ()
    other = SelectedModelEstimator(effort_kind=kind, include=("delay",)).fit(log)
    assert other.value("effort_delay") == pytest.approx(0.0, abs=4e-5)
    wanted = log_of(delay=delay, noise=0.0)
    predicted = predict_effort(estimate, wanted)
    known = np.isfinite(predicted)
    np.testing.assert_allclose(predicted[known], wanted.effort[known], atol=0.02)


def at_50_hz(kind: str) -> AxisLog:
    """Return a log of 50 samples a second: smooth effort in closed form, its mean, or held."""
    time = np.arange(0.0, 200.0, 0.02)
    motion = Motion(time=time, rates=(3.0, 11.0))
    position, effort = motion.position, plain_effort(motion)
    if kind == "mean":  # since the time stamp before; Coulomb friction as at its middle
        half = 0.01
        large, small = (
            size * float(np.sin(rate * half)) / (rate * half)
            for size, rate in zip(motion.sizes, motion.rates, strict=True)
        )
        effort = plain_effort(replace(motion, time=time - half, sizes=(large, small)))
    if kind == "held":  # steps of 1 ms, each exact for the friction at its start
        x, v, wanted, step = float(position[0]), 0.0, position, 1e-3
        decay = np.exp(-4.0 / 3.0 * step)
        position = np.empty(time.size)
        for k in range(time.size):
            position[k] = x
            effort[k] += 150.0 * (wanted[k] - x)
            for _ in range(20):
                slope = (effort[k] - 0.2 - 1.5 * np.sign(v or 1.0)) / 4.0
                new = slope + (v - slope) * decay
                x += slope * step + (v - new) * 3.0 / 4.0
                v = new
    effort += 0.002 * np.random.default_rng(3).standard_normal(time.size)
    return axis_log(time, effort, position)


@pytest.mark.parametrize("kind", ["held", "sampled", "mean"])
def test_the_kind_of_an_effort_with_few_samples_in_a_window_is_found(kind: str) -> None:
    estimate = found(kind, at_50_hz(kind))
    # With another kind it is 0.18 % off, or 0.36 %
    assert estimate.value("mass") == pytest.approx(3.0, rel=1e-3)


@pytest.mark.usefixtures("without_shape_checks")
def test_an_unknown_kind_of_effort_is_refused() -> None:
    with refuses("not_a_choice", name="effort_kind", value="averaged"):
        SelectedModelEstimator(effort_kind="averaged")  # pyright: ignore[reportArgumentType]
