"""Efforts that are late by many samples, or that lack their sign: closed forms of a plain axis."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from axis_logs import axis_log
from jaxtyping import Float

from stickslip.estimation.selection.estimator import SelectedModelEstimator
from stickslip.estimation.selection.search import SearchTuning, scanned_delay
from stickslip.records import AxisLog, Status

Disturbance = Callable[[Float[np.ndarray, " n"]], Float[np.ndarray, " n"]]
MASS = 3.0  # kg


def log_of(
    disturbance: Disturbance = np.zeros_like, *, delay: float = 0.0, sampling_time: float = 1e-3
) -> AxisLog:
    """Return a log whose effort acts ``delay`` later than it is logged."""
    time = np.arange(0.0, 20.0, sampling_time)
    acts = time + 0.5 * sampling_time + delay  # an effort is held until the next sample
    velocity = 0.1 * np.sin(2.0 * acts) + 0.05 * np.sin(5.0 * acts)
    acceleration = 0.2 * np.cos(2.0 * acts) + 0.25 * np.cos(5.0 * acts)
    effort = MASS * acceleration + 0.5 * np.sign(velocity) + 4.0 * velocity + disturbance(acts)
    return axis_log(
        time,
        effort + 0.02 * np.random.default_rng(1).standard_normal(time.size),
        -0.05 * np.cos(2.0 * time) - 0.01 * np.cos(5.0 * time),
    )


@pytest.mark.parametrize("delay", [-0.0402, 0.0301])
def test_a_delay_of_many_samples_is_estimated(delay: float) -> None:
    """Gauss-Newton steps of three samples do not lead that far."""
    estimate = SelectedModelEstimator().fit(log_of(delay=delay, sampling_time=0.25e-3))
    assert estimate.status is Status.OK
    assert estimate.value("effort_delay") == pytest.approx(delay, abs=2e-4)
    assert estimate.value("mass") == pytest.approx(MASS, rel=0.01)


def other(time: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    return 1.5 * np.sin(17.0 * time)


@pytest.mark.parametrize(
    ("disturbance", "delay", "begins"),
    [
        (np.zeros_like, 0.002, 0.0),  # explained
        (np.zeros_like, 0.082, 0.08),
        (other, 0.0, 0.0),  # explained by no delay
    ],
)
def test_where_steps_to_the_delay_begin(
    disturbance: Disturbance, delay: float, begins: float
) -> None:
    log = log_of(disturbance, delay=delay)
    model = SelectedModelEstimator(select=False).details(log).model
    assert model is not None
    assert 1e-3 * scanned_delay(model, model, SearchTuning()) == pytest.approx(begins)


def named(log: AxisLog, effort: Float[np.ndarray, " n"]) -> bool:
    """Return whether the effort is said to lack its sign, in a result that cannot be trusted."""
    estimate = SelectedModelEstimator().fit(replace(log, effort=effort))
    assert not estimate.status.trusted
    return any("never changes its sign" in note for note in estimate.diagnostics.notes)


def test_an_effort_without_its_sign_is_named() -> None:
    log = log_of()
    size = np.abs(log.effort)
    assert named(log, size)
    assert named(log, -size)
    assert not named(log, log.effort[::-1])  # of both signs
    assert not named(log, 10.0 + size)  # away from zero


@pytest.mark.parametrize(
    ("step", "viscous", "noise", "coarse"),
    [
        (0.1, 0.3, 0.0, True),
        (0.05, 0.3, 0.0, False),  # of 0.5 N Coulomb friction
        (0.1, 4.0, 0.0, False),  # viscous friction goes over many steps
        (0.1, 0.3, 0.1, False),  # noise makes rounding errors noise
    ],
)
def test_steps_of_the_effort_that_hide_friction_are_named(
    step: float, viscous: float, noise: float, coarse: bool
) -> None:
    log = log_of()
    velocity = 0.1 * np.sin(2.0 * log.time) + 0.05 * np.sin(5.0 * log.time)
    effort = log.effort - (4.0 - viscous) * velocity
    effort = effort + noise * np.random.default_rng(2).standard_normal(effort.size)
    estimate = SelectedModelEstimator().fit(replace(log, effort=step * np.rint(effort / step)))
    found = [note for note in estimate.diagnostics.notes if "recorded in steps of" in note]
    assert bool(found) == coarse
    assert (estimate.status is Status.MODEL_MISMATCH) == coarse
