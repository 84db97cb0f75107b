"""Clipped efforts, glitches, dropouts, wraps and jumps in the log of an axis."""

from dataclasses import replace

import numpy as np
import pytest
from axis_logs import axis_log
from two_sines import TIME, Motion, log_of

from stickslip.estimation import SelectedModelEstimator
from stickslip.estimation.prepare import prepare
from stickslip.estimation.weak_form.motion import MotionTuning, slip_motions
from stickslip.records import AxisLog, Status

EXACT = 1e-9
"""Relative; what sums of some hundred terms leave of double precision."""


def test_a_jump_of_the_encoder_is_no_wrong_unit() -> None:
    log = log_of()
    jumped = log.measured_position + 0.0655 * (TIME > 8.0)
    found = SelectedModelEstimator().fit(replace(log, measured_position=jumped))
    assert found.status is Status.OK
    assert found.value("mass") == pytest.approx(3.0, rel=0.01)


def test_clipped_effort_is_excluded() -> None:
    log = log_of()
    clipped = replace(log, effort=np.clip(log.effort, -2.2, 2.2))
    estimate = SelectedModelEstimator().fit(clipped)
    assert sum("clipped" in note for note in estimate.diagnostics.notes) == 2
    assert estimate.value("mass") == pytest.approx(3.0, rel=0.01)


def test_switched_input_is_not_taken_for_clipped() -> None:
    log = log_of(noise=0.0)
    assert prepare(replace(log, effort=np.sign(log.effort))).clipped == 0


def test_an_effort_mostly_at_its_extremes_is_kept_and_named() -> None:
    log = log_of()
    found = prepare(replace(log, effort=np.clip(log.effort, -1.0, 1.0)))
    assert found.clipped == 0
    assert any("a square wave, or clipped" in note for note in found.notes)


def test_wrapped_angle_is_continued() -> None:
    log = replace(log_of(noise=0.0), kind="rotary")
    turned = replace(log, measured_position=100.0 * log.measured_position)
    wrapped = replace(turned, measured_position=np.mod(turned.measured_position, 2 * np.pi))
    prepared = prepare(wrapped)
    moved = np.concatenate([part.position for part in prepared.parts])
    travel = moved - moved[0] - (turned.measured_position - turned.measured_position[0])
    assert np.max(np.abs(travel)) < EXACT * 100.0
    assert any("unwrapped" in note for note in prepared.notes)


def test_glitches_are_interpolated_and_excluded() -> None:
    log = log_of()
    position, effort = log.measured_position.copy(), log.effort.copy()
    position[[3000, 9000, 9001]] += 1.0
    effort[[5000, 12345]] = 500.0
    prepared = prepare(replace(log, measured_position=position, effort=effort))
    assert prepared.repaired == 5
    assert not np.any(prepared.parts[0].usable[[3000, 5000, 9000, 9001, 12345]])
    assert np.max(np.abs(prepared.parts[0].position - log.measured_position)) < 1e-6


def test_noise_is_not_taken_for_glitches() -> None:
    assert prepare(log_of(noise=0.5)).repaired == 0


def turning(period: float = 2.0 * np.pi) -> AxisLog:
    """Return the log of a rotary axis that turns several times, in units of its period."""
    log = log_of()
    angle = 20.0 * Motion(time=TIME).position * period
    return replace(log, kind="rotary", measured_position=angle)


@pytest.mark.parametrize("period", [360.0, 1.0])
def test_wrap_at_another_period_is_a_mismatch_of_units(period: float) -> None:
    log = turning(period)
    wrapped = replace(log, measured_position=np.mod(log.measured_position, period))
    estimate = SelectedModelEstimator().fit(wrapped)
    assert estimate.status is Status.MODEL_MISMATCH
    assert f"wraps every {period:g}" in estimate.diagnostics.notes[0]


def test_wrapped_angle_with_glitches_is_continued() -> None:
    log = turning()
    wrapped = np.mod(log.measured_position, 2.0 * np.pi)
    wrapped[[2000, 7000, 11111]] = 0.0
    prepared = prepare(replace(log, measured_position=wrapped))
    good = prepared.parts[0].usable
    off = prepared.parts[0].position - log.measured_position
    assert np.ptp(off[good]) < 1e-9
    assert np.sum(~good) >= 2  # one of the three may be at its place


def test_position_homed_again_is_continued() -> None:
    log = log_of()
    moved = log.measured_position + 0.5 * (TIME > 6.0) - 0.3 * (TIME > 13.0)
    estimate = SelectedModelEstimator().fit(replace(log, measured_position=moved))
    assert estimate.status is Status.OK
    assert "position jumps in 2 places" in " ".join(estimate.diagnostics.notes)
    assert estimate.value("mass") == pytest.approx(3.0, rel=0.01)


def test_dropouts_of_the_effort_are_excluded() -> None:
    log = log_of()
    effort = log.effort.copy()
    for k in range(500, 19_500, 490):
        effort[k : k + 5] = 0.0
    estimate = SelectedModelEstimator().fit(replace(log, effort=effort))
    mass = estimate.parameters["mass"]
    assert mass.ci95 is not None
    assert mass.ci95[0] < 3.0 < mass.ci95[1]


def test_pulse_that_moves_the_axis_is_no_glitch() -> None:
    effort = np.zeros(4000)
    effort[1000:1002] = effort[3000:3002] = 600.0
    velocity = np.maximum(np.cumsum(effort) * 1e-3 / 2.0 - np.cumsum(effort > -1) * 0.0, 0.0)
    log = axis_log(1e-3 * np.arange(4000), effort, np.cumsum(velocity) * 1e-3)
    assert prepare(log).repaired == 0


def test_jitter_of_the_clock_is_seen_in_the_noise_of_the_motion() -> None:
    rng = np.random.default_rng(11)
    jitter = 1e-4
    log = replace(
        log_of(noise=0.0),
        measured_position=Motion(time=TIME + jitter * rng.standard_normal(TIME.size)).position,
    )
    noise = slip_motions(prepare(log), MotionTuning()).position_noise
    speed = np.sqrt(np.mean(Motion(time=TIME).velocity ** 2))
    assert noise == pytest.approx(jitter * speed, rel=0.5)
