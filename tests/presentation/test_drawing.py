"""Thinned series show the same line."""

import numpy as np
import pytest

from stickslip.presentation.drawing import MOST_POINTS, thin, thinned_text

N = 400_001
TIME = np.arange(N) * 1e-3  # [s]
MOVES = ((50.05, 0.3, 1e-2), (200.7, 0.02, 1e-4), (333.333, 0.1, 2e-3))
"""When the axis moves, for how long and how far [s, s, m]: hours of rest for tenths of motion."""

OFF, OFF_IN_NOISE = 3e-3, 1.2e-2
"""Of the largest motion, by which the drawn line may be off: a pixel or two of a panel."""


def motion() -> np.ndarray:
    error = np.zeros(N)
    for begin, lasts, far in MOVES:
        share = np.clip((TIME - begin) / lasts, 0.0, 1.0)
        error += far * (1.0 - share) ** 2
    return error


def drawn(values: np.ndarray) -> np.ndarray:
    kept = thin(values)
    assert not isinstance(kept, slice)
    assert kept.size <= MOST_POINTS
    assert (kept[0], kept[-1]) == (0, values.size - 1)
    assert np.all(np.diff(kept) > 0)
    return np.interp(TIME, TIME[kept], values[kept])


def test_short_motions_in_long_rests_are_drawn_as_they_are() -> None:
    error = motion()
    np.testing.assert_allclose(drawn(error), error, rtol=0, atol=OFF * MOVES[0][2])


def test_noise_does_not_hide_a_motion() -> None:
    error = motion()
    noise = 1e-6
    noisy = error + np.random.default_rng(1).normal(0.0, noise, N)
    # Between the extremes of noise a line may run anywhere, within its 12 standard deviations
    atol = OFF_IN_NOISE * MOVES[0][2] + 12.0 * noise
    np.testing.assert_allclose(drawn(noisy), noisy, rtol=0, atol=atol)


def test_a_jump_is_a_jump() -> None:
    step = np.where(TIME < 123.4565, 0.0, 1.0)
    np.testing.assert_array_equal(drawn(step), step)


@pytest.mark.parametrize("values", [np.sin(20.0 * TIME), np.zeros(N), np.where(TIME > 9, 1.0, 0)])
def test_extremes_stay(values: np.ndarray) -> None:
    shown = values[thin(values)]
    assert (shown.min(), shown.max()) == (values.min(), values.max())


def test_gaps_stay() -> None:
    values = motion()
    values[1000:300_000] = np.nan
    values[N - 2] = np.inf
    kept = thin(values)
    gap = (TIME[kept] >= 1.0) & (TIME[kept] < 300.0)
    assert np.isnan(values[kept][gap]).all()
    assert gap.any()
    assert N - 2 in np.arange(N)[kept]
    assert np.arange(N)[thin(np.full(N, np.nan))].size <= MOST_POINTS


def test_what_is_short_enough_stays_whole() -> None:
    assert thin(np.zeros(MOST_POINTS)) == slice(None)
    assert thinned_text(MOST_POINTS) == ""
    assert f"Of {N} samples each line shows at most {MOST_POINTS}" in thinned_text(N)
