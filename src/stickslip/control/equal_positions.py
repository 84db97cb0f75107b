"""Kernels that find out from equal positions whether the sensor of an axis may be frozen.

Positions of a sensor with noise are rarely equal. Where noise is seen, a controller waits for more
samples before it acts on equal ones: the axis may be elsewhere.
"""

from typing import Any

import numpy as np

from stickslip.compiled import compiled

POSITIONS = np.dtype(
    [
        ("deviation", "f8"),  # standard deviation of a position
        ("last", "f8"),
        ("step", "f8"),  # to it from the one before
        ("seen", "i8"),  # positions so far, two at most
        ("equal", "i8"),  # in a row up to the last, besides the first
        ("noisy", "i8"),  # 1 if they should differ, 2 if they need not; 0 if that is open
    ]
)
"""What is known of the positions of a sensor."""

RARELY = 4  # positions in a row that are rarely equal where there is noise
MANY = 25  # likewise, those of a sensor without noise
VISIBLE = 10.0  # standard deviations of a position: a step that is no noise


@compiled()
def expect_noise(positions: Any) -> None:
    """Take equal positions for those of a frozen sensor from here on, until many are seen."""
    if positions.noisy == 0:
        positions.noisy = 1


@compiled()
def compare(positions: Any, x: float, rests: bool, untouched: bool) -> None:
    """Count equal positions; more than a few only on an axis that rests.

    A change of a few standard deviations shows that there is noise, if it follows one to the other
    side, or if nothing has driven the axis yet.
    """
    step = x - positions.last
    turns = positions.seen > 1 and step * positions.step < 0.0
    change = abs(step - positions.step) if turns else abs(step)
    stirs = untouched and positions.seen > 0 and step != 0.0
    if (turns or stirs) and change <= VISIBLE * positions.deviation:
        expect_noise(positions)
    if positions.seen == 0 or step != 0.0:
        positions.equal = 0
    elif rests or positions.equal < RARELY:
        positions.equal += 1
        if positions.equal >= MANY and positions.noisy == 1:
            positions.noisy = 2
    positions.last, positions.step = x, step
    positions.seen = min(positions.seen + 1, 2)


@compiled()
def may_be_frozen(positions: Any) -> bool:
    """Return whether the sensor may be frozen: there is noise, and positions are equal.

    Many equal ones are those of a sensor without noise. A guard stops a sensor with noise of an
    encoder step or more sooner.
    """
    return positions.noisy == 1 and RARELY <= positions.equal < MANY
