"""Equal positions of a sensor that may be frozen."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

from stickslip.control.equal_positions import MOST_EQUAL, SENSOR, compare, may_be_frozen
from stickslip.numerics.named_fields import fields_at, places

NOISE = 1e-6  # m


def positions(*seen: float, equal: int = 0, rests: bool = True) -> Any:
    """Return what is known after some positions, and after the last of them so many times more."""
    known = fields_at(SENSOR)(np.zeros(places(SENSOR)))
    each: Iterable[float] = (*seen, *[seen[-1]] * equal)
    for x in each:
        compare(known, x, NOISE, rests, False)
    return known


@pytest.mark.parametrize(
    ("seen", "equal", "expected"),
    [
        ((0.0, 4.0 * NOISE, 0.0), 3, False),  # may be by chance
        ((0.0, 4.0 * NOISE, 0.0), 4, True),
        ((0.0, 4.0 * NOISE, 0.0), MOST_EQUAL - 1, True),
        ((0.0, 4.0 * NOISE, 0.0), MOST_EQUAL, False),  # those of a sensor without noise
        ((0.0, 1e-3, 0.0), 10, False),  # the axis itself has turned round
        ((0.0, 4.0 * NOISE, 8.0 * NOISE), 10, False),  # it moves on
    ],
)
def test_a_sensor_whose_noise_ends_may_be_frozen(
    seen: tuple[float, ...], equal: int, expected: bool
) -> None:
    assert may_be_frozen(positions(*seen, equal=equal)) is expected


def test_many_equal_positions_are_those_of_a_sensor_without_noise() -> None:
    """Also if others follow them."""
    known = positions(0.0, 4.0 * NOISE, 0.0, equal=MOST_EQUAL)
    for x in (4.0 * NOISE, *[0.0] * 10):
        compare(known, x, NOISE, True, False)
    assert not may_be_frozen(known)


def test_an_axis_in_motion_has_few_equal_positions() -> None:
    """More are counted once it rests."""
    known = positions(0.0, 4.0 * NOISE, 0.0, equal=100, rests=False)
    assert may_be_frozen(known)
    for _ in range(MOST_EQUAL):
        compare(known, 0.0, NOISE, True, False)
    assert not may_be_frozen(known)


@pytest.mark.parametrize(("step", "expected"), [(NOISE, True), (-NOISE, True), (1e-4, False)])
def test_noise_is_seen_before_anything_has_driven_the_axis(step: float, expected: bool) -> None:
    known = positions(0.0)
    compare(known, step, NOISE, True, True)
    for _ in range(5):
        compare(known, step, NOISE, True, False)
    assert may_be_frozen(known) is expected
