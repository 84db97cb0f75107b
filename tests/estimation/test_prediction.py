"""Effort predicted for a log, against efforts in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from axis_logs import axis_log
from refusals import refuses
from two_sines import EXTRAS, MIDDLE, TIME, Motion, log_of

from stickslip.estimation import EnergyEstimator, SelectedModelEstimator, predict_effort

CLOSE = 3e-3
"""Of the largest effort; what smoothing of the acceleration and the grid of a delay leave."""


@pytest.mark.parametrize("name", EXTRAS)
def test_the_prediction_has_every_selected_term(name: str) -> None:
    log = log_of(EXTRAS[name], noise=0.0)
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
    acts = Motion(time=MIDDLE, sizes=(2.0, 1.0))
    angle, speed = acts.position, acts.velocity
    friction = np.sign(speed) * (1.0 + 2.0 * np.abs(speed) ** (2.0 / 3.0))
    effort = 0.3 * acts.acceleration + friction + 2.0 * np.sin(angle) - np.cos(angle)
    log = axis_log(TIME, effort, Motion(time=TIME, sizes=(2.0, 1.0)).position, kind="rotary")
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
    log = log_of(delay=delay, noise=0.0)
    estimate = SelectedModelEstimator().fit(log)
    assert estimate.value("effort_delay") == pytest.approx(delay, rel=0.01)
    predicted = predict_effort(estimate, log)
    known = np.isfinite(predicted)
    assert np.mean(known) > 0.9
    error = np.abs(predicted - log.effort)[known]
    assert float(np.max(error)) < CLOSE * float(np.max(np.abs(log.effort)))


def test_the_effort_of_the_log_is_not_used() -> None:
    estimate = EnergyEstimator().fit(log_of(noise=0.0))
    log = log_of(noise=0.0)
    other = replace(log, effort=np.random.default_rng(1).normal(size=len(log)))
    np.testing.assert_array_equal(predict_effort(estimate, other), predict_effort(estimate, log))


def test_nothing_is_predicted_at_rest_and_beside_gaps() -> None:
    log = log_of(noise=0.0)
    estimate = SelectedModelEstimator().fit(log)
    time = np.where(TIME < 10.0, TIME, TIME + 1.0)
    rest = (TIME > 4.0) & (TIME < 5.0)
    stays = np.where(rest, Motion(time=np.array([4.0])).position, log.measured_position)
    predicted = predict_effort(estimate, replace(log, time=time, measured_position=stays))
    assert np.all(np.isnan(predicted[(TIME > 4.1) & (TIME < 4.9)]))
    assert np.all(np.isnan(predicted[np.abs(TIME - 10.0) < 5e-3]))
    assert np.isfinite(predicted[np.abs(TIME - 7.0) < 0.01]).all()


def test_a_known_inertia_is_given_again() -> None:
    log = log_of(noise=0.0)
    estimate = SelectedModelEstimator(inertia=3.0).fit(log)
    predicted = predict_effort(estimate, log, inertia=3.0)
    known = np.isfinite(predicted)
    np.testing.assert_allclose(predicted[known], log.effort[known], atol=0.01)
    with refuses("estimate_without_inertia"):
        predict_effort(estimate, log)


def test_a_log_of_another_axis_is_refused() -> None:
    log = log_of(noise=0.0)
    estimate = SelectedModelEstimator().fit(log)
    with refuses("log_of_other_kind"):
        predict_effort(estimate, replace(log, kind="rotary"))
    with refuses("position_constant"):
        predict_effort(estimate, replace(log, measured_position=np.zeros(len(log))))
