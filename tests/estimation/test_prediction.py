"""Effort predicted for a log, against efforts in closed form."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from axis_logs import axis_log
from jaxtyping import Float
from refusals import refuses

from stickslip.estimation import EnergyEstimator, SelectedModelEstimator, predict_effort
from stickslip.records import AxisLog

TIME = np.arange(0.0, 20.0, 1e-3)
TRUTH = {"mass": 3.0, "viscous_friction": 4.0, "coulomb_friction": 1.5, "offset": 0.2}

CLOSE = 3e-3
"""Of the largest effort; what smoothing of the acceleration and the grid of a delay leave."""

Column = Callable[[Float[np.ndarray, " n"]], Float[np.ndarray, " n"]]


def position(time: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    return -0.05 * np.cos(2.0 * time) - 0.01 * np.cos(5.0 * time)


def velocity(time: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    return 0.1 * np.sin(2.0 * time) + 0.05 * np.sin(5.0 * time)


def plain(time: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Return the effort of `TRUTH`."""
    acceleration = 0.2 * np.cos(2.0 * time) + 0.25 * np.cos(5.0 * time)
    speed = velocity(time)
    return 3.0 * acceleration + 4.0 * speed + 1.5 * np.sign(speed) + 0.2


FURTHER: dict[str, Column] = {
    "direction": lambda t: 0.6 * np.abs(velocity(t)),
    "quadratic": lambda t: 30.0 * velocity(t) * np.abs(velocity(t)),
    "stribeck": lambda t: 0.8 * np.sign(velocity(t)) * np.exp(-((velocity(t) / 0.02) ** 2)),
    "low speed": lambda t: -0.6 * np.sign(velocity(t)) * np.exp(-((velocity(t) / 0.02) ** 2)),
    "spring": lambda t: 20.0 * position(t),
    "ripple": lambda t: 0.2 * np.sin(2.0 * np.pi * position(t) / 0.015),
    "offset drift": lambda t: 0.01 * (t - 10.0),
    "friction drift": lambda t: (
        -0.01 * (1.5 * np.sign(velocity(t)) + 4.0 * velocity(t)) * (t - 10.0)
    ),
    "dead band": lambda t: 0.3 * np.sign(plain(t)),
    "gain drift": lambda t: plain(t) * (1.0 / (1.0 + 0.01 * (t - 10.0)) - 1.0),
}
"""By the term that it is: an effort over time."""


def log_of(effort: Column, *, kind: str = "linear") -> AxisLog:
    """Return a log whose effort is held over each sample."""
    return axis_log(
        TIME, effort(TIME + 0.5e-3), position(TIME), kind="linear" if kind == "linear" else "rotary"
    )


@pytest.mark.parametrize("name", FURTHER)
def test_the_prediction_has_every_selected_term(name: str) -> None:
    log = log_of(lambda t: plain(t) + FURTHER[name](t))
    estimate = SelectedModelEstimator().fit(log)
    assert estimate.selection is not None
    assert estimate.selection.selected == (name,)
    predicted = predict_effort(estimate, log)
    known = np.isfinite(predicted)
    assert np.mean(known) > 0.9
    np.testing.assert_allclose(
        predicted[known], log.effort[known], atol=CLOSE * float(np.max(np.abs(log.effort)))
    )


@pytest.mark.slow
def test_the_prediction_has_gravity_and_the_two_thirds_law() -> None:
    def effort(time: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        angle, speed = 20.0 * position(time), 20.0 * velocity(time)
        friction = np.sign(speed) * (1.0 + 2.0 * np.abs(speed) ** (2.0 / 3.0))
        acceleration = 4.0 * np.cos(2.0 * time) + 5.0 * np.cos(5.0 * time)
        return 0.3 * acceleration + friction + 2.0 * np.sin(angle) - np.cos(angle)

    log = replace(log_of(effort, kind="rotary"), measured_position=20.0 * position(TIME))
    estimate = SelectedModelEstimator().fit(log)
    assert estimate.selection is not None
    assert set(estimate.selection.selected) == {"gravity", "two-thirds"}
    predicted = predict_effort(estimate, log)
    known = np.isfinite(predicted)
    np.testing.assert_allclose(
        predicted[known], log.effort[known], atol=CLOSE * float(np.max(np.abs(log.effort)))
    )


def test_the_prediction_has_the_delay_of_the_logged_effort() -> None:
    delay = 0.0064
    log = log_of(lambda t: plain(t + delay))
    estimate = SelectedModelEstimator().fit(log)
    assert estimate.value("effort_delay") == pytest.approx(delay, rel=0.01)
    predicted = predict_effort(estimate, log)
    known = np.isfinite(predicted)
    assert np.mean(known) > 0.9
    error = np.abs(predicted - log.effort)[known]
    assert float(np.max(error)) < CLOSE * float(np.max(np.abs(log.effort)))


def test_the_effort_of_the_log_is_not_used() -> None:
    estimate = EnergyEstimator().fit(log_of(plain))
    log = log_of(plain)
    other = replace(log, effort=np.random.default_rng(1).normal(size=len(log)))
    np.testing.assert_array_equal(predict_effort(estimate, other), predict_effort(estimate, log))


def test_nothing_is_predicted_at_rest_and_beside_gaps() -> None:
    log = log_of(plain)
    estimate = SelectedModelEstimator().fit(log)
    time = np.where(TIME < 10.0, TIME, TIME + 1.0)
    rest = (TIME > 4.0) & (TIME < 5.0)
    stays = np.where(rest, position(np.array([4.0])), log.measured_position)
    predicted = predict_effort(estimate, replace(log, time=time, measured_position=stays))
    assert np.all(np.isnan(predicted[(TIME > 4.1) & (TIME < 4.9)]))
    assert np.all(np.isnan(predicted[np.abs(TIME - 10.0) < 5e-3]))
    assert np.isfinite(predicted[np.abs(TIME - 7.0) < 0.01]).all()


def test_a_known_inertia_is_given_again() -> None:
    log = log_of(plain)
    estimate = SelectedModelEstimator(inertia=3.0).fit(log)
    predicted = predict_effort(estimate, log, inertia=3.0)
    known = np.isfinite(predicted)
    np.testing.assert_allclose(predicted[known], log.effort[known], atol=0.01)
    with refuses("estimate_without_inertia"):
        predict_effort(estimate, log)


def test_a_log_of_another_axis_is_refused() -> None:
    log = log_of(plain)
    estimate = SelectedModelEstimator().fit(log)
    with refuses("log_of_other_kind"):
        predict_effort(estimate, replace(log, kind="rotary"))
    with refuses("position_constant"):
        predict_effort(estimate, replace(log, measured_position=np.zeros(len(log))))
