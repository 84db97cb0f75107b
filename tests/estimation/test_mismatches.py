"""Logs that violate the model: wrong units, signs, delays and masses, and no motion."""

from dataclasses import replace

import numpy as np
import pytest
from axis_logs import axis_log
from slow_cases import quick_where
from two_sines import MIDDLE, TIME, Motion, log_of

from stickslip.estimation import SelectedModelEstimator
from stickslip.estimation.prepare import prepare
from stickslip.estimation.selection.judgement.plausibility import PlausibilityTuning
from stickslip.estimation.selection.search.tuning import SearchTuning
from stickslip.estimation.selection.search.windows import half_width
from stickslip.estimation.weak_form.motion import MotionTuning, slip_motions
from stickslip.records import LogSource, Status


@pytest.mark.slow
def test_wrong_known_mass_is_a_mismatch() -> None:
    estimate = SelectedModelEstimator(inertia=3.3).fit(log_of())
    assert estimate.status is Status.MODEL_MISMATCH
    assert "3.3 kg disagrees with the log" in estimate.diagnostics.notes[0]


def test_known_mass_within_its_tolerance_is_accepted() -> None:
    known = 3.0 * (1.0 + 0.5 * PlausibilityTuning().largest_inertia_error)
    assert SelectedModelEstimator(inertia=known).fit(log_of()).status is Status.OK


STATED = LogSource(files=("stage.csv",), sha256="")


ASSUMED = replace(STATED, assumed_units=(("position", "m"),))


@pytest.mark.parametrize("source", [None, STATED, ASSUMED])
@pytest.mark.parametrize("factor", [0.8, 1.25])
def test_units_are_a_mismatch_beyond_a_speed(source: LogSource | None, factor: float) -> None:
    log = log_of()
    top = float(np.max(np.abs(np.diff(log.measured_position)))) / log.sampling_time
    bounds = PlausibilityTuning()
    largest = bounds.largest_speed * (bounds.declared_ratio if source is STATED else 1.0)
    position = factor * largest / top * log.measured_position
    estimate = SelectedModelEstimator().fit(replace(log, measured_position=position, source=source))
    doubted = any("is the position in mm?" in note for note in estimate.diagnostics.notes)
    assert doubted == (factor > 1.0)
    assert (estimate.status is Status.MODEL_MISMATCH) == doubted


@pytest.mark.parametrize(("unit", "mismatch"), [(np.pi, False), (180.0, True)])
def test_degrees_are_seen_from_the_counts_of_the_encoder(unit: float, mismatch: bool) -> None:
    count = 2.0 * unit / 2**18
    angle = 4.0 / np.pi * unit * Motion(time=TIME).position
    log = axis_log(
        TIME, log_of().effort, count * np.rint(angle / count), name="servo", kind="rotary"
    )
    estimate = SelectedModelEstimator().fit(log)
    assert (estimate.status is Status.MODEL_MISMATCH) == mismatch


def test_sampling_too_slow_for_the_moves_is_named() -> None:
    log = log_of()
    slow = slice(None, None, 250)
    estimate = SelectedModelEstimator().fit(
        axis_log(log.time[slow], log.effort[slow], log.measured_position[slow])
    )
    assert not estimate.status.trusted


def test_unexplained_effort_is_a_mismatch() -> None:
    log = log_of()
    other = 1.5 * np.sin(3.3 * TIME) * np.sin(0.77 * TIME)
    estimate = SelectedModelEstimator().fit(replace(log, effort=log.effort + other))
    assert estimate.status is Status.MODEL_MISMATCH


@pytest.mark.parametrize("delay", quick_where(lambda delay: delay == 0.101, [0.101, 0.12]))
def test_a_delay_slightly_beyond_its_bound_is_a_mismatch(delay: float) -> None:
    assert SelectedModelEstimator().fit(log_of(delay=delay)).status is Status.MODEL_MISMATCH


@pytest.mark.slow
def test_delay_beyond_its_bound_is_a_mismatch() -> None:
    estimate = SelectedModelEstimator().fit(log_of(delay=0.15))
    assert estimate.status is not Status.OK


def test_log_at_rest_identifies_nothing() -> None:
    rng = np.random.default_rng(0)
    log = axis_log(TIME[:100], rng.standard_normal(100), 1e-6 * rng.standard_normal(100))
    estimate = SelectedModelEstimator().fit(log)
    assert not estimate.status.trusted
    assert all(not parameter.identified for parameter in estimate.parameters.values())


def test_coasting_log_identifies_nothing() -> None:
    time = 1e-3 * np.arange(1000)
    effort = np.zeros(1000)
    effort[0] = 1e-3
    log = axis_log(time, effort, 0.5 * time - 0.1 * time**2)
    assert not SelectedModelEstimator().fit(log).status.trusted


@pytest.mark.parametrize(
    ("mass", "status"),
    quick_where(
        lambda mass, _: mass is None, [(3.0, Status.MODEL_MISMATCH), (None, Status.UNPHYSICAL)]
    ),
)
def test_reversed_sign_is_named(mass: float | None, status: Status) -> None:
    log = log_of()
    estimate = SelectedModelEstimator(inertia=mass).fit(replace(log, effort=-log.effort))
    assert estimate.status is status
    assert "sign of the effort or of the position is reversed" in estimate.diagnostics.notes[0]


def test_windows_are_no_wider_than_a_log_in_a_wrong_unit_of_time() -> None:
    log = prepare(replace(log_of(), time=TIME / 86400.0))  # days taken for seconds
    half = half_width(slip_motions(log, MotionTuning()), log.sampling_time, SearchTuning())
    assert half <= TIME.size


def test_wrong_known_delay_is_a_mismatch() -> None:
    estimate = SelectedModelEstimator(effort_delay=0.01).fit(log_of())
    assert estimate.status is Status.MODEL_MISMATCH
    assert "effort delay of 10 ms disagrees" in estimate.diagnostics.notes[0]


def test_known_delay_that_is_right_is_accepted() -> None:
    estimate = SelectedModelEstimator(effort_delay=0.006).fit(log_of(delay=0.006))
    assert estimate.status is Status.OK


def test_milliseconds_read_as_seconds_are_a_mismatch() -> None:
    log = log_of()
    slow = replace(log, time=1e3 * log.time)
    estimate = SelectedModelEstimator().fit(slow)
    assert estimate.status is Status.MODEL_MISMATCH
    assert "is the time in ms?" in estimate.diagnostics.notes[0]


@pytest.mark.parametrize(("unit", "mismatch"), [(180.0 / np.pi, True), (1.0, False)])
def test_degrees_are_seen_from_a_force_that_repeats_with_the_turn(
    unit: float, mismatch: bool
) -> None:
    turns = Motion(time=MIDDLE).position * 300.0
    base = log_of()
    log = axis_log(
        base.time,
        base.effort + 0.6 * np.sin(turns),
        300.0 * base.measured_position * unit,
        name="servo",
        kind="rotary",
    )
    estimate = SelectedModelEstimator(exclude=("gravity",)).fit(log)
    assert ("is it in degrees?" in " ".join(estimate.diagnostics.notes)) is mismatch
