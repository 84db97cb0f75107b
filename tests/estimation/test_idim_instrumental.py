"""Instrumental variables: unbiased where least squares is not, and alike on a real axis."""

from functools import cache

import numpy as np
import pytest
from benchmark_logs import Find, emps
from estimates import assert_covers

from stickslip.estimation import IdimInstrumentalVariables, IdimLeastSquares
from stickslip.estimation.fit.rows import Regression
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import AxisLog, Status
from stickslip.simulation import Sensors, SimulatedMotion, simulate

T = 0.001
TRUTH = {"mass": 1.0, "viscous_friction": 1.0, "coulomb_friction": 1.0, "offset": 0.2}
LAW = CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=1.0, offset=0.2)
NOISE = 1e-4
RUNS = 40
STANDARD_ERRORS = 4.0
SMEARED = 0.005  # relative: low-pass and decimation smear the reversals of friction


@cache
def motion() -> SimulatedMotion:
    time = np.arange(0.0, 10.0, T)
    effort = 3.0 * np.sin(2.0 * time) + 2.0 * np.sin(5.1 * time)
    return simulate(SingleMass(mass=1.0, friction=LAW), effort, sampling_time=T)


def log_of(noise: float, seed: int) -> AxisLog:
    sensors = Sensors(position_noise=noise, velocity="none")
    return sensors.measure(motion(), np.random.default_rng(seed))


def solution(rows: Regression) -> np.ndarray:
    """Return the relative errors of the least-squares solution of some rows."""
    values = np.linalg.lstsq(rows.regressors, rows.target, rcond=None)[0]
    return values / np.array([TRUTH[name] for name in rows.names]) - 1.0


@pytest.fixture(scope="module")
def logs() -> list[AxisLog]:
    return [log_of(NOISE, seed) for seed in range(RUNS)]


@pytest.fixture(scope="module")
def instrumental(logs: list[AxisLog]) -> list[Regression]:
    return [IdimInstrumentalVariables().regression(log) for log in logs]


def test_without_noise_it_is_right_up_to_what_filters_smear() -> None:
    found = IdimInstrumentalVariables().fit(log_of(0.0, 0))
    for name, true in TRUTH.items():
        assert found.value(name) == pytest.approx(true, rel=SMEARED)


@pytest.mark.slow
def test_unbiased_where_least_squares_is_biased(
    logs: list[AxisLog], instrumental: list[Regression]
) -> None:
    free = np.array([solution(rows) for rows in instrumental])
    biased = np.array([solution(IdimLeastSquares().regression(log)) for log in logs])
    chance = STANDARD_ERRORS * free.std(axis=0) / np.sqrt(RUNS)
    assert np.all(np.abs(free.mean(axis=0)) < chance + SMEARED)
    # Noise of the acceleration pulls the inertia to zero, and the friction follows
    spread = STANDARD_ERRORS * biased.std(axis=0) / np.sqrt(RUNS)
    beyond = np.abs(biased.mean(axis=0)) - spread
    assert biased.mean(axis=0)[0] < 0.0
    assert beyond[0] > 20.0 * SMEARED
    assert np.all(beyond[:3] > 2.0 * SMEARED)


@pytest.mark.slow
def test_intervals_cover(logs: list[AxisLog]) -> None:
    assert_covers((IdimInstrumentalVariables().fit(log) for log in logs), TRUTH)


def test_its_rows_solve_the_instrumental_equations() -> None:
    """Least squares on the rows is (Z' W)^-1 Z' y, and the residual is orthogonal to Z."""
    log = log_of(NOISE, 1)
    estimator = IdimInstrumentalVariables()
    rows = estimator.regression(log)
    values = np.linalg.lstsq(rows.regressors, rows.target, rcond=None)[0]
    residual = rows.target - rows.regressors @ values
    np.testing.assert_allclose(rows.regressors.T @ residual, 0.0, atol=1e-8)
    found = estimator.fit(log)
    np.testing.assert_allclose(values, [found.value(name) for name in rows.names], rtol=1e-9)
    # Values over noise: what is left is what the measured rows leave, not the projected ones
    measured = IdimLeastSquares().regression(log)
    left = measured.target - measured.regressors @ values
    assert np.std(residual) == pytest.approx(np.std(left), rel=0.1)


def test_a_known_inertia_and_friction_per_direction() -> None:
    found = IdimInstrumentalVariables(inertia=1.0, per_direction=True).fit(log_of(1e-5, 0))
    assert "mass" not in found.parameters
    assert found.value("viscous_friction_positive") == pytest.approx(1.0, rel=0.02)
    # An offset is half the difference of the two Coulomb values
    assert found.value("coulomb_friction_positive") == pytest.approx(1.2, rel=0.02)
    assert found.value("coulomb_friction_negative") == pytest.approx(0.8, rel=0.02)


def test_it_agrees_with_least_squares_on_emps(benchmark_data: Find) -> None:
    log = emps(benchmark_data)
    found, other = IdimInstrumentalVariables().fit(log), IdimLeastSquares().fit(log)
    assert found.status is Status.OK
    for name, parameter in other.parameters.items():
        assert parameter.std is not None
        assert abs(found.value(name) - other.value(name)) < parameter.std
    assert found.diagnostics.relative_residual < other.diagnostics.relative_residual
