"""Tests of further columns, and fits without groups of rows, against refits and Monte Carlo."""

import numpy as np
import pytest

from stickslip.estimation.selection.significance import (
    Basis,
    held_out_errors,
    jackknife,
    significance,
)


def test_held_out_errors_are_those_of_refits() -> None:
    rng = np.random.default_rng(5)
    columns = rng.standard_normal((60, 3)) * [1.0, 1e3, 1e-3]
    target = rng.standard_normal(60)
    group = np.repeat(np.arange(5), 12)
    expected = []
    for k in range(5):
        out = group == k
        values = np.linalg.lstsq(columns[~out], target[~out], rcond=None)[0]
        expected.append(np.sum((target[out] - columns[out] @ values) ** 2))
    assert held_out_errors(columns, target, group) == pytest.approx(expected, rel=1e-9)


def test_the_jackknife_of_equal_groups_is_that_of_refits() -> None:
    rng = np.random.default_rng(6)
    columns = np.tile(rng.standard_normal((12, 3)) * [1.0, 1e3, 1e-3], (5, 1))
    target = rng.standard_normal(60)
    group = np.repeat(np.arange(5), 12)
    without = np.array(
        [np.linalg.lstsq(columns[group != k], target[group != k], rcond=None)[0] for k in range(5)]
    )
    expected = 4.0 / 5.0 * np.sum((without - without.mean(axis=0)) ** 2, axis=0)
    found = jackknife(columns, target, group)
    assert np.sum(found**2, axis=0) == pytest.approx(expected, rel=1e-9)


def test_a_column_of_one_group_has_no_differences() -> None:
    rng = np.random.default_rng(8)
    columns = np.column_stack([rng.standard_normal(60), np.zeros(60)])
    columns[:12] = np.column_stack([np.zeros(12), rng.standard_normal(12)])
    found = jackknife(columns, rng.standard_normal(60), np.repeat(np.arange(5), 12))
    assert np.all(np.isfinite(found))
    assert np.all(found[:, 1] == 0.0)
    assert np.any(found[:, 0] != 0.0)


@pytest.mark.slow
def test_the_jackknife_of_unequal_groups_has_the_variance_under_white_noise() -> None:
    rng = np.random.default_rng(7)
    runs = 4000
    size = np.repeat([0.3, 1.0, 1.0, 3.0], 15)
    columns = np.column_stack([size * rng.standard_normal(60), rng.standard_normal(60)])
    group = np.repeat(np.arange(4), 15)
    found = np.array([jackknife(columns, rng.standard_normal(60), group) for _ in range(runs)])
    squares = np.sum(found**2, axis=1)
    expected = np.diag(np.linalg.inv(columns.T @ columns))
    # The mean over the groups takes less than 1 / (g - 1) of the sum away
    error = 4.0 * np.std(squares, axis=0) / np.sqrt(runs)
    assert np.all(np.mean(squares, axis=0) < expected + error)
    assert np.all(np.mean(squares, axis=0) > 2.0 / 3.0 * expected - error)


@pytest.mark.parametrize("correlation", [0.0, 0.95])
def test_significance_holds_its_level(correlation: float) -> None:
    rng = np.random.default_rng(7)
    n, runs, level = 600, 300, 0.05
    time = np.arange(n) / n
    columns = np.column_stack([np.ones(n), np.sin(40 * time)])
    further = np.column_stack([np.cos(25 * time), np.sin(90 * time)])
    rejected = 0
    for _ in range(runs):
        noise = rng.standard_normal(n)
        for k in range(1, n):
            noise[k] += correlation * noise[k - 1]
        basis = Basis.of(columns, noise)
        partial = basis.partial(further)
        assert partial is not None
        rejected += significance(basis, partial) < level
    # The larger of two p-values is conservative; the upper bound is four binomial deviations
    assert rejected / runs < level + 4.0 * np.sqrt(level * (1 - level) / runs)
