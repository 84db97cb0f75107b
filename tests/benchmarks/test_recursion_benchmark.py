"""The comparison of recursions: all solve the same problem, and ours lasts."""

import json
import math

import pytest
from rich.progress import Progress

from benchmarks.recursion import compare_recursion, compare_rest, compare_samples

pytestmark = pytest.mark.slow

SAME = 1e-8
"""Relative: rounding times the condition of the rows, 1e5 at most. Found were 2e-13."""

AFTER_A_REST = 0.01
"""Relative: 50 rows of noise are remembered, 1e-3 of the size of a row each. Found was 1.3e-3."""

RESOLVED = {"published": 0.05, "energy, masses known": 0.001, "energy, driven mass sought": 0.03}
"""Error of the Coulomb friction [N] in one log, three times what was found or more."""


@pytest.fixture
def progress():
    return Progress(disable=True)


@pytest.mark.parametrize("parameters", [2, 4])
def test_all_end_at_the_least_squares_solution(progress, parameters):
    comparison = compare_recursion(progress, parameters, repetitions=1)
    assert len(comparison.rows) == 8
    assert sum(row.ours for row in comparison.rows) == 4
    for row in comparison.rows:
        assert row.nanoseconds > 0
        assert row.error < SAME, row.name


def test_only_ours_outlasts_a_rest(progress):
    comparison = compare_rest(progress, repetitions=1)
    for row in comparison.rows:
        assert row.error is not None
        if row.ours:
            assert row.error < AFTER_A_REST, row.name
        else:
            assert math.isnan(row.error), row.name
    record = json.loads(json.dumps(comparison.to_dict(), allow_nan=False))
    assert [row["error"] for row in record["rows"] if not row["ours"]] == ["nan"] * 3


def test_every_estimator_takes_the_samples(progress):
    rows = compare_samples(progress, repetitions=1).rows
    assert len(rows) == 6
    for name, bound in RESOLVED.items():
        compiled, stepped = (row.error for row in rows if row.name.startswith(name))
        assert compiled == stepped
        assert compiled < bound
