"""Channels of an arm that are not measured, on a swing in closed form."""

import numpy as np
import pytest

from stickslip.control.landing.tracked.sensing import VelocityLag, with_lag
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm
from stickslip.records import SensorSample

T = 0.01
LAW = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)
ARM = FlexibleArm(mass_1=1.0, mass_2=0.5, stiffness=2.0, friction=LAW)
FREQUENCY = 2.0  # of mass 2 while mass 1 rests [rad/s]
STEP = 1e-5  # of an encoder [m]


def swing(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return position and velocity of mass 2 about a resting mass 1."""
    w = FREQUENCY
    return 0.2 * np.cos(w * time), -0.2 * w * np.sin(w * time)


def estimate(
    position: np.ndarray, velocity: np.ndarray, noise: tuple[float, float] = (0.0, 0.0)
) -> float:
    lag, last = VelocityLag(), None
    for k, (x, v) in enumerate(zip(position, velocity, strict=True)):
        sample = SensorSample(k * T, 0.0, 0.0, float(x), float(v))
        if last is not None:
            lag = lag.after(last, sample, ARM)
        last = sample
    return lag.estimate(T, noise)


@pytest.mark.parametrize("lag", [0.0, 0.3 * T, 2.0 * T])
def test_it_is_that_of_the_samples(lag: float) -> None:
    time = np.arange(400) * T
    position, velocity = swing(time)[0], swing(time - lag)[1]
    assert estimate(position, velocity) == pytest.approx(lag, rel=5e-3, abs=1e-12)


def test_differences_of_an_encoder_lag_by_half_a_sample() -> None:
    position = STEP * np.round(swing(np.arange(400) * T)[0] / STEP)
    velocity = np.diff(position, prepend=position[0]) / T
    noise = STEP / np.sqrt(12.0), STEP / (T * np.sqrt(6.0))
    assert estimate(position[1:], velocity[1:], noise) == pytest.approx(0.5 * T, rel=0.02)


def test_noise_is_no_lag() -> None:
    generator, time = np.random.default_rng(6), np.arange(400) * T
    noise, trials = (1e-4, 1e-2), 200
    found = []
    for _ in range(trials):
        x, v = swing(time)
        noisy = x + noise[0] * generator.normal(size=x.size)
        found.append(estimate(noisy, v + noise[1] * generator.normal(size=v.size), noise) > 0.0)
    assert sum(found) <= 3  # at three standard deviations 0.3 of 200 are expected


def test_positions_get_the_lag_of_velocities() -> None:
    time, lag = np.arange(300) * T, 1.5 * T
    x, _ = swing(time)
    seen = np.column_stack([x, swing(time - lag)[1], x, swing(time - lag)[1]])
    late = with_lag(seen, lag, T)
    np.testing.assert_allclose(late[10:, 0], swing(time[10:] - lag)[0], atol=2e-7)
    np.testing.assert_array_equal(late[:, 1], seen[:, 1])
    assert with_lag(seen, 0.0, T) is seen
