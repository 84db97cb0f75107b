"""Records that are lost while the time stamps are counted: a motion in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from axis_logs import axis_log
from jaxtyping import Bool, Float
from two_sines import Motion

from stickslip.estimation import SelectedModelEstimator
from stickslip.estimation.prepare import prepare
from stickslip.records import AxisLog, Status

TIME = np.arange(0.0, 10.0, 1e-3)
TRUTH = {"mass": 3.0, "viscous_friction": 4.0, "coulomb_friction": 1.5}


def log_of(kept: Bool[np.ndarray, " n"], position_noise: float = 0.0) -> AxisLog:
    """Return the records that are kept, with time stamps that are counted."""
    rng = np.random.default_rng(1)
    effort = Motion(time=TIME + 0.5e-3).effort() + 0.02 * rng.standard_normal(TIME.size)
    position = Motion(time=TIME).position + position_noise * rng.standard_normal(TIME.size)
    return axis_log(TIME[: int(kept.sum())], effort[kept], position[kept])


def without(places: int, records: int) -> Bool[np.ndarray, " n"]:
    """Return which records are kept if some are lost in each of several places in fast motion."""
    fast = np.flatnonzero(np.abs(Motion(time=TIME).velocity) > 0.05)
    kept = np.ones(TIME.size, dtype=bool)
    for start in fast[np.linspace(50, fast.size - 50, places).astype(int)]:
        kept[start : start + records] = False
    return kept


def lost(log: AxisLog) -> list[str]:
    return [note for note in prepare(log).notes if "missing in" in note]


@pytest.mark.parametrize("records", [1, 3, 10])
def test_the_time_of_lost_records_is_found(records: int) -> None:
    kept = without(12, records)
    log = log_of(kept)
    found = prepare(log).log
    np.testing.assert_allclose(found.time, TIME[kept], atol=1e-9)
    assert lost(log)[0].startswith(f"{12 * records} records missing in 12 places")
    estimate = SelectedModelEstimator().fit(log)
    assert estimate.status is Status.OK
    for name, value in TRUTH.items():
        parameter = estimate.parameters[name]
        assert parameter.std is not None
        # 9 values: 4 standard errors are passed once in 1700 such tests
        assert abs(estimate.value(name) - value) < 4.0 * parameter.std + 1e-3 * value


def test_a_few_lost_records_are_not_detected() -> None:
    assert not lost(log_of(without(3, 1)))
    assert lost(log_of(without(4, 1)))


def test_noise_hides_lost_records() -> None:
    """A step of 0.1 mm and more is doubled; noise of 20 µm makes that uncertain."""
    assert lost(log_of(without(12, 1), position_noise=1e-6))
    assert not lost(log_of(without(12, 1), position_noise=2e-5))


@pytest.mark.parametrize("every", [1, 2])
def test_stale_positions_are_no_lost_records(every: int) -> None:
    """A stale position is followed by a step of twice the size, and no time is lost."""
    log = log_of(np.ones(TIME.size, dtype=bool))
    index = np.arange(TIME.size)
    stale = np.zeros(TIME.size, dtype=bool)
    stale[index % 2 == 1 if every == 2 else ~without(20, 1)] = True
    position: Float[np.ndarray, " n"] = log.measured_position[np.where(stale, index - 1, index)]
    assert not lost(replace(log, measured_position=position))


def test_measured_time_stamps_are_kept() -> None:
    kept = without(12, 1)
    log = replace(log_of(kept), time=TIME[kept])
    assert not lost(log)
