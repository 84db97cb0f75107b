"""Repairs of a log that every offline estimator gets."""

import re
from dataclasses import replace

import numpy as np
import pytest
from refusals import refuses

from stickslip.estimation import SelectedModelEstimator
from stickslip.estimation.prepare import RepairedLog, prepare, repaired, with_common_times
from stickslip.estimation.weak_form.motion import MotionTuning, slip_motions
from stickslip.estimation.weak_form.windows import Weight, convolved
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import AxisLog
from stickslip.simulation import Sensors, simulate

T = 0.001
TIME = T * np.arange(2000)
TRUE = 3.5 * np.sin(2.0 * TIME)
"""Position; its range is more than one turn."""


def log_of(position: np.ndarray, *, velocity: bool = False, load: bool = False) -> AxisLog:
    speed = 7.0 * np.cos(2.0 * TIME)
    return AxisLog(
        name="axis",
        kind="rotary",
        time=TIME,
        effort=4.0 * np.sin(5.0 * TIME) + 0.01 * np.random.default_rng(0).normal(size=TIME.size),
        measured_position=position,
        measured_velocity=speed if velocity else None,
        measured_load_position=position + 0.01 * np.cos(30.0 * TIME) if load else None,
        measured_load_velocity=speed if velocity and load else None,
    )


def signals(log: AxisLog) -> list[np.ndarray]:
    names = ("time", "effort", "measured_position", "measured_velocity", "measured_load_position")
    values = [getattr(log, name) for name in names]
    return [value for value in values if value is not None]


@pytest.mark.parametrize("load", [False, True])
def test_a_log_without_defects_keeps_its_samples(load: bool) -> None:
    log = log_of(TRUE, velocity=True, load=load)
    found = repaired(log)
    assert found.notes == ()
    assert not found.clipped
    for before, after in zip(signals(log), signals(found), strict=True):
        np.testing.assert_array_equal(before, after)
    assert repaired(found) is found
    assert isinstance(found.part(0, 100), RepairedLog)


@pytest.mark.parametrize("samples", [4, 19])
def test_a_log_without_a_part_is_refused(samples: int) -> None:
    whole = log_of(TRUE)
    assert prepare(whole.part(0, 20)).with_parts().parts
    with refuses("no_stretch", samples=samples, least=20):
        prepare(whole.part(0, samples)).with_parts()


@pytest.mark.parametrize("load", [False, True])
@pytest.mark.parametrize("period", [2.0 * np.pi, 360.0, 1.0])
def test_wrapped_angles_are_continued(period: float, load: bool) -> None:
    scale = period / (2.0 * np.pi)
    log = log_of(scale * TRUE, load=load)
    turned = {"measured_position": np.mod(log.measured_position, period)}
    if log.measured_load_position is not None:
        turned["measured_load_position"] = np.mod(log.measured_load_position, period)
    found = repaired(replace(log, **turned))
    np.testing.assert_allclose(found.measured_position, log.measured_position, atol=1e-9 * period)
    if log.measured_load_position is not None:
        assert found.measured_load_position is not None
        np.testing.assert_allclose(
            found.measured_load_position, log.measured_load_position, atol=1e-9 * period
        )
    assert sum("unwrapped" in note for note in found.notes) == 1 + load


@pytest.mark.parametrize(
    "name", ["measured_position", "measured_velocity", "measured_load_position"]
)
def test_a_glitch_is_replaced_by_its_neighbours(name: str) -> None:
    log = log_of(TRUE, velocity=True, load=True)
    values = getattr(log, name).copy()
    values[700:702] += 50.0
    found = repaired(replace(log, **{name: values}))
    expected = np.interp(TIME[700:702], TIME[[699, 702]], values[[699, 702]])
    np.testing.assert_allclose(getattr(found, name)[700:702], expected, rtol=1e-12)
    assert found.notes == (
        f"2 samples of the {name.removeprefix('measured_').replace('_', ' ')} excluded as glitches",
    )


def test_a_log_shorter_than_a_dropout_keeps_its_samples() -> None:
    """At 1 MHz the longest dropout has 10 000 samples, more than the log."""
    log = replace(log_of(TRUE, velocity=True), time=1e-3 * TIME)
    found = repaired(log)
    assert found.notes == ()
    np.testing.assert_array_equal(found.measured_position, log.measured_position)


def test_steps_of_an_encoder_velocity_at_low_speed_are_no_glitches() -> None:
    """Of 40 samples 39 are zero, and one is a count."""
    counts = np.floor(TIME / (40.0 * T)) * 1e-3
    log = replace(log_of(counts), measured_velocity=np.diff(counts, prepend=0.0) / T, kind="linear")
    found = repaired(log)
    assert found.notes == ()
    np.testing.assert_array_equal(found.measured_velocity, log.measured_velocity)


def test_an_encoder_that_is_homed_again_is_continued() -> None:
    found = repaired(log_of(TRUE + 0.4 * (TIME > 1.2)))
    np.testing.assert_allclose(found.measured_position, TRUE, atol=2e-3)
    assert "position jumps in 1 place" in found.notes[0]


def test_the_first_step_of_an_encoder_is_no_jump() -> None:
    log = replace(log_of(1e-4 * (TIME > 1.2)), kind="linear")
    np.testing.assert_array_equal(repaired(log).measured_position, log.measured_position)


def test_an_axis_may_move_in_a_gap() -> None:
    log = log_of(TRUE + 0.4 * (TIME > 1.2))
    gapped = replace(log, time=TIME + 10.0 * (TIME > 1.2))
    np.testing.assert_array_equal(repaired(gapped).measured_position, log.measured_position)


def test_clipped_efforts_are_kept_and_named() -> None:
    log = log_of(TRUE)
    limited = replace(log, effort=np.clip(log.effort, -3.8, 3.8))
    found = repaired(limited)
    np.testing.assert_array_equal(found.effort, limited.effort)
    assert found.clipped
    assert len(found.notes) == 2
    assert all("clipped at" in note and "taken as they are" in note for note in found.notes)


def test_uneven_time_stamps_are_evened_out() -> None:
    uneven = TIME + 0.2 * T * np.random.default_rng(1).uniform(-1.0, 1.0, TIME.size)
    log = replace(log_of(3.5 * np.sin(2.0 * uneven)), time=uneven)
    found = repaired(log)
    assert found.timing_jitter < 1e-9
    np.testing.assert_allclose(found.measured_position, 3.5 * np.sin(2.0 * found.time), atol=1e-9)
    assert "resampled" in found.notes[0]


def noisy_velocity_log(seed: int) -> tuple[AxisLog, np.ndarray]:
    """Return 4 s of an axis of 1.5 kg with noisy positions and velocities, and its positions."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=2.0, viscous_friction=3.0)
    t = 0.002 * np.arange(2000)
    effort = 4.0 * np.sin(2.0 * np.pi * 0.5 * t) + 3.0 * np.sin(2.0 * np.pi * 1.3 * t)
    motion = simulate(SingleMass(mass=1.5, friction=law), effort, sampling_time=0.002)
    sensors = Sensors(position_noise=1e-4, velocity_noise=0.01)
    true = Sensors().measure(motion).measured_position
    return sensors.measure(motion, np.random.default_rng(seed)), true


def test_noise_of_fused_positions_is_correlated_as_stated() -> None:
    weight = Weight(half_width=25, sampling_time=0.002)
    log, true = noisy_velocity_log(0)
    found = slip_motions(prepare(log), MotionTuning())
    sums, lagged, squares = [], [], []
    for seed in range(20):
        prepared = prepare(noisy_velocity_log(seed)[0])
        error = prepared.parts[0].position - true
        sums.append(convolved(error, weight.second())[50:-50])
        lagged.append(float(np.mean(error[1:] * error[:-1])))
        squares.append(float(np.mean(error**2)))
    # Steps are means of two velocities, which share noise: their neighbours are closer than stated
    assert found.noise_correlation == pytest.approx(np.mean(lagged) / np.mean(squares), abs=0.1)
    spread = float(np.sqrt(np.mean(np.square(sums))))
    assert found.noise_of(weight.second()) == pytest.approx(spread, rel=0.15)
    white = prepare(replace(log, measured_velocity=None))
    assert white.noise_correlation == 0.0


def test_windows_are_wide_where_noise_of_positions_is_all_there_is() -> None:
    errors = []
    for seed in range(6):
        estimate = SelectedModelEstimator().fit(noisy_velocity_log(seed)[0])
        errors.append([estimate.value("mass") - 1.5, estimate.value("viscous_friction") - 3.0])
    # Windows of 25 samples have a bias of the mass of -0.0022 kg; RMSE of viscous friction 0.006
    assert abs(float(np.mean(errors, axis=0)[0])) < 0.0008
    assert float(np.sqrt(np.mean(np.square(errors), axis=0))[1]) < 0.0045


@pytest.mark.parametrize("bits", [12, 13])
def test_a_register_that_begins_again_many_times_is_continued(bits: int) -> None:
    """Counts of 1e-4 rad: 134 or 67 wraps of equal size, to either side."""
    size = 1e-4 * 2**bits
    position = 20.0 * TRUE / 3.5
    found = repaired(log_of(np.mod(position, size)))
    difference = found.measured_position - position
    np.testing.assert_allclose(difference, difference[0], atol=1e-5)
    assert "position jumps in" in found.notes[0]


def test_many_steps_of_different_sizes_are_motion() -> None:
    sizes = np.random.default_rng(2).uniform(0.5, 1.0, 30)
    steps = np.sum(sizes * (TIME[:, None] > 0.05 * np.arange(1, 31)), axis=1)
    log = replace(log_of(steps), kind="linear")
    np.testing.assert_array_equal(repaired(log).measured_position, log.measured_position)


@pytest.mark.parametrize("gap", [1e-6, 1e-9])
def test_a_time_stamp_next_to_another_is_left_out(gap: float) -> None:
    stamps = TIME.copy()
    stamps[700] = stamps[701] - gap
    found = repaired(replace(log_of(TRUE), time=stamps))
    assert "1 time stamp less than" in found.notes[0]
    inside = np.abs(found.time - TIME[700]) > 2.5 * T
    np.testing.assert_allclose(
        found.measured_position[inside], 3.5 * np.sin(2.0 * found.time[inside]), atol=2e-5
    )


@pytest.mark.parametrize("scale", [0.5, 1.0, 2.0])
def test_a_velocity_that_is_not_used_is_noted_with_its_scale_and_delay(scale: float) -> None:
    rng = np.random.default_rng(3)
    late = 7.0 * np.cos(2.0 * (TIME - 0.003))
    log = replace(
        log_of(TRUE + 1e-5 * rng.normal(size=TIME.size)),
        measured_velocity=scale * late + 1e-4 * rng.normal(size=TIME.size),
    )
    (note,) = (each for each in prepare(log).notes if each.startswith("the measured velocity"))
    found = re.search(r"is (\S+) times .* and (\S+) ms behind the position", note)
    assert found is not None
    assert float(found[1]) == pytest.approx(scale, rel=1e-3)
    assert float(found[2]) == pytest.approx(3.0, rel=0.05)


@pytest.mark.parametrize("wrapped", [False, True])
def test_an_axis_at_rest_has_the_even_times_that_another_axis_shows(wrapped: bool) -> None:
    record = np.arange(TIME.size)
    stamps = TIME[np.minimum(record // 5 * 5 + 4, record[-1])] + 2e-6 * (record % 5)
    turns = 160.0 * np.sin(4.0 * TIME)  # a jump in one of 16 samples
    moving = turns % (2.0 * np.pi) if wrapped else turns
    logs = {
        name: replace(log_of(position), name=name, time=stamps)
        for name, position in {"moving": moving, "resting": np.zeros(TIME.size)}.items()
    }
    found = with_common_times(logs)
    np.testing.assert_array_equal(found["moving"].time, stamps)
    assert np.ptp(np.diff(found["resting"].time)) < 1e-9
