"""Windows of the weak form: their moments, and where they are whole."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from stickslip.estimation.weak_form.windows import Weight, convolved, whole_windows

EXACT = 1e-9
"""Relative; what sums of some hundred terms leave of double precision."""


@pytest.mark.parametrize("half_width", [3, 10, 47])
def test_windows_are_exact_on_polynomials(half_width: int) -> None:
    weight = Weight(half_width=half_width, sampling_time=0.01)
    t = 0.01 * np.arange(-weight.reach, weight.reach + 1)
    parabola, cubic, quartic = (
        Polynomial([1, 2, 3.0]),
        Polynomial([0.5, 2, -1, 40.0]),
        Polynomial([1, 2, 3.0, -4.0, 5e3]),
    )
    variance = (0.01 * half_width) ** 2 / 11.0  # int phi t^2 dt of the weight (1 - s^2)^4
    assert np.sum(weight.mean() * parabola(t)) == pytest.approx(1 + 3 * variance, rel=EXACT)
    assert np.sum(weight.first() * cubic(t)) == pytest.approx(2 + 120 * variance, rel=EXACT)
    assert np.sum(weight.second() * quartic(t)) == pytest.approx(6 + 6e4 * variance, rel=1e-7)
    assert np.sum(weight.fourth() * quartic(t)) == pytest.approx(24.0 * 5e3, rel=1e-6)
    assert np.sum(weight.fourth() * cubic(t)) == pytest.approx(0.0, abs=1e-2)


@pytest.mark.parametrize("delay", [0.0, 0.3, -2.4])
def test_held_effort_is_integrated_exactly(delay: float) -> None:
    weight = Weight(half_width=8, sampling_time=1.0, margin=4)
    taps = weight.effort(delay)
    assert np.sum(taps) == pytest.approx(1.0, rel=EXACT)
    # Against a fine sum of the weight over the time in which a sample's effort acts
    fine = (np.arange(200_000) + 0.5) / 200_000
    for k in (-3, 0, 5):
        s = (k + delay + fine) / 8.0
        density = np.where(np.abs(s) < 1, (1 - s**2) ** 4, 0.0) * 315.0 / 256.0 / 8.0
        assert taps[k + weight.reach] == pytest.approx(np.mean(density), abs=1e-10)


@pytest.mark.parametrize("delay", [0.0, 0.3, -2.4])
def test_sampled_effort_has_the_mean_of_what_acts(delay: float) -> None:
    weight = Weight(half_width=8, sampling_time=1.0, margin=4, lead=0.5)
    logged_at = np.arange(-weight.reach, weight.reach + 1)
    effort = 3.0 - 2.0 * (logged_at + delay) + 0.5 * (logged_at + delay) ** 2
    variance = 8.0**2 / 11.0  # int phi t^2 dt of the weight (1 - s^2)^4
    assert np.sum(weight.effort(delay) * effort) == pytest.approx(3 + 0.5 * variance, rel=EXACT)


@pytest.mark.parametrize("delay", [0.0, 0.3, -2.4])
def test_averaged_effort_has_the_mean_of_what_acts(delay: float) -> None:
    weight = Weight(half_width=8, sampling_time=1.0, margin=4, averaged=True)
    starts = np.arange(-weight.reach, weight.reach + 1) + delay
    # Of 3 - 2 t + t^2/2 from the start of a sample to the next
    mean = 3.0 - 2.0 * (starts + 0.5) + 0.5 * ((starts + 1.0) ** 3 - starts**3) / 3.0
    variance = 8.0**2 / 11.0
    assert np.sum(weight.effort(delay) * mean) == pytest.approx(3 + 0.5 * variance, rel=EXACT)


def test_convolution_is_a_correlation_with_zero_padding() -> None:
    rng = np.random.default_rng(3)
    values = rng.standard_normal(1000)
    for taps in (rng.standard_normal(21), rng.standard_normal(401)):
        expected = np.convolve(values, taps[::-1], mode="same")
        assert convolved(values, taps) == pytest.approx(expected, abs=1e-10)


def test_windows_hold_one_direction_and_usable_samples() -> None:
    direction = np.array([1] * 10 + [0] * 2 + [-1] * 10)
    usable = np.ones(22, dtype=bool)
    usable[15] = False
    marks = whole_windows(direction, usable, 2)
    for k in range(22):
        inside = direction[max(k - 2, 0) : k + 3]
        whole = inside.size == 5 and abs(inside.sum()) == 5 and usable[k - 2 : k + 3].all()
        assert marks[k] == whole
