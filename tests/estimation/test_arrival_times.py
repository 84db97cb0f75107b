"""Time stamps of arrival, on a motion in closed form that is sampled evenly or not."""

from dataclasses import replace

import numpy as np
import pytest
from axis_logs import axis_log
from jaxtyping import Float
from two_sines import Motion

from stickslip.estimation import SelectedModelEstimator
from stickslip.estimation.prepare import prepare
from stickslip.records import AxisLog, Status

PERIOD = 0.01
EVEN = PERIOD * np.arange(3000.0)
TRUTH = {"mass": 3.0, "viscous_friction": 4.0, "coulomb_friction": 1.5}


def log_of(
    taken: Float[np.ndarray, " n"], stamps: Float[np.ndarray, " n"], resolution: float = 1e-7
) -> AxisLog:
    """Return samples taken at some times, with time stamps of their own."""
    motion = Motion(time=taken)
    effort = motion.effort() + 0.02 * np.random.default_rng(1).standard_normal(taken.size)
    return axis_log(stamps, effort, resolution * np.round(motion.position / resolution))


def jitter(share: float = 0.1) -> Float[np.ndarray, " n"]:
    """Return deviations of the time stamps, a share of the period and twice that at most [s]."""
    noise = np.random.default_rng(2).standard_normal(EVEN.size)
    return share * PERIOD * np.clip(noise, -2.0, 2.0)


def grouped(size: int) -> Float[np.ndarray, " n"]:
    """Return the time stamps of records that arrive in groups [s]."""
    record = np.arange(EVEN.size)
    last = np.minimum(record // size * size + size - 1, record[-1])
    return EVEN[last] + 5e-5 * (record % size)


def arrival_notes(log: AxisLog) -> list[str]:
    return [note for note in prepare(log).notes if "as times of arrival do" in note]


def assert_parameters(log: AxisLog) -> None:
    estimate = SelectedModelEstimator(effort_kind="sampled").fit(log)
    assert estimate.status is Status.OK
    for name, value in TRUTH.items():
        parameter = estimate.parameters[name]
        assert parameter.std is not None
        # 12 values: 4 standard errors are passed once in 1300 such tests
        assert abs(estimate.value(name) - value) < 4.0 * parameter.std + 2e-3 * value


@pytest.mark.parametrize(
    "stamps",
    [EVEN + jitter(), EVEN + jitter(0.2), grouped(4), grouped(10)],
    ids=["jitter", "more jitter", "groups of 4", "groups of 10"],
)
def test_even_samples_with_stamps_of_arrival(stamps: Float[np.ndarray, " n"]) -> None:
    log = log_of(EVEN, stamps)
    assert arrival_notes(log)
    np.testing.assert_allclose(np.diff(prepare(log).log.time), PERIOD, rtol=1e-4)
    assert_parameters(log)


def test_true_time_stamps_are_kept() -> None:
    taken = EVEN + jitter()
    log = log_of(taken, taken)
    assert not arrival_notes(log)
    np.testing.assert_array_equal(prepare(log).log.time, taken)


@pytest.mark.parametrize(("lasting", "even"), [(1, True), (50, False)])
def test_time_stamps_whose_deviations_add_up_are_kept(lasting: int, even: bool) -> None:
    """Steps of 4 and 10 ms, each for so many samples: a delay of arrival does not last."""
    states = np.random.default_rng(4).random(EVEN.size // lasting) < 0.5
    stamps = np.cumsum(np.repeat(np.where(states, 0.004, 0.010), lasting))
    assert bool(arrival_notes(log_of(EVEN[: stamps.size] * 0.7, stamps))) is even


def test_coarse_positions_keep_the_time_stamps() -> None:
    """A jitter of 0.1 ms moves the axis by 10 µm, a hundredth of the resolution."""
    log = log_of(EVEN, EVEN + jitter(0.01), resolution=1e-3)
    assert not arrival_notes(log)
    np.testing.assert_array_equal(prepare(log).log.time, log.time)


def test_gaps_are_kept() -> None:
    kept = np.ones(EVEN.size, dtype=bool)
    kept[1000:1300] = False
    log = log_of(EVEN[kept], (EVEN + jitter())[kept])
    assert arrival_notes(log)
    found = prepare(log).log
    np.testing.assert_allclose(found.time[1000] - found.time[999], 301 * PERIOD, rtol=1e-3)


def test_an_angle_that_wraps() -> None:
    log = log_of(EVEN, EVEN + jitter())
    angle = np.mod(300.0 * log.measured_position, 2 * np.pi)
    assert arrival_notes(replace(log, kind="rotary", measured_position=angle))


def test_records_lost_on_the_way() -> None:
    """The period is that of the motion: 1 % of the records is lost, at rest too."""
    rest = np.arange(EVEN.size) > 2000
    taken = np.where(rest, EVEN[2000], EVEN)
    kept = np.random.default_rng(3).random(EVEN.size) > 0.01
    log = log_of(taken[kept], (EVEN + jitter())[kept])
    time = prepare(log).log.time
    assert np.median(np.diff(time)) == pytest.approx(PERIOD, rel=1e-3)
    # Some 20 records are lost until then; a few of them in slow motion, where nothing shows it
    assert time[1900] - time[0] == pytest.approx(EVEN[kept][1900] - EVEN[0], abs=3 * PERIOD)


def test_lost_records_beside_a_gap() -> None:
    kept = np.random.default_rng(3).random(EVEN.size) > 0.01
    kept[1000:1100] = False
    log = log_of(EVEN[kept], (EVEN + jitter())[kept])
    assert arrival_notes(log)
    np.testing.assert_allclose(prepare(log).log.time, EVEN[kept], atol=3 * PERIOD)
    assert SelectedModelEstimator().fit(log).value("mass") == pytest.approx(TRUTH["mass"], rel=0.01)


def test_many_gaps_keep_the_time_stamps() -> None:
    """Each span that measures the period has a gap, which even times would close."""
    kept = np.arange(EVEN.size) % 120 < 80
    log = log_of(EVEN[kept], (EVEN + jitter())[kept])
    assert not arrival_notes(log)


def test_two_gaps_beside_each_other_are_kept() -> None:
    kept = np.ones(EVEN.size, dtype=bool)
    kept[1000:1040] = kept[1100:1130] = False
    log = log_of(EVEN[kept], (EVEN + jitter())[kept])
    np.testing.assert_allclose(prepare(log).log.time, EVEN[kept], atol=PERIOD)


def test_one_record_for_each_change_of_the_position() -> None:
    """Positions are then even over the number of the record, whenever they were taken."""
    fine = np.arange(0.0, 30.0, 1e-5)
    changed = np.flatnonzero(np.diff(np.floor(Motion(time=fine).position / 1e-3))) + 1
    log = log_of(fine[changed], fine[changed])
    assert not arrival_notes(log)
