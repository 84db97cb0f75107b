"""Selection of the model that a log supports, on motions in closed form and on an own plant."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from axis_logs import axis_log
from estimates import std_of
from refusals import refuses
from slow_cases import quick_where
from two_sines import EXTRAS, TIME, TRUTH, Motion, log_of

from stickslip.estimation import SelectedModelEstimator
from stickslip.records import InputError, Status

SAMPLED = 2e-4
"""Relative; a held effort follows a smooth one to second order of the sampling time."""


EXPECTED = {
    "spring": {"spring_stiffness": 20.0},
    "direction": {"viscous_friction_positive": 4.6, "viscous_friction_negative": 3.4},
    "quadratic": {"quadratic_friction": 30.0},
    "friction drift": {"friction_drift": -0.01},
    "viscous drift": {"viscous_drift": -0.2},
    "offset drift": {"offset_drift": 0.01},
    "gain drift": {"gain_drift": 0.01},
    "dead band": {"dead_band": 0.3},
    "stribeck": {"static_friction": 2.3, "stribeck_velocity": 0.02},
    "low speed": {"low_speed_friction": -0.6, "low_speed_velocity": 0.02},
    "ripple": {"ripple_sine": 0.2, "ripple_cosine": 0.0, "ripple_period": 0.015},
}
"""Parameters of the terms of `EXTRAS`."""


@pytest.mark.parametrize(
    "name",
    quick_where(lambda name: name not in {"stribeck", "ripple", "low speed", "quadratic"}, EXTRAS),
)
def test_a_term_of_the_axis_is_selected_and_estimated(name: str) -> None:
    estimate = SelectedModelEstimator().fit(log_of(EXTRAS[name]))
    assert estimate.selection is not None
    assert estimate.selection.selected == (name,)
    assert estimate.status is Status.OK
    # The Coulomb friction of a direction has the offset in it
    expected = {
        **TRUTH,
        "coulomb_friction_positive": 1.7,
        "coulomb_friction_negative": 1.3,
        **EXPECTED[name],
    }
    for parameter, value in estimate.parameters.items():
        assert value.ci95 is not None
        assert value.std is not None
        # Eight terms with up to seven parameters: 4 standard errors are passed once in 300
        error = abs((value.value or 0.0) - expected[parameter])
        assert error < 4.0 * value.std + SAMPLED * abs(expected[parameter]), parameter


@pytest.mark.slow
def test_plain_axis_gets_the_plain_model() -> None:
    selected = [SelectedModelEstimator().fit(log_of(seed=seed)).selection for seed in range(30)]
    # At 2 % of false selections, more than four of 30 are met once in 200 such tests
    assert sum(bool(found and found.selected) for found in selected) <= 4


def test_plain_axis_without_noise_is_exact() -> None:
    estimate = SelectedModelEstimator().fit(log_of(noise=0.0))
    for name, value in TRUTH.items():
        assert estimate.value(name) == pytest.approx(value, rel=SAMPLED)


@pytest.mark.parametrize(
    "delay", quick_where(lambda delay: abs(delay) > 0.005, [-0.0053, 0.0015, 0.002, 0.09])
)
def test_delay_of_the_effort_is_estimated(delay: float) -> None:
    estimate = SelectedModelEstimator().fit(log_of(delay=delay))
    error = abs(estimate.value("effort_delay") - delay)
    assert error < 4.0 * std_of(estimate, "effort_delay") + 1e-5
    for name, value in TRUTH.items():
        assert abs(estimate.value(name) - value) < 4.0 * std_of(estimate, name) + SAMPLED * value


def test_terms_are_tested_in_a_log_of_two_moves() -> None:
    whole = log_of(lambda m: 20.0 * m.position)
    # From one reversal of the motion to the next but one: 0.1 sin 2t + 0.05 sin 5t
    turns = np.flatnonzero(np.diff(np.sign(Motion(time=TIME).velocity)) != 0)
    lengths = turns[2:] - turns[:-2]
    start = int(np.argmax(lengths))
    found = SelectedModelEstimator().fit(whole.part(int(turns[start]), int(turns[start + 2])))
    assert found.selection is not None
    assert "spring" in {score.term for score in found.selection.scores}
    spring = found.parameters.get("spring_stiffness")
    assert spring is None or abs((spring.value or 0.0) - 20.0) < 4.0


def test_known_delay_is_not_estimated() -> None:
    estimate = SelectedModelEstimator(effort_delay=0.002).fit(log_of(delay=0.002))
    assert "effort_delay" not in estimate.parameters
    assert estimate.value("mass") == pytest.approx(3.0, rel=0.01)


@pytest.mark.slow
def test_terms_can_be_fixed_and_left_out() -> None:
    log = log_of(EXTRAS["spring"])
    fixed = SelectedModelEstimator(include=("spring", "direction"), select=False).fit(log)
    assert {"spring_stiffness", "viscous_friction_positive"} <= set(fixed.parameters)
    without = SelectedModelEstimator(exclude=("spring",)).fit(log)
    assert "spring_stiffness" not in without.parameters
    plain = SelectedModelEstimator(select=False).fit(log)
    assert set(plain.parameters) == set(TRUTH)


def test_unknown_term_is_rejected() -> None:
    with refuses("not_a_choice", name="term", value="springs"):
        SelectedModelEstimator(include=("springs",))


@pytest.mark.parametrize("include", [("direction",), ("presliding", "ripple", "friction drift")])
def test_terms_of_a_log_in_one_direction_do_not_break_the_fit(include: tuple[str, ...]) -> None:
    position = 0.05 * TIME + 0.002 * np.sin(3.0 * TIME)
    log = replace(log_of(), measured_position=position)
    SelectedModelEstimator(include=include).fit(log)


def test_term_of_narrow_support_is_not_identified_by_a_wide_interval() -> None:
    estimate = SelectedModelEstimator(include=("presliding",)).fit(log_of())
    parameter = estimate.parameters.get("presliding_friction")
    if parameter is not None and parameter.ci95 is not None:
        assert parameter.ci95[1] - parameter.ci95[0] < 2.0


@pytest.mark.parametrize(
    "settings",
    [
        {"include": ("spring", "spring")},
        {"include": ("spring",), "exclude": ("spring",)},
        {"include": ("saturation",)},
        {"include": ("delay",), "effort_delay": 0.001},
        {"effort_delay": float("nan")},
        {"effort_delay": 1e3},
    ],
)
def test_contradicting_settings_are_rejected(settings: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        SelectedModelEstimator(**settings)


@pytest.mark.slow
def test_a_ripple_that_a_window_averages_in_part_is_found() -> None:
    # At the median speed of 0.08 m/s a window of 20 ms passes 0.6 of this wave
    wave = 2.0 * np.pi / 0.0025
    log = log_of(lambda m: 0.2 * np.sin(wave * m.position))
    estimate = SelectedModelEstimator().fit(log)
    assert estimate.selection is not None
    assert estimate.selection.selected == ("ripple",)
    assert estimate.selection.scores[0].shape == pytest.approx(0.0025, rel=1e-3)
    assert estimate.value("ripple_sine") == pytest.approx(0.2, rel=0.1)


def test_a_stroke_shorter_than_a_window_has_no_ripple() -> None:
    # A sine that grows to its amplitude: between its ends the windows are wider than the travel
    time = np.arange(0.0, 10.0, 0.005)
    rates = np.array([2j * np.pi * 1.6, 2j * np.pi * 1.6 - 2.0])
    terms = np.exp(np.outer(time, rates)) * [1.0, -1.0]
    velocity = 0.0125 * np.imag(terms @ rates)
    noise = np.random.default_rng(0).normal(scale=1e-5, size=time.size)
    log = axis_log(
        time,
        47.0 * 0.0125 * np.imag(terms @ rates**2) + 30.0 * velocity + 70.0 * np.sign(velocity),
        0.0125 * np.imag(terms.sum(axis=1)) + noise,
    )
    estimate = SelectedModelEstimator().fit(log)
    assert estimate.selection is not None
    assert "ripple" not in estimate.selection.selected
    assert estimate.value("coulomb_friction") == pytest.approx(70.0, rel=0.02)


def test_terms_that_are_missing_without_a_selection_are_named() -> None:
    estimate = SelectedModelEstimator(select=False).fit(log_of(EXTRAS["spring"]))
    assert estimate.status is Status.MODEL_MISMATCH
    assert "a spring acts on the axis" in estimate.diagnostics.notes[0]
    plain = SelectedModelEstimator(select=False).fit(log_of())
    assert plain.status is Status.OK
