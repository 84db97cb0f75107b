"""Logs with jitter, lost samples and gaps give what the uniform log gives."""

from dataclasses import replace

import numpy as np
import pytest

from stickslip.estimation import EnergyEstimator, IdimLeastSquares
from stickslip.estimation.signals.resampling import resampled
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import AxisLog
from stickslip.simulation import Sensors, simulate

TRUTH = {"mass": 95.0, "viscous_friction": 200.0, "coulomb_friction": 20.0}
T = 0.001


@pytest.fixture(scope="module")
def fine() -> AxisLog:
    """Ten samples where the axis' log has one."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=20.0, viscous_friction=200.0)
    time = np.arange(100_000) * (T / 10)
    effort = 70.0 * np.sin(2.0 * time) + 60.0 * np.sin(7.0 * time)
    motion = simulate(SingleMass(mass=95.0, friction=law), effort, sampling_time=T / 10)
    return Sensors(velocity="none").measure(motion)


def chosen(log: AxisLog, index: np.ndarray) -> AxisLog:
    """Keep some samples; each effort becomes the mean of what was applied until the next."""
    work = np.concatenate(([0.0], np.cumsum(log.effort[:-1] * np.diff(log.time))))
    held = np.diff(work[index]) / np.diff(log.time[index])
    return replace(
        log,
        time=log.time[index],
        effort=np.append(held, held[-1]),
        measured_position=log.measured_position[index],
    )


def with_jitter() -> np.ndarray:
    """Stamps that deviate by 30 % of the sampling time."""
    shift = np.random.default_rng(1).integers(-3, 4, 10_001)
    shift[[0, -1]] = 0
    return np.arange(0, 100_001, 10) + shift


def with_losses() -> np.ndarray:
    """One sample in a hundred is missing."""
    kept = np.random.default_rng(2).random(10_001) > 0.01
    kept[[0, -1]] = True
    return np.arange(0, 100_001, 10)[kept]


@pytest.mark.parametrize("index", [with_jitter(), with_losses()], ids=["jitter", "losses"])
@pytest.mark.parametrize("estimator", [EnergyEstimator(), IdimLeastSquares()])
def test_jitter_and_losses_cost_no_accuracy(
    fine: AxisLog, index: np.ndarray, estimator: EnergyEstimator | IdimLeastSquares
) -> None:
    found = estimator.fit(chosen(fine, index))
    uniform = estimator.fit(chosen(fine, np.arange(0, 100_001, 10)))
    assert any("resampled" in note for note in found.diagnostics.notes)
    for name, value in TRUTH.items():
        assert found.value(name) == pytest.approx(uniform.value(name), rel=3e-3)
        assert found.value(name) == pytest.approx(value, rel=0.01)


def test_the_input_energy_of_a_stretch_stays(fine: AxisLog) -> None:
    log = chosen(fine, with_jitter())
    uniform, _ = resampled(log)
    for each in (log, uniform):
        impulse = float(np.sum(each.effort[:-1] * np.diff(each.time)))
        assert impulse == pytest.approx(float(np.sum(fine.effort[:-1]) * T / 10), abs=1e-9)


def test_a_uniform_log_is_left_alone(fine: AxisLog) -> None:
    log = chosen(fine, np.arange(0, 100_001, 10))
    same, notes = resampled(log)
    assert same is log
    assert notes == ()
