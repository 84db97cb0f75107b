"""The study of joint fits, reduced: coverage, false alarms and power on an independent plant."""

import numpy as np
import pytest
from scipy.stats import binom

from stickslip.records import Status
from studies.joint import Outcome, outcome_of, table

pytestmark = pytest.mark.slow

CHANCE = 1e-3
"""Probability with which a bound below is passed although the rate is as claimed."""

COVERAGE, FALSE_ALARMS, DETECTED = 0.93, 0.01, 0.95
SETS, DIFFERENT_SETS = 12, 4


def most(count: int, rate: float) -> int:
    """Return the count that is passed with the probability `CHANCE` at a given rate."""
    return int(binom.ppf(1.0 - CHANCE, count, rate))


@pytest.fixture(scope="module")
def same() -> list[Outcome]:
    return [outcome_of(seed) for seed in range(SETS)]


@pytest.fixture(scope="module")
def different() -> list[Outcome]:
    return [outcome_of(seed, more_coulomb=0.1) for seed in range(DIFFERENT_SETS)]


def test_intervals_hold_and_shrink(same: list[Outcome]) -> None:
    inside = [each for run in same for each in run.inside]
    assert None not in inside
    outside = len(inside) - sum(map(bool, inside))
    assert outside <= most(len(inside), 1.0 - COVERAGE)
    # Beside the best combination of single fits; delays that single logs do not show widen those
    ratios = np.array([run.std_ratio for run in same])
    assert 0.5 < np.nanmedian(ratios) < 1.25


def test_consistent_logs_are_called_so(same: list[Outcome]) -> None:
    alarms = sum(bool(run.named) for run in same)
    assert alarms <= most(SETS, FALSE_ALARMS)
    assert sum(run.status is not Status.OK for run in same) <= most(SETS, 0.05)


def test_delays_are_those_of_each_log(same: list[Outcome]) -> None:
    estimated = sum(run.delays for run in same)
    assert estimated > 0
    outside = estimated - sum(run.delays_inside for run in same)
    assert outside <= most(estimated, 1.0 - COVERAGE)


def test_more_coulomb_friction_in_one_log_is_named(different: list[Outcome]) -> None:
    named = sum(run.named == ("noon", "coulomb_friction") for run in different)
    assert DIFFERENT_SETS - named <= most(DIFFERENT_SETS, 1.0 - DETECTED)
    assert all(run.status is Status.MODEL_MISMATCH for run in different if run.named)
    assert np.median([run.difference for run in different]) == pytest.approx(0.1, abs=0.03)


def test_the_table_has_the_rates(same: list[Outcome], different: list[Outcome]) -> None:
    lines = table(same, different).splitlines()
    assert f"| sets with equal friction | {SETS} |" in lines
    named = sum(run.named == ("noon", "coulomb_friction") for run in different)
    row = next(line for line in lines if "named first" in line)
    assert f"| {100 * named / DIFFERENT_SETS:.1f} [" in row
