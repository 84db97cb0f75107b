"""Intervals of online estimators where a log determines less than all parameters."""

import numpy as np

from stickslip.estimation import ExtendedKalmanFilter
from stickslip.estimation.online.intervals.batches import batches_dtype, intervals_of
from stickslip.estimation.online.kalman.kernels import ekf_run

MASS, VISCOUS, COULOMB, OFFSET = 3.0, 4.0, 1.5, -0.9
LEAST_COVERAGE = 0.92  # of 95 %; with 600 intervals that is 3.4 standard errors below
NARROW = 0.05  # of the value: what the motion determines keeps a useful interval


def test_one_direction_does_not_separate_coulomb_friction_from_the_offset() -> None:
    T = 1e-3
    time = T * np.arange(8000.0)
    velocity = 0.1 * (1.0 - np.exp(-2.0 * time)) + 0.03 * (1.0 - np.cos(3.0 * time))
    acceleration = np.gradient(velocity, T)
    position = np.concatenate(([0.0], np.cumsum(0.5 * T * (velocity[1:] + velocity[:-1]))))
    effort = MASS * acceleration + VISCOUS * velocity + COULOMB + OFFSET
    effort += 0.01 * np.random.default_rng(1).standard_normal(time.size)
    estimator = ExtendedKalmanFilter(
        inertia=MASS, offset=True, position_noise=1e-6 / np.sqrt(12.0), rest_speed=1e-3,
        rest_force=2.0,
        initial_deviations={"viscous_friction": 50.0, "coulomb_friction": 5.0, "offset": 5.0},
    )  # fmt: skip
    state = estimator.init(sampling_time=T, velocity_measured=False)
    zero = np.zeros(time.size)
    position = 1e-6 * np.round(position / 1e-6)
    ekf_run(state, np.column_stack([effort, position, zero, zero, zero]))
    low, high = estimator.intervals(state).T
    assert np.all((low <= [VISCOUS, COULOMB, OFFSET]) & (high >= [VISCOUS, COULOMB, OFFSET]))
    assert high[0] - low[0] < NARROW * VISCOUS
    assert high[1] - low[1] > COULOMB


def test_coverage_with_a_first_guess_of_what_no_sample_shows() -> None:
    """Bayesian linear regression of two parameters, of which the rows show the sum."""
    rng = np.random.default_rng(2)
    deviations = np.array([2.0, 0.5])
    first = np.diag(deviations**-2.0)
    inside = np.zeros(2)
    runs, count, size = 300, 6, 40
    for _ in range(runs):
        truth = deviations * rng.standard_normal(2)
        batches = np.zeros(1, batches_dtype(2)).view(np.recarray)[0]
        information, vector = first.copy(), np.zeros(2)
        batches.closed, batches.length = count + 1, size
        for k in range(count + 1):
            batches.snapshots[k]["information"], batches.snapshots[k]["eta"] = information, vector
            rows = np.ones((size, 2))
            target = rows @ truth + 0.1 * rng.standard_normal(size)
            if k < count:
                information = information + rows.T @ rows / 0.1**2
                vector = vector + rows.T @ target / 0.1**2
        low, high = intervals_of(batches, np.linalg.solve(information, vector), information).T
        inside += (low <= truth) & (truth <= high)
    assert np.all(inside >= LEAST_COVERAGE * runs), inside
