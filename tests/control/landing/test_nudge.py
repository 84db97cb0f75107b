"""A pulse on mass 1 alone, by the closed form of its way and by the geometry of a swing."""

from math import cos, sin

import pytest

from stickslip.control.landing.arm_belief import Swing
from stickslip.control.landing.tracked.nudge import moment, nudge, scaled
from stickslip.control.landing.tuning import TRACKING
from stickslip.planning import PulseLaw

MASS, COULOMB, T = 2.0, 0.5, 0.01
LAW = PulseLaw(mass=MASS, coulomb_friction=COULOMB, viscous_friction=0.0)


def way_of(effort: float, samples: int) -> float:
    """Return the way of a pulse against Coulomb friction: that with it, and that of coasting."""
    width = samples * T
    speed = (effort - COULOMB) / MASS * width
    return 0.5 * speed * width + 0.5 * speed**2 / (COULOMB / MASS)


def fired(error: float, frees: float, farthest: float = 0.0) -> tuple[int, float, float, bool]:
    return nudge(LAW, error, sampling_time=T, limits=(2.0, 2.5), frees=frees, farthest=farthest)


@pytest.mark.parametrize("error", [3e-3, -3e-3, 1e-4])
def test_it_goes_as_far_as_the_error(error: float) -> None:
    samples, effort, way, certain = fired(error, COULOMB)
    assert certain
    assert effort * error > 0.0
    assert way == pytest.approx(error, rel=1e-12)
    assert way_of(abs(effort), samples) == pytest.approx(abs(error), rel=1e-12)
    shorter = way_of(2.0, samples - 1) if samples > 1 else 0.0
    assert shorter < abs(error) <= way_of(2.0, samples)


def test_it_goes_farther_to_free_the_mass_but_not_by_much() -> None:
    error = 1e-5
    exact = fired(error, COULOMB)[1]
    frees = 1.02 * exact
    samples, effort, _, certain = fired(error, frees)
    assert (samples, effort, certain) == (1, pytest.approx(frees), True)
    samples, effort, way, certain = fired(error, 1.5)
    assert not certain
    assert way_of(effort, samples) == pytest.approx(1.7 * error, rel=1e-12)
    assert way == pytest.approx(1.7 * error, rel=1e-12)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_where_it_is_too_short_to_free_the_mass_it_leads_beyond_and_another_comes_back(
    side: float,
) -> None:
    error, frees = 1e-5, 1.5
    samples, effort, way, certain = fired(side * error, frees, farthest=1e-2)
    assert certain
    assert abs(effort) > frees
    assert way_of(abs(effort), samples) == pytest.approx(abs(way), rel=1e-12)
    left = side * error - way
    assert left * side < 0.0
    samples, effort, way, certain = fired(left, frees, farthest=1e-2)
    assert certain
    assert way == pytest.approx(left, rel=1e-12)  # straight to the target
    assert abs(effort) > frees


def test_the_scale_of_pulses_converges_to_that_of_their_ways() -> None:
    scale = 1.0
    for _ in range(20):
        scale = scaled(scale, scale * 1e-4, 1.4e-4)
    assert scale == pytest.approx(1.4, rel=1e-4)
    assert scaled(scale, 1e-4, 0.0) == scale  # one that has not moved the mass shows nothing
    assert scaled(scale, 1e-4, 1.0) == TRACKING.nudge_scales[1]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_it_waits_until_mass_2_passes_the_target(side: float) -> None:
    # Mass 1 is off by the amplitude of the swing, whose one end is the target
    error, tolerance, w = 3e-3, 1e-4, 5.0
    moments: list[str] = []
    for k in range(100):
        angle = 0.0627 * k + 0.5
        swing = Swing(
            position=0.0,
            offset=side * error * cos(angle),
            velocity=-side * error * w * sin(angle),
            frequency=w,
        )
        when = moment(swing, side * error, tolerance)
        moments.append(when)
        if when == "now":  # the end of the swing is the target
            assert abs(sin(angle)) < 0.6
            assert cos(angle) > 0.0
    assert "now" in moments
    assert set(moments) == {"now", "later"}


def test_it_is_not_fired_where_mass_2_stays_away() -> None:
    swing = Swing(position=0.0, offset=0.0, velocity=0.0, frequency=5.0)
    assert moment(swing, 3e-3, 1e-4) == "never"
    assert moment(swing, 5e-5, 1e-4) == "now"
