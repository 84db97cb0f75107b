"""Rows of windows: their groups, their shifts by a sample, and what follows from few of them."""

import numpy as np
import pytest
from axis_logs import axis_log

from stickslip.estimation.selection import estimator
from stickslip.estimation.selection.estimator import SelectedModelEstimator
from stickslip.estimation.selection.judgement.plausibility import untested
from stickslip.estimation.selection.model import Model
from stickslip.estimation.weak_form.motion import SlipMotion
from stickslip.estimation.weak_form.rows import window_rows
from stickslip.estimation.weak_form.windows import Weight
from stickslip.records import AxisLog, Status

T = 1e-3
WEIGHT = Weight(half_width=10, sampling_time=T)


def _motion(position, direction) -> SlipMotion:
    count = len(position)
    return SlipMotion(
        time=T * np.arange(count),
        effort=np.zeros(count),
        position=np.asarray(position, dtype=float),
        velocity=np.gradient(position, T),
        direction=np.asarray(direction, dtype=np.int64),
        travelled=np.zeros(count),
        model_effort=np.zeros(count),
        usable=np.ones(count, dtype=bool),
    )


def _to_and_fro(moves: int) -> SlipMotion:
    """Return moves of 300 samples in alternating directions, with rests between them."""
    direction = np.concatenate([[0] * 20 + [(-1) ** k] * 300 for k in range(moves)])
    return _motion(T * np.cumsum(direction), direction)


@pytest.mark.parametrize(("moves", "groups"), [(1, 4), (2, 4), (3, 6), (4, 4), (7, 7)])
def test_few_moves_are_left_out_in_equal_parts(moves, groups):
    rows = window_rows([_to_and_fro(moves)], WEIGHT)
    assert rows.moves == moves
    assert np.all(np.diff(rows.folds) >= 0)
    sizes = np.bincount(rows.folds)
    assert sizes.size == groups
    assert np.ptp(sizes) <= 1
    for group in range(groups):  # no group reaches over two moves
        assert np.unique(rows.move[rows.folds == group]).size == 1


def test_windows_that_move_by_a_sample_see_the_motion_a_sample_later():
    time = T * np.arange(600)
    rows = window_rows([_motion(time**3, np.ones(600))], WEIGHT)
    for samples in (-1, 1):
        moved = rows.moved(samples)
        # The weight is even: means of a straight line are its values in the middle
        np.testing.assert_allclose(moved.acceleration, 6.0 * (rows.time + samples * T), rtol=1e-6)
        np.testing.assert_allclose(moved.time, rows.time + samples * T, rtol=1e-12)


def _log(seed: int, *, duration: float) -> AxisLog:
    """Return a multisine with exact motion and noise of the effort."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, duration, T)
    phase = rng.uniform(0.0, 2.0 * np.pi)
    angular = np.array([2.0, 5.0])
    size = np.array([0.1, 0.05])
    turns = angular[:, None] * time + np.array([[phase], [0.0]])
    velocity = size @ np.sin(turns)
    position = -(size / angular) @ np.cos(turns)
    acceleration = (size * angular) @ np.cos(turns)
    effort = 3.0 * acceleration + 1.5 * np.sign(velocity) + 4.0 * velocity
    return axis_log(time, effort + 0.05 * rng.standard_normal(time.size), position)


@pytest.mark.parametrize(("samples", "few"), [(30, True), (120, False)])
def test_terms_are_tested_with_three_rows_a_column(samples, few):
    rows = window_rows([_motion(T * np.arange(samples) ** 2, np.ones(samples))], WEIGHT)
    assert (rows.size < 3 * 4) == few
    assert ("too few to test" in untested(Model(rows=rows, inertia=None))) == few


def test_log_too_short_to_test_a_term_has_insufficient_excitation(monkeypatch):
    monkeypatch.setattr(estimator, "untested", lambda _model: "too few windows")
    estimate = SelectedModelEstimator().fit(_log(0, duration=3.0))
    assert estimate.status is Status.INSUFFICIENT_EXCITATION
    assert estimate.diagnostics.notes[0] == "too few windows"
