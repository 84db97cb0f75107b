"""Online estimators on the independent plant: coverage, faults, delay, static friction."""

from functools import cache
from typing import Any

import numpy as np
import pytest
import scipy.stats
from refusals import refuses

from stickslip.estimation import EnergyEstimator, ExtendedKalmanFilter
from stickslip.estimation.online.faults import admission
from stickslip.estimation.online.intervals import batches
from stickslip.estimation.online.kalman.state import fields
from stickslip.friction import CoulombViscousFriction
from stickslip.numerics.named_fields import fields_at
from stickslip.plants import SingleMass
from stickslip.simulation import simulate
from studies.mismatch.cases import record
from studies.online import ESTIMATORS, FAULTS, Outcome, estimator_for, outcome_of, samples_of, study

pytestmark = pytest.mark.slow

RUNS = 16
LEAST_COVERAGE, MOST_COVERAGE = 0.90, 0.98
SURE = 1e-3  # probability with which an estimator of that coverage fails a bound
FAULT_RUNS = 4
UNHARMED = 0.5  # of the half width without a fault: the largest change of an estimate
BATCHED = 0.9  # of an error by drift: what is left of it if friction is constant in a batch
T = 0.001


def passes(outcomes: list[Outcome]) -> bool:
    """Return whether enough intervals hold; the parameters of a run count as one trial."""
    inside = float(np.mean([each.inside for each in outcomes]))
    least = scipy.stats.binom.ppf(SURE, len(outcomes), LEAST_COVERAGE) / len(outcomes)
    return inside >= least and all(each.finite for each in outcomes)


@pytest.mark.parametrize(
    "case", ["noise", "correlated_098", "quantized", "stribeck", "friction_drift"]
)
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_intervals_hold_without_a_given_force_noise(estimator: str, case: str) -> None:
    assert passes(study(estimator, case, RUNS))


@cache
def undisturbed(estimator: str) -> list[Outcome]:
    return study(estimator, "noise", FAULT_RUNS, fault="none")


@pytest.mark.parametrize("fault", FAULTS[1:])
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_a_fault_is_over_within_two_moves(estimator: str, fault: str) -> None:
    outcomes = study(estimator, "noise", FAULT_RUNS, fault=fault)
    assert passes(outcomes)
    for one, other in zip(outcomes, undisturbed(estimator), strict=True):
        change = np.abs(one.error - other.error)
        assert np.all(change < UNHARMED * np.maximum(one.half_width, other.half_width))


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_values_of_any_kind_never_spoil_a_state(estimator: str) -> None:
    recorded = record("noise", 0)
    samples = samples_of(recorded)
    rng = np.random.default_rng(0)
    bad = np.array([np.nan, np.inf, -np.inf, 1e300, -1e200, 1e29, 0.0])
    hit = rng.random(samples.shape) < 0.05
    samples[hit] = rng.choice(bad, np.count_nonzero(hit))
    one = estimator_for(estimator, recorded)
    outcome = outcome_of(one, recorded, samples)
    assert outcome.finite
    assert np.all(outcome.error < outcome.half_width) or np.all(outcome.error < 1.0)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_a_state_that_is_not_finite_is_reset_and_reported(estimator: str) -> None:
    recorded = record("noise", 0)
    samples = samples_of(recorded)[:4000]
    one = estimator_for(estimator, recorded)
    state = one.init(sampling_time=T, velocity_measured=False)
    for sample in samples[:3000].tolist():
        one.kernel(state, *sample)
    untouched = state.copy()
    assert one.health(state).resets == 0
    state[one.values_at] = np.nan
    if estimator == "ekf":
        fields(state).careful.z[3] = np.nan
    for sample in samples[3000:].tolist():
        one.kernel(state, *sample)
        one.kernel(untouched, *sample)
    assert one.health(state).resets == 1
    assert "reset" in one.health(state).text
    np.testing.assert_allclose(state[one.values_at], untouched[one.values_at], rtol=0.5)


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("delay", [2.0, 0.5, -1.5])
def test_a_known_delay_is_removed(estimator: str, delay: float) -> None:
    recorded = record("noise", 1)
    samples = samples_of(recorded)
    index = np.arange(len(samples))
    late = samples.copy()
    late[:, 0] = np.interp(index + delay, index, samples[:, 0])  # the log is early by the delay
    plain = outcome_of(estimator_for(estimator, recorded), recorded, samples)
    right = outcome_of(estimator_for(estimator, recorded, delay=delay), recorded, late)
    wrong = outcome_of(estimator_for(estimator, recorded), recorded, late)
    assert np.all(right.error < plain.error + plain.half_width)
    assert wrong.error[0] > 1.5 * right.error[0]


def test_static_friction_is_not_learned_as_coulomb_friction() -> None:
    """The effort rises slowly to nearly the static friction again and again; no slip follows."""
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=2.0, viscous_friction=3.0, static_friction=3.0
    )
    time = np.arange(0.0, 8.0, T)
    slip = np.where(time < 4.0, 6.0 * np.sin(4.0 * time), 0.0)
    rest = np.where(time >= 4.5, 2.9 * np.sin(np.pi * (time - 4.5) / 3.5) ** 2, 0.0)
    motion = simulate(SingleMass(mass=1.5, friction=law), slip + rest, sampling_time=T)
    rng = np.random.default_rng(0)
    x = motion.position + 1e-6 * rng.normal(size=motion.position.size)
    ekf = ExtendedKalmanFilter(
        inertia=1.5,
        position_noise=1e-6,
        rest_speed=0.01,
        rest_force=4.0,
        initial_deviations={"viscous_friction": 10.0, "coulomb_friction": 5.0},
    )
    state = ekf.init(sampling_time=T, velocity_measured=False)
    effort = np.append(slip + rest, 0.0)
    found: list[Any] = []
    for k in range(x.size):
        state, values = ekf.step(state, (float(effort[k]), float(x[k]), 0.0, 0.0, 0.0))
        found.append(values)
    at_rest = np.array(found)[4500:, 1]
    assert np.ptp(at_rest) < 0.01 * 2.0


def test_a_delay_out_of_range_is_refused() -> None:
    for one in (
        EnergyEstimator(inertia=1.0, effort_delay=31.0),
        EnergyEstimator(inertia=1.0, effort_delay=float("nan")),
    ):
        with refuses("out_of_range", name="effort_delay"):
            one.init(sampling_time=T)


def test_a_step_is_accepted_after_the_stated_number_of_samples() -> None:
    s = fields_at(admission.ADMISSION_DTYPE)(np.zeros(admission.ADMISSION_SIZE))
    admission.set_admission(
        s, sampling_time=T, effort_delay=0.0, inertia=1.0, measured=(False, False, False)
    )
    rng = np.random.default_rng(0)
    for _ in range(100):
        admission.admit(s, 0.0, 1e-6 * rng.normal(), 0.0, 0.0, 0.0)
    seen = [admission.admit(s, 0.0, 1.0, 0.0, 0.0, 0.0) for _ in range(admission.LASTING + 2)]
    missing = [bool(np.isnan(each[3])) for each in seen]
    assert missing == [True] * admission.LASTING + [False, False]
    assert [each[7] for each in seen].index(True) == admission.LASTING
    assert s.motion_glitches == admission.LASTING
    assert s.motion_steps == 1


def batches_of(p: int) -> Any:
    """Return the cleared batches of p parameters."""
    dtype = batches.batches_dtype(p)
    state = fields_at(dtype)(np.zeros(dtype.itemsize // 8))
    batches.clear_batches(state)
    return state


def test_batch_intervals_cover_the_error_of_a_linear_drift() -> None:
    """Friction falls by a fifth over 8 moves whose speeds come in any order; there is no noise."""
    n, moves = 4000, np.repeat([0.15, 0.35, 0.6, 1.0], 2)
    middle = np.array([1.0, 1.0])  # viscous and Coulomb friction, of equal size at the top speed
    share = 1.0 - 0.2 * ((np.arange(n) + 0.5) / n - 0.5)
    for generator in np.random.default_rng(0).spawn(20):
        speed = np.repeat(generator.permutation(moves), n // moves.size)
        rows = np.column_stack([speed, np.ones(n)])
        targets = rows @ middle * share
        state = batches_of(2)
        for k in range(n):
            if batches.count_sample(state):
                past = rows[:k]
                batches.close_batch(state, past.T @ past, past.T @ targets[:k])
        values = np.linalg.lstsq(rows, targets)[0]
        low, high = batches.intervals_of(state, values, rows.T @ rows).T
        error = np.abs(values - middle)
        assert np.all(0.5 * (high - low) > BATCHED * batches.LEAST_WIDTH * error)


@pytest.mark.parametrize("correlation", [0.0, 0.9, 0.99])
def test_batch_intervals_cover_the_mean_of_correlated_noise(correlation: float) -> None:
    runs, n = 400, 4000
    inside = 0
    for generator in np.random.default_rng(1).spawn(runs):
        state = batches_of(1)
        noise = generator.normal(size=n)
        value, total = 0.0, 0.0
        for k in range(n):
            value = correlation * value + noise[k]
            if batches.count_sample(state):
                batches.close_batch(state, np.array([[float(k)]]), np.array([total]))
            total += value
        J = np.array([[float(n)]])
        low, high = batches.intervals_of(state, np.array([total / n]), J)[0]
        inside += low <= 0.0 <= high
    least = scipy.stats.binom.ppf(SURE, runs, LEAST_COVERAGE)
    most = scipy.stats.binom.ppf(1.0 - SURE, runs, MOST_COVERAGE)
    assert least <= inside <= most
