"""Parameters that a log does not determine have a verdict with the reason, and no value."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from axis_logs import axis_log
from two_sines import Motion

from stickslip.estimation import EnergyEstimator, IdimLeastSquares, examine
from stickslip.estimation.fit.diagnostics import (
    condition_number,
    cross_validation_residual,
    determined,
)
from stickslip.estimation.fit.rows import Regression, summarise_motion
from stickslip.estimation.fit.solve import provenance_of, solve
from stickslip.friction import CoulombViscousFriction
from stickslip.records import AxisLog, FrictionEstimate, Status

LAW = CoulombViscousFriction.symmetric(coulomb_friction=2.0, viscous_friction=5.0)
MASS = 3.0
Estimator = EnergyEstimator | IdimLeastSquares
BOTH = pytest.mark.parametrize("estimator", [EnergyEstimator(), IdimLeastSquares()])


def log_of(velocity: Callable[[np.ndarray], np.ndarray], seed: int = 0) -> AxisLog:
    """Make the log of an axis that follows a velocity, with a little noise on force and encoder."""
    generator = np.random.default_rng(seed)
    time = np.arange(10_000) * 0.001
    v = velocity(time)
    x = np.concatenate([[0.0], np.cumsum(0.0005 * (v[1:] + v[:-1]))])
    effort = MASS * np.gradient(v, 0.001) + LAW.friction(v)
    return axis_log(
        time,
        effort + 0.05 * generator.normal(size=time.size),
        x + 1e-6 * generator.normal(size=time.size),
    )


def with_effort(log: AxisLog, effort: np.ndarray) -> AxisLog:
    return axis_log(log.time, effort, log.measured_position, name=log.name, kind=log.kind)


def good_motion(time: np.ndarray) -> np.ndarray:
    return Motion(time=time).velocity


def reasons(estimate: FrictionEstimate) -> dict[str, str]:
    verdicts = estimate.diagnostics.verdicts
    assert [v.parameter for v in verdicts] == list(estimate.parameters)
    assert all(estimate.parameters[v.parameter].identified == v.identifiable for v in verdicts)
    return {v.parameter: v.reason for v in verdicts if not v.identifiable}


@BOTH
def test_a_good_log_is_trusted(estimator: Estimator) -> None:
    estimate = estimator.fit(log_of(good_motion))
    assert estimate.status is Status.OK
    assert reasons(estimate) == {}
    assert estimate.value("mass") == pytest.approx(MASS, rel=0.01)
    assert estimate.value("coulomb_friction") == pytest.approx(2.0, rel=0.01)


@BOTH
def test_one_speed_determines_neither_friction_nor_inertia(estimator: Estimator) -> None:
    estimate = estimator.fit(log_of(lambda t: np.full_like(t, 0.1)))
    assert not estimate.status.trusted
    found = reasons(estimate)
    assert "speed varies by" in found["viscous_friction"]
    assert "moves one way only" in found["coulomb_friction"]
    assert "hardly accelerates" in found["mass"]


@BOTH
def test_one_direction_does_not_separate_coulomb_friction_and_offset(estimator: Estimator) -> None:
    estimate = estimator.fit(log_of(lambda t: 0.1 + 0.05 * np.sin(3 * t)))
    assert estimate.status is Status.NOT_IDENTIFIABLE
    found = reasons(estimate)
    assert set(found) == {"coulomb_friction", "offset"}
    assert all("moves one way only" in reason for reason in found.values())
    assert estimate.value("viscous_friction") == pytest.approx(5.0, rel=0.02)


@BOTH
def test_one_direction_is_enough_without_an_offset(estimator: Estimator) -> None:
    chosen = type(estimator)(offset=False)
    estimate = chosen.fit(log_of(lambda t: 0.1 + 0.05 * np.sin(3 * t)))
    assert estimate.status is Status.OK
    assert estimate.value("coulomb_friction") == pytest.approx(2.0, rel=0.01)


@BOTH
def test_a_direction_that_is_not_travelled_has_no_friction(estimator: Estimator) -> None:
    chosen = type(estimator)(per_direction=True)
    estimate = chosen.fit(log_of(lambda t: 0.1 + 0.05 * np.sin(3 * t)))
    found = reasons(estimate)
    assert set(found) == {"viscous_friction_negative", "coulomb_friction_negative"}
    assert all("negative direction" in reason for reason in found.values())


@BOTH
@pytest.mark.parametrize("position", ["noise", "one encoder step"])
def test_an_axis_at_rest_determines_nothing(estimator: Estimator, position: str) -> None:
    generator = np.random.default_rng(1)
    time = np.arange(5000) * 0.001
    positions = {
        "noise": 1e-6 * generator.normal(size=5000),
        "one encoder step": np.where(time > 2.0, 1e-7, 0.0),
    }
    log = axis_log(time, np.sin(time), positions[position])
    estimate = estimator.fit(log)
    assert estimate.status is Status.INSUFFICIENT_EXCITATION
    assert not any(p.identified for p in estimate.parameters.values())
    assert set(reasons(estimate).values()) == {"the axis hardly moves in this log"}
    identification = examine(log, estimator)
    assert identification.curve is None
    assert identification.resimulation is None


@BOTH
def test_an_effort_of_the_wrong_sign_is_unphysical(estimator: Estimator) -> None:
    log = log_of(good_motion)
    assert estimator.fit(with_effort(log, -log.effort)).status is Status.UNPHYSICAL


@BOTH
def test_an_effort_that_has_nothing_to_do_with_the_motion_is_not_trusted(
    estimator: Estimator,
) -> None:
    log = log_of(good_motion)
    generator = np.random.default_rng(2)
    estimate = estimator.fit(with_effort(log, generator.normal(size=len(log))))
    assert not estimate.status.trusted
    known = type(estimator)(inertia=MASS)
    assert known.fit(with_effort(log, generator.normal(size=len(log)))).status in {
        Status.POOR_FIT,
        Status.UNPHYSICAL,
    }


def test_too_little_motion_for_the_inertia_is_a_verdict() -> None:
    log = log_of(good_motion).part(0, 300)
    estimate = EnergyEstimator().fit(log)
    assert not estimate.status.trusted
    assert not estimate.parameters["mass"].identified


def test_columns_that_go_together_are_found_by_name() -> None:
    generator = np.random.default_rng(3)
    one, two = generator.normal(size=(2, 500))
    columns = np.column_stack([one, two, 3 * one + 1e-4 * generator.normal(size=500)])
    found = determined(columns, np.zeros(3))
    assert found.undetermined == (frozenset({0, 2}),)
    np.testing.assert_array_equal(found.mask(3), [False, True, False])


def test_columns_of_noise_are_found() -> None:
    columns = np.random.default_rng(4).normal(size=(500, 2))
    found = determined(columns, np.array([0.5, 0.1]))
    assert found.undetermined == (frozenset({0}),)


def test_condition_number_is_that_of_scaled_columns() -> None:
    angle = 0.3
    columns = np.array([[1.0, 100 * np.cos(angle)], [0.0, 100 * np.sin(angle)]])
    # Two unit vectors at an angle have singular values sqrt(1 +- cos)
    expected = np.sqrt((1 + np.cos(angle)) / (1 - np.cos(angle)))
    assert condition_number(columns) == pytest.approx(expected)
    assert condition_number(np.array([[1.0, 0.0], [1.0, 0.0]])) == float("inf")


def rows_of(target: np.ndarray, columns: np.ndarray) -> Regression:
    return Regression(
        kind="linear",
        names=tuple(f"p{k}" for k in range(columns.shape[1])),
        time=np.arange(target.size, dtype=float),
        target=target,
        regressors=columns,
        regressor_noise=np.zeros(columns.shape[1]),
        quantity="effort",
        motion=summarise_motion([np.arange(2.0)], [np.ones(2)], 1.0, (0.0, 0.0)),
        samples=target.size,
    )


def test_cross_validation_sees_what_a_fit_hides() -> None:
    generator = np.random.default_rng(5)
    target = generator.normal(size=60)
    columns = generator.normal(size=(60, 10))
    fitted, *_ = np.linalg.lstsq(columns, target, rcond=None)
    inside = np.linalg.norm(target - columns @ fitted) / np.linalg.norm(target)
    outside = cross_validation_residual(rows_of(target, columns))
    assert outside is not None
    assert inside < 0.97
    assert outside > 1.0
    assert cross_validation_residual(rows_of(target[:20], columns[:20])) is None


def test_cross_validation_leaves_out_information_and_not_time() -> None:
    """A push, and a rest that is as long as nine pushes: every fifth of the push stands alone."""
    generator = np.random.default_rng(6)
    columns = np.zeros((1000, 2))
    columns[:100] = generator.normal(size=(100, 2))
    target = columns @ [2.0, 3.0] + 1e-3 * generator.normal(size=1000)
    left_out = cross_validation_residual(rows_of(target, columns))
    inside = np.linalg.norm(target - columns @ [2.0, 3.0]) / np.linalg.norm(target)
    # Left-out rows are predicted from four fifths: the error grows by a few per cent
    assert left_out == pytest.approx(inside, rel=0.1)


@pytest.mark.parametrize(("noise", "informative"), [(0.1, True), (0.4, False)])
def test_an_effect_is_small_beside_the_effort_and_not_beside_derivatives(
    noise: float, informative: bool
) -> None:
    """Limit: half of the interval has 10 % of the largest effort; derivatives are 50 times that."""
    time = np.arange(400.0)
    sign = np.sign(np.sin(0.3 * time + 0.1))
    effort = sign + noise * np.random.default_rng(6).normal(size=time.size)
    weak = np.zeros(time.size)
    weak[::50] = [1.0, -1.0] * 4
    derivative = 50.0 * np.cos(0.05 * time)
    rows = replace(
        rows_of(effort + derivative, np.column_stack([sign, weak, derivative])),
        names=("coulomb_friction", "offset", "effort_delay"),
        effort=effort,
        motion=summarise_motion([np.sin(0.1 * time)], [0.1 * np.cos(0.1 * time)], 1.0, (0.0, 0.0)),
    )
    source = provenance_of(log_of(good_motion), {})
    found = solve(rows, estimator="least squares", provenance=source)
    half = 1.96 * noise / np.sqrt(8)
    assert (half / np.max(np.abs(effort)) < 0.1) == informative
    assert half / np.max(np.abs(rows.target)) < 0.1  # the limit would not hold there
    assert found.parameters["offset"].identified == informative
    assert (
        "half of its 95 % interval exceeds the value" in reasons(found).get("offset", "")
    ) != informative


@pytest.mark.parametrize("phase", [0.0, 0.5 * np.pi, 1.0])
def test_a_sine_and_its_cosine_are_informative_together(phase: float) -> None:
    """The phase is a choice of the origin: a component near zero says nothing of the ripple."""
    time = np.arange(400.0)
    sign = np.sign(np.sin(0.05 * time + 0.1))
    waves = np.column_stack([np.sin(0.7 * time), np.cos(0.7 * time)])
    effort = sign + 0.5 * np.sin(0.7 * time + phase)
    effort += 2.0 * np.random.default_rng(6).normal(size=time.size)
    rows = replace(
        rows_of(effort, np.column_stack([sign, 0.1 * waves])),
        names=("coulomb_friction", "ripple_sine", "ripple_cosine"),
        motion=summarise_motion([np.sin(0.1 * time)], [0.1 * np.cos(0.1 * time)], 1.0, (0.0, 0.0)),
    )
    found = solve(
        rows, estimator="least squares", provenance=provenance_of(log_of(good_motion), {})
    )
    assert all(found.parameters[name].identified for name in rows.names[1:])


def test_another_law_widens_an_interval_and_withholds_no_value() -> None:
    time = np.arange(400.0)
    columns = np.column_stack([np.sign(np.sin(0.3 * time + 0.1)), np.sin(0.05 * time)])
    noise = 0.01 * np.random.default_rng(7).normal(size=time.size)
    rows = replace(
        rows_of(columns @ [1.0, 1.0] + noise, columns),
        names=("coulomb_friction", "viscous_friction"),
        motion=summarise_motion([np.sin(0.1 * time)], [0.1 * np.cos(0.1 * time)], 1.0, (0.0, 0.0)),
    )
    source = provenance_of(log_of(good_motion), {})
    shift = np.array([0.5, -0.8])
    plain, law, other = (
        solve(each, estimator="least squares", provenance=source)
        for each in (rows, replace(rows, law_shifts=shift[None]), replace(rows, shifts=shift[None]))
    )
    np.testing.assert_allclose(law.covariance, plain.covariance + 0.5 * np.outer(shift, shift))
    for name, change in zip(rows.names, shift.tolist(), strict=True):
        low, high = plain.parameters[name].ci95 or (0.0, 0.0)
        both = (min(low, low + change), max(high, high + change))
        assert law.parameters[name].ci95 == pytest.approx(both)
    assert not other.parameters["viscous_friction"].identified
