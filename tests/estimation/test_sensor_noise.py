"""Coarse encoders, and cutoffs that fit the noise of a position."""

import numpy as np
import pytest

from stickslip.estimation import EnergyEstimator
from stickslip.estimation.fit.rows import summarise_motion
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.estimation.signals.sensor_noise import chosen_cutoff, encoder_step, position_noise
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import AxisLog, Status
from stickslip.simulation import Sensors, simulate

LAW = CoulombViscousFriction.symmetric(coulomb_friction=20.0, viscous_friction=200.0)
TRUTH = {"viscous_friction": 200.0, "coulomb_friction": 20.0}
START = LowPass(order=4, cutoff=100.0)
COARSE = 0.03
"""Largest error with counts of 1 mm in a stroke of 0.3 m: friction turns within a count."""


def stage_log(
    sensors: Sensors, mass: float, amplitudes: tuple[float, float], frequencies: tuple[float, float]
) -> AxisLog:
    time = np.arange(20_000) * 0.001
    effort = amplitudes[0] * np.sin(frequencies[0] * time)
    effort += amplitudes[1] * np.sin(frequencies[1] * time)
    motion = simulate(SingleMass(mass=mass, friction=LAW), effort, sampling_time=0.001)
    return sensors.measure(motion, np.random.default_rng(0))


def slow_log(sensors: Sensors) -> AxisLog:
    return stage_log(sensors, 95.0, (70.0, 60.0), (2.0, 7.0))


def encoder(step: float) -> Sensors:
    return Sensors(encoder_step=step, velocity="none")


@pytest.mark.parametrize(
    ("sensors", "tolerance"),
    [
        (encoder(1e-3), COARSE),
        (encoder(5e-4), 0.01),
        (encoder(3e-4), 0.01),
        (Sensors(position_noise=5e-4, velocity="none"), 0.01),
    ],
)
def test_noise_of_the_position_leaves_no_bias(sensors: Sensors, tolerance: float) -> None:
    """Energies smoothed at 100 Hz gave Coulomb friction of 1.2, 16.8, 19.1 and 10.0 N."""
    estimate = EnergyEstimator().fit(slow_log(sensors))
    assert estimate.status is Status.OK
    for name, value in TRUTH.items():
        low, high = estimate.parameters[name].ci95 or (np.nan, np.nan)
        assert low <= value <= high
        assert estimate.value(name) == pytest.approx(value, rel=tolerance)


@pytest.mark.parametrize("frequencies", [(10.0, 25.0), (40.0, 90.0)])
def test_the_cutoff_stays_above_the_motion(frequencies: tuple[float, float]) -> None:
    amplitude = 20.0 * frequencies[0]
    sensors = Sensors(position_noise=5e-4, velocity="none")
    log = stage_log(sensors, 20.0, (amplitude, amplitude), frequencies)
    cutoff, (note,) = chosen_cutoff(log, START, 50, load=False)
    assert cutoff > 2 * frequencies[1] / (2 * np.pi)
    assert f"{cutoff:.3g} Hz" in note
    estimate = EnergyEstimator().fit(log)
    for name, value in TRUTH.items():
        low, high = estimate.parameters[name].ci95 or (np.nan, np.nan)
        assert low <= value <= high


def test_a_cutoff_that_is_given_is_kept_and_a_quiet_log_keeps_the_usual_one() -> None:
    noisy = slow_log(encoder(1e-3))

    def roughness(estimator: EnergyEstimator) -> float:
        ((levels, _),) = estimator.levels(noisy)
        return float(np.std(np.diff(levels.motion.smooth_velocity)))

    assert roughness(EnergyEstimator(cutoff=80.0)) > 2.0 * roughness(EnergyEstimator())
    assert chosen_cutoff(slow_log(encoder(1e-6)), START, 50, load=False) == (100.0, ())
    # A short log does not allow for a low cutoff
    cutoff, _ = chosen_cutoff(noisy.part(0, 2000), START, 50, load=False)
    assert cutoff >= 25.0


def test_an_encoder_is_seen_by_its_single_counts() -> None:
    time = np.arange(4000) * 0.001
    counts = np.round(0.02 * np.sin(2 * time) / 1e-3) * 1e-3
    assert encoder_step(counts) == pytest.approx(1e-3)
    assert position_noise(counts) == pytest.approx(1e-3 / np.sqrt(12.0))
    assert encoder_step(np.zeros(10)) == 0.0
    assert encoder_step(np.repeat([0.0, 1e-3, 2e-3], [50, 1, 50])) == 1e-3


@pytest.mark.parametrize("dwell", [0, 5])
def test_slow_sampling_of_a_fast_motion_is_no_encoder(dwell: int) -> None:
    """A triangle of 0.2 m that returns to the same 21 positions, which are 10 mm apart."""
    up = np.arange(0, 21)
    cycle = np.concatenate([up, np.full(dwell, 20), up[-2:0:-1], np.zeros(dwell, dtype=int)])
    position = np.round(0.01 * np.tile(cycle, 20) / 1e-6) * 1e-6
    assert encoder_step(position) == 0.0
    velocity = np.gradient(position, 0.05)
    motion = summarise_motion([position], [velocity], 0.05, (3e-7, 1e-6))
    assert motion.position_noise == 3e-7
