"""Smoothing, noise levels, rests and reversals."""

import numpy as np
import pytest
import scipy.signal
from hypothesis import given
from hypothesis import strategies as st
from refusals import refuses

from stickslip.estimation.energy.balance import travel_direction
from stickslip.estimation.energy.unknown_inertia.level_regression import whiten_levels
from stickslip.estimation.signals.kinematics import (
    LowPass,
    central_difference,
    decimate,
    noise_level,
    rests,
)
from stickslip.estimation.signals.observation import fuse, motion_noise
from stickslip.estimation.signals.velocity_delay import velocity_match

ROUNDING = 1e-9
POLYNOMIAL = 1e-6
"""Digits that a filter of order 8 loses when it is written as one polynomial, as scipy's is."""


@pytest.mark.parametrize("derivatives", [0, 1, 2])
def test_the_noise_gain_is_what_noise_shows(derivatives: int) -> None:
    low_pass = LowPass(order=4, cutoff=50.0)
    noise = np.random.default_rng(1).normal(size=200_000)
    values = low_pass.apply(noise, 0.001)
    for _ in range(derivatives):
        values = central_difference(values, 0.001)
    expected = low_pass.noise_gain(0.001, derivatives=derivatives)
    assert np.std(values) == pytest.approx(expected, rel=0.03)


def test_the_low_pass_does_not_delay() -> None:
    time = np.arange(4000) * 0.001
    slow = np.sin(2 * np.pi * time)
    filtered = LowPass(order=4, cutoff=50.0).apply(slow, 0.001)
    np.testing.assert_allclose(filtered[200:-200], slow[200:-200], atol=1e-6)
    with refuses("cutoff_out_of_range", value=600.0):
        LowPass(order=4, cutoff=600.0).apply(slow, 0.001)


@pytest.mark.parametrize("samples", [500, 503])
def test_decimation_is_that_of_scipy_and_keeps_the_last_sample(samples: int) -> None:
    columns = np.random.default_rng(2).normal(size=(samples, 2)).cumsum(axis=0)
    b, a = scipy.signal.cheby1(8, 0.05, 0.08)
    filtered = scipy.signal.filtfilt(b, a, columns, axis=0, padlen=24)
    found = decimate(columns, 10)
    np.testing.assert_allclose(found, filtered[::-1][::10][::-1], atol=POLYNOMIAL)
    np.testing.assert_array_equal(decimate(columns, 1), columns)


@pytest.mark.parametrize("factor", [10, 100, 500])
def test_decimation_by_any_factor_is_stable(factor: int) -> None:
    # Two passes at the bottom of 0.05 dB of ripple, as an even order has it at zero frequency
    level = decimate(np.ones((100 * factor, 1)), factor)[20:-20]
    np.testing.assert_allclose(level, 10 ** (-2 * 0.05 / 20), rtol=1e-6)


@pytest.mark.parametrize("deviation", [1e-6, 1e-3])
def test_the_noise_level_is_found_under_a_motion_with_jumps(deviation: float) -> None:
    time = np.arange(20_000) * 0.001
    motion = np.where(time < 10, 0.5 * time**2, 50 + 10 * (time - 10))
    noise = deviation * np.random.default_rng(3).normal(size=time.size)
    assert noise_level(motion + noise) == pytest.approx(deviation, rel=0.05)
    assert noise_level(np.arange(5.0)) == 0.0


def test_rests_last_and_reversals_do_not() -> None:
    velocity = np.array([1.0, 0.1, -0.1, -1.0, 0.0, 0.0, 0.1, 0.0, 1.0])
    found = rests(velocity, threshold=0.2, least_samples=3)
    np.testing.assert_array_equal(np.flatnonzero(found), [4, 5, 6, 7])


def test_direction_turns_at_the_furthest_point() -> None:
    position = np.array([0.0, 1.0, 3.0, 2.9, 3.1, 2.8, 1.0, 1.2, 5.0])
    np.testing.assert_array_equal(
        travel_direction(position, 0.5), [1.0, 1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0]
    )
    np.testing.assert_array_equal(travel_direction(np.array([0.0, 0.1, -0.1]), 0.5), [0.0, 0.0])


@given(st.lists(st.integers(-20, 20), min_size=2, max_size=60))
def test_without_hysteresis_the_distance_is_the_total_variation(steps: list[int]) -> None:
    position = np.cumsum(np.array([0, *steps], dtype=float))
    way = travel_direction(position, 0.0) * np.diff(position)
    assert np.sum(way) == pytest.approx(np.sum(np.abs(np.diff(position))))


@given(
    st.lists(st.floats(-5, 5), min_size=2, max_size=60),
    st.floats(0.01, 3.0),
)
def test_hysteresis_never_counts_more_distance_than_there_is(
    steps: list[float], hysteresis: float
) -> None:
    position = np.cumsum(np.array([0.0, *steps]))
    way = float(np.sum(travel_direction(position, hysteresis) * np.diff(position)))
    assert way <= np.sum(np.abs(np.diff(position))) + 1e-9
    assert way >= -hysteresis - 1e-9


def test_fusing_is_the_least_squares_solution() -> None:
    generator = np.random.default_rng(4)
    n, T, sw, sv = 30, 0.1, 0.2, 0.5
    x, v = generator.normal(size=(2, n))
    # Every measurement as one weighted row of a dense problem
    step = np.diff(np.eye(n), axis=0)
    scale = T * sv
    rows = np.vstack([np.eye(n) / sw, step / scale])
    right = np.concatenate([x / sw, 0.5 * T * (v[1:] + v[:-1]) / scale])
    dense, *_ = np.linalg.lstsq(rows, right, rcond=None)
    np.testing.assert_allclose(fuse(x, v, sw, sv, T), dense, rtol=ROUNDING)


def test_fused_positions_are_as_exact_as_stated() -> None:
    generator = np.random.default_rng(5)
    time = np.arange(20_000) * 0.01
    truth, speed = np.sin(time), np.cos(time)
    x = truth + 0.005 * generator.normal(size=time.size)
    v = speed + 0.05 * generator.normal(size=time.size)
    noise = motion_noise(x, v, LowPass(order=4, cutoff=10.0), 0.01)
    error = fuse(x, v, noise.position, noise.velocity, 0.01) - truth
    assert noise.position == pytest.approx(0.005, rel=0.05)
    assert noise.velocity == pytest.approx(0.05, rel=0.05)
    assert np.std(error) == pytest.approx(noise.smooth_position, rel=0.05)
    assert noise.smooth_position < 0.25 * noise.position


@pytest.mark.parametrize("duration", [10.0, 200.0])
def test_noise_is_noise_however_far_the_axis_goes(duration: float) -> None:
    """A micrometre over three metres, and over sixty."""
    time = np.arange(0.0, duration, 0.001)
    velocity = 0.3 + 0.1 * np.sin(5.0 * time)
    position = 0.3 * time - 0.02 * np.cos(5.0 * time)
    generator = np.random.default_rng(7)
    found = motion_noise(
        position + 1e-6 * generator.normal(size=time.size),
        velocity + 1e-3 * generator.normal(size=time.size),
        LowPass(order=4, cutoff=100.0),
        0.001,
    )
    # A quantile of 10 000 differences is known to 1.5 %
    assert found.position == pytest.approx(1e-6, rel=0.06)
    assert found.velocity == pytest.approx(1e-3, rel=0.06)


@pytest.mark.parametrize("delay", [0.0, 0.5, 2.0])
def test_the_delay_of_a_velocity_is_found(delay: float) -> None:
    generator = np.random.default_rng(7)
    T, time = 0.001, np.arange(8000) * 0.001
    x = np.sin(3 * time) + 1e-6 * generator.normal(size=time.size)
    v = 3 * np.cos(3 * (time - delay * T)) + 1e-3 * generator.normal(size=time.size)
    match = velocity_match(x, v, LowPass(order=4, cutoff=100.0), T)
    assert match is not None
    assert match.delay == pytest.approx(delay * T, abs=4 * match.delay_std)
    assert match.delay_std < 0.1 * T


def test_whitened_levels_are_generalised_least_squares() -> None:
    generator = np.random.default_rng(6)
    n = 40
    disturbance, noise = generator.uniform(0.1, 2.0, n - 1), generator.uniform(0.1, 2.0, n)
    columns = generator.normal(size=(n, 2)).cumsum(axis=0)
    level = columns @ [1.0, -2.0] + generator.normal(size=n)
    white, _ = whiten_levels(np.column_stack([level, columns]), disturbance, noise)
    ours, *_ = np.linalg.lstsq(white[:, 1:], white[:, 0], rcond=None)
    # Dense: covariance of a random walk plus white noise, and an unknown constant
    walk = np.concatenate([[0.0], np.cumsum(disturbance)])
    covariance = np.minimum.outer(walk, walk) + np.diag(noise)
    design = np.column_stack([columns, np.ones(n)])
    weight = np.linalg.inv(covariance)
    dense = np.linalg.solve(design.T @ weight @ design, design.T @ weight @ level)
    np.testing.assert_allclose(ours, dense[:2], rtol=ROUNDING)
