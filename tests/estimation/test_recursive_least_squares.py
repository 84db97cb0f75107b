"""Recursive least squares: against batch solutions, and through rests of any length."""

import numpy as np
import pytest
import statsmodels.api as sm
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refuses
from statsmodels.regression.recursive_ls import RecursiveLS

from stickslip.estimation import RecursiveLeastSquares

VAGUE = 1e9  # P(0) large enough that the first guesses do not count
PRIOR_LEFT = 1e-6  # what is left of the first guesses then
TRUTH = np.array([1.0, -2.0, 3.0])


def excited(seed: int, n: int = 400, noise: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(seed)
    rows = generator.normal(size=(n, 3))
    return rows, rows @ TRUTH + noise * generator.normal(size=n)


@pytest.mark.parametrize("forgetting", ["restricted", "exponential"])
def test_without_forgetting_it_is_ordinary_least_squares(forgetting: str) -> None:
    rows, targets = excited(1)
    rls = RecursiveLeastSquares(forgetting=forgetting)  # type: ignore[arg-type]
    state = rls.init(initial_values=[0.0, 0.0, 0.0], initial_variance=VAGUE)
    state, history = rls.run(state, rows, targets)
    batch, *_ = np.linalg.lstsq(rows, targets, rcond=None)
    np.testing.assert_allclose(history[-1], batch, rtol=PRIOR_LEFT)
    np.testing.assert_allclose(
        rls.covariance(state), np.linalg.inv(rows.T @ rows), rtol=PRIOR_LEFT, atol=1e-9
    )
    theirs = RecursiveLS(targets, rows).fit()
    np.testing.assert_allclose(history[-1], theirs.params, rtol=PRIOR_LEFT)


def test_the_printed_form_is_weighted_least_squares() -> None:
    rows, targets = excited(2)
    factor = 0.98
    rls = RecursiveLeastSquares(forgetting_factor=factor, forgetting="exponential")
    state = rls.init(initial_values=[0.0, 0.0, 0.0], initial_variance=VAGUE)
    _, history = rls.run(state, rows, targets)
    weights = factor ** np.arange(targets.size - 1, -1, -1)
    batch = sm.WLS(targets, rows, weights=weights).fit().params
    np.testing.assert_allclose(history[-1], batch, rtol=PRIOR_LEFT)


def test_steps_one_by_one_are_the_run_and_leave_the_state_alone() -> None:
    rows, targets = excited(3, n=20)
    rls = RecursiveLeastSquares(forgetting_factor=0.95)
    start = rls.init(initial_values=[0.0, 0.0, 0.0], initial_variance=10.0)
    before = start.copy()
    state = start
    for row, target in zip(rows, targets, strict=True):
        state, values = rls.step(state, (row, float(target)))
    whole, history = rls.run(start, rows, targets)
    np.testing.assert_array_equal(values, history[-1])
    np.testing.assert_array_equal(state, whole)
    np.testing.assert_array_equal(start, before)


@settings(max_examples=40, deadline=None)
@given(
    factor=st.floats(0.5, 1.0),
    rest=st.sampled_from(["nothing", "constant", "noise"]),
    noise=st.sampled_from([0.0, 0.1]),
    seed=st.integers(0, 1000),
)
def test_no_rest_winds_it_up(factor: float, rest: str, noise: float, seed: int) -> None:
    rls = RecursiveLeastSquares(forgetting_factor=factor)
    state = rls.init(initial_values=[0.0, 0.0, 0.0], initial_variance=1e6)
    rows, targets = excited(seed, noise=noise)
    state, history = rls.run(state, rows, targets)
    known, spread = history[-1].copy(), rls.covariance(state)
    generator = np.random.default_rng(seed + 1)
    idle = {
        "nothing": np.zeros((20_000, 3)),
        "constant": np.tile([0.3, 0.2, 0.0], (20_000, 1)),
        "noise": 1e-6 * generator.normal(size=(20_000, 3)),
    }[rest]
    resting = idle @ TRUTH + noise * generator.normal(size=20_000)
    state, history = rls.run(state, idle, resting)
    drift = history - known
    after = rls.covariance(state)
    # Forgetting ends where a row has the weight of 1 - lambda
    assert idle[0] @ after @ idle[0] <= max(idle[0] @ spread @ idle[0], (1 - factor) / factor) * (
        1 + 1e-9
    )
    if rest != "constant":
        np.testing.assert_allclose(after, spread, rtol=1e-6, atol=1e-9 * np.trace(spread))
        assert np.max(np.abs(drift)) <= 1e-4
    # What the rows do not determine is known as before: its information and estimate
    information = np.linalg.inv(spread)
    others = np.array([[0.0, 0.0, 1.0], [-0.2, 0.3, 0.0]])
    kept = others @ information @ others.T
    np.testing.assert_allclose(others @ np.linalg.inv(after) @ others.T, kept, rtol=1e-5)
    drifted = np.max(np.abs(drift @ information @ others.T))
    assert drifted <= 1e-5 * np.linalg.norm(information @ TRUTH)


def test_with_forgetting_it_follows_a_change() -> None:
    rows, targets = excited(5, n=2000, noise=0.0)
    targets[1000:] += rows[1000:, 0]
    rls = RecursiveLeastSquares(forgetting_factor=0.98)
    state = rls.init(initial_values=[0.0, 0.0, 0.0], initial_variance=1e6)
    _, history = rls.run(state, rows, targets)
    np.testing.assert_allclose(history[999], TRUTH, rtol=1e-5)
    np.testing.assert_allclose(history[-1], TRUTH + np.array([1.0, 0.0, 0.0]), rtol=1e-3)


@pytest.mark.usefixtures("without_shape_checks")
def test_impossible_first_guesses_are_refused() -> None:
    with refuses("guesses_out_of_range", count=6):
        RecursiveLeastSquares().init(initial_values=[0.0] * 6, initial_variance=1.0)
    with refuses("samples_not_finite", name="initial_values"):
        RecursiveLeastSquares().init(initial_values=[0.0, np.nan], initial_variance=1.0)


@pytest.mark.usefixtures("without_shape_checks")
def test_rows_that_do_not_fit_or_are_not_finite_are_refused() -> None:
    rls = RecursiveLeastSquares()
    state = rls.init(initial_values=[0.0, 0.0], initial_variance=1.0)
    before = state.copy()
    with refuses("row_does_not_fit", shape=(3,), parameters=2):
        rls.step(state, (np.zeros(3), 1.0))
    with refuses("row_not_finite"):
        rls.step(state, (np.array([1.0, np.nan]), 1.0))
    with refuses("row_not_finite"):
        rls.step(state, (np.ones(2), np.inf))
    with refuses("rows_do_not_fit"):
        rls.run(state, np.ones((3, 2)), np.ones(2))
    with refuses("rows_not_finite", row=1):
        rls.run(state, np.ones((2, 2)), np.array([1.0, np.nan]))
    np.testing.assert_array_equal(state, before)
    _, values = rls.step(state, (np.array([1, 0]), 1))
    np.testing.assert_allclose(values, [0.5, 0.0])
