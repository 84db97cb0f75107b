"""IDIM least squares: every published digit of the EMPS benchmark, and the TX40 joints."""

from dataclasses import replace

import numpy as np
import pytest
from axis_logs import axis_log
from benchmark_logs import Find, emps
from refusals import refuses
from two_sines import Motion

from stickslip.estimation import EnergyEstimator, IdimLeastSquares
from stickslip.records import AxisLog, FrictionEstimate, Status

RATIOS = {1: 32.0, 4: -48.0}
PUBLISHED_TX40 = {1: (8.05, 7.14), 4: (1.11, 2.48)}
# The wrist couples into joint 4, which a fit of that joint alone takes for Coulomb friction
TX40_TOLERANCE = {1: (0.05, 0.05), 4: (0.05, 0.08)}

PUBLISHED_EMPS = {
    "mass": (95.1089, 0.1085),
    "viscous_friction": (203.5034, 1.1460),
    "coulomb_friction": (20.3935, 0.1012),
    "offset": (-3.1648, 0.0444),
}
PUBLISHED_DIRECTIONS = {
    "mass": 95.1540,
    "viscous_friction_positive": 166.7061,
    "viscous_friction_negative": 240.4236,
    "coulomb_friction_positive": 20.1440,
    "coulomb_friction_negative": 20.6277,
}
PRINTED_DIGITS = 4


def tx40(find: Find, joint: int) -> AxisLog:
    folder = find("staubli_tx40")
    current, position = (
        np.loadtxt(folder / f"{name}_data.csv", delimiter=",", skiprows=1, usecols=joint - 1)
        for name in ("curr", "pos_read")
    )
    return axis_log(
        np.arange(current.size) * 2e-4,
        current * RATIOS[joint],
        position / RATIOS[joint],
        name=f"joint {joint}",
        kind="rotary",
    )


@pytest.fixture(scope="module")
def emps_estimate(benchmark_data: Find) -> FrictionEstimate:
    return IdimLeastSquares().fit(emps(benchmark_data))


@pytest.mark.parametrize("name", PUBLISHED_EMPS)
def test_every_published_digit_of_emps(emps_estimate: FrictionEstimate, name: str) -> None:
    value, std = PUBLISHED_EMPS[name]
    assert round(emps_estimate.value(name), PRINTED_DIGITS) == value
    assert round(emps_estimate.diagnostics.classical_std[name], PRINTED_DIGITS) == std


def test_published_residual_of_emps(emps_estimate: FrictionEstimate) -> None:
    assert emps_estimate.status is Status.OK
    assert round(100 * emps_estimate.diagnostics.relative_residual, PRINTED_DIGITS) == 4.0834


def test_published_cross_test_on_pulses(
    emps_estimate: FrictionEstimate, benchmark_data: Find
) -> None:
    pulses = IdimLeastSquares().regression(emps(benchmark_data, "DATA_EMPS_PULSES"))
    values = {name: emps_estimate.value(name) for name in PUBLISHED_EMPS}
    assert round(100 * pulses.relative_residual(values), PRINTED_DIGITS) == 5.9824


def test_every_published_digit_per_direction(benchmark_data: Find) -> None:
    estimate = IdimLeastSquares(per_direction=True).fit(emps(benchmark_data))
    found = {name: round(estimate.value(name), PRINTED_DIGITS) for name in estimate.parameters}
    assert found == PUBLISHED_DIRECTIONS
    assert round(100 * estimate.diagnostics.relative_residual, PRINTED_DIGITS) == 3.1117


def test_correlated_residuals_widen_the_intervals(emps_estimate: FrictionEstimate) -> None:
    assert emps_estimate.diagnostics.residual_autocorrelation > 0.5
    for name, parameter in emps_estimate.parameters.items():
        assert parameter.std is not None
        assert parameter.std > 1.5 * emps_estimate.diagnostics.classical_std[name]


@pytest.mark.parametrize("joint", [1, 4])
@pytest.mark.parametrize("estimator", [IdimLeastSquares(), EnergyEstimator()])
def test_tx40_joints_fitted_alone(
    benchmark_data: Find, joint: int, estimator: IdimLeastSquares | EnergyEstimator
) -> None:
    estimate = estimator.fit(tx40(benchmark_data, joint))
    viscous, coulomb = PUBLISHED_TX40[joint]
    viscous_tolerance, coulomb_tolerance = TX40_TOLERANCE[joint]
    assert estimate.status is Status.OK
    assert estimate.value("viscous_friction") == pytest.approx(viscous, rel=viscous_tolerance)
    assert estimate.value("coulomb_friction") == pytest.approx(coulomb, rel=coulomb_tolerance)


def test_energies_agree_with_published_and_between_the_emps_files(benchmark_data: Find) -> None:
    names = ("mass", "viscous_friction", "coulomb_friction")
    files = ("DATA_EMPS", "DATA_EMPS_PULSES")
    fits = [EnergyEstimator().fit(emps(benchmark_data, name)) for name in files]
    first, second = ([fit.value(name) for name in names] for fit in fits)
    published = [PUBLISHED_EMPS[name][0] for name in names]
    np.testing.assert_allclose(first, published, rtol=0.08)
    np.testing.assert_allclose(second, published, rtol=0.08)
    np.testing.assert_allclose(first, second, rtol=0.05)


def test_a_cutoff_above_the_nyquist_frequency_is_refused() -> None:
    time = np.arange(2000) * 0.01
    log = axis_log(time, np.sin(time), np.cos(time))
    with refuses("cutoff_out_of_range", value=60.0):
        IdimLeastSquares(cutoff=60.0).fit(log)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_intervals_allow_for_an_effort_that_is_held(seed: int) -> None:
    rng = np.random.default_rng([seed, 577])
    step = 2e-3
    first, second = rng.uniform(0.0, 2.0 * np.pi, 2).tolist()
    time = np.arange(0.0, 12.0, step)
    motion = Motion(time=time, rates=(4.0, 11.0), sizes=(0.1, 0.06), phases=(first, second))
    held = replace(motion, time=time + 0.5 * step)  # the middle of a sample
    truth = {"mass": 3.0, "viscous_friction": 4.0, "coulomb_friction": 1.5}
    effort = held.effort() + 0.005 * rng.standard_normal(time.size)
    found = IdimLeastSquares(offset=False).fit(axis_log(time, effort, motion.position))
    for name, value in truth.items():
        interval = found.parameters[name].ci95
        assert interval is not None
        assert interval[0] <= value <= interval[1]
