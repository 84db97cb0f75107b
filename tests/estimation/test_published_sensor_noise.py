"""Noise of the sensors from a log, and what it adds to energies."""

import numpy as np
import pytest
from axis_logs import axis_log
from refusals import refuses

from stickslip.estimation import SensorNoise, sensor_noise_of
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.records import AxisLog

DRAWS = 200_000
STANDARD_ERRORS = 5.0  # missed by chance once in two million comparisons
SIGMA = 0.05


def test_energies_grow_by_their_bracket() -> None:
    """Eqs. 5.6, 5.7 and 5.26, by Monte Carlo."""
    draws = SIGMA * np.random.default_rng(0).standard_normal((4, DRAWS))
    v1, v2, x1, x2 = 0.3, -0.2, 0.5, 0.1
    m1, m2, ks = 2.0, 0.7, 3.0
    noise = SensorNoise(
        position=0.1 * SIGMA, velocity=SIGMA, load_position=0.3 * SIGMA, load_velocity=0.5 * SIGMA
    )
    kinetic = 0.5 * m1 * (v1 + draws[0]) ** 2 + 0.5 * m2 * (v2 + 0.5 * draws[1]) ** 2
    stretch = (x1 + 0.1 * draws[2]) - (x2 + 0.3 * draws[3])
    measured = kinetic + 0.5 * ks * stretch**2
    true = 0.5 * m1 * v1**2 + 0.5 * m2 * v2**2 + 0.5 * ks * (x1 - x2) ** 2
    error = np.std(measured, ddof=1) / np.sqrt(DRAWS)
    assert abs(np.mean(measured) - noise.level_bias(m1, m2, ks) - true) < STANDARD_ERRORS * error


def test_negative_noise_is_an_error() -> None:
    with refuses("negative", name="noise of the load velocity", value=-2.0):
        SensorNoise(position=0.0, velocity=0.0, load_position=0.0, load_velocity=-2.0)


def moving_log(sigma_w: float, sigma_v: float, rest: int) -> AxisLog:
    """Return a log that moves smoothly for 20 s and then rests; the load has half the noise."""
    noise = np.random.default_rng(5).standard_normal((4, 2000 + rest))
    time = 0.01 * np.arange(2000 + rest)
    moving = np.minimum(time, 20.0)
    x, v = np.sin(moving - 10.0), np.where(time < 20.0, np.cos(moving - 10.0), 0.0)
    return AxisLog(
        name="arm",
        kind="linear",
        time=time,
        effort=np.ones(time.size),
        measured_position=x + sigma_w * noise[0],
        measured_velocity=v + sigma_v * noise[1],
        measured_load_position=x + 0.5 * sigma_w * noise[2],
        measured_load_velocity=v + 0.5 * sigma_v * noise[3],
    )


CUTOFF = 8.0  # Hz, another than the default


@pytest.mark.parametrize("rest", [0, 4000])
def test_noise_is_estimated_from_a_log(rest: int) -> None:
    found = sensor_noise_of(moving_log(0.005, 0.05, rest))
    # An 80 % quantile of 2000 correlated differences is good to about 3 %; three of that
    assert found.position == pytest.approx(0.005, rel=0.1)
    assert found.velocity == pytest.approx(0.05, rel=0.1)
    assert found.load_position == pytest.approx(0.0025, rel=0.1)
    assert found.load_velocity == pytest.approx(0.025, rel=0.1)


def test_a_log_without_noise_has_none() -> None:
    found = sensor_noise_of(moving_log(0.0, 0.0, 0))
    assert found == SensorNoise(position=0.0, velocity=0.0, load_position=0.0, load_velocity=0.0)
    log = moving_log(0.005, 0.05, 0)
    rigid = axis_log(log.time, log.effort, log.measured_position)
    found = sensor_noise_of(rigid, cutoff=CUTOFF)
    assert (found.load_position, found.load_velocity) == (0.0, 0.0)
    # Of a velocity that is the filtered position, differentiated
    gain = LowPass(order=4, cutoff=CUTOFF).noise_gain(0.01, derivatives=1)
    assert found.velocity == pytest.approx(found.position * gain, rel=1e-12)
