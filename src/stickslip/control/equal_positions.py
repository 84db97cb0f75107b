"""Detection of a possibly frozen sensor by equal positions.

Positions of a sensor with noise are rarely equal. Where noise is seen, a controller waits for more
samples before it acts on equal ones: the axis may be elsewhere.
"""

from typing import Any

import numpy as np

from stickslip.compiled import compiled

SENSOR = np.dtype(
    [
        ("last", "f8"),  # position
        ("step", "f8"),  # to it from the one before
        ("count", "i8"),  # of positions so far, two at most
        ("equal", "i8"),  # in a row up to the last, besides the first
        ("noisy", "i8"),  # 1 if they should differ, 2 if they need not; 0 if that is open
    ]
)
"""State of the detection of equal positions."""

FEWEST_EQUAL = 4  # positions in a row that are rarely equal where there is noise
MOST_EQUAL = 25  # likewise, those of a sensor without noise
VISIBLE = 10.0  # standard deviations of a position: a step that is no noise


@compiled()
def expect_noise(sensor: Any) -> None:
    """Take equal positions for those of a frozen sensor from here on, until many are seen."""
    if sensor.noisy == 0:
        sensor.noisy = 1


@compiled()
def compare(sensor: Any, x: float, deviation: float, rests: bool, undriven: bool) -> None:
    """Count equal positions.

    A change of a few standard deviations shows that there is noise, if it follows one to the other
    side, or if nothing has driven the axis so far.

    Parameters
    ----------
    sensor
        A record of `SENSOR`.
    x
        The position [m or rad].
    deviation
        Its standard deviation; 0 if there is no noise.
    rests
        Whether the axis may rest: no more than `FEWEST_EQUAL` are counted while it is driven.
    undriven
        Whether no effort has acted so far.
    """
    step = x - sensor.last
    turns = sensor.count > 1 and step * sensor.step < 0.0
    change = abs(step - sensor.step) if turns else abs(step)
    moves_undriven = undriven and sensor.count > 0 and step != 0.0
    if (turns or moves_undriven) and change <= VISIBLE * deviation:
        expect_noise(sensor)
    if sensor.count == 0 or step != 0.0:
        sensor.equal = 0
    elif rests or sensor.equal < FEWEST_EQUAL:
        sensor.equal += 1
        if sensor.equal >= MOST_EQUAL and sensor.noisy == 1:
            sensor.noisy = 2
    sensor.last, sensor.step = x, step
    sensor.count = min(sensor.count + 1, 2)


@compiled()
def may_be_frozen(sensor: Any) -> bool:
    """Return whether the sensor may be frozen: there is noise, and positions are equal.

    Many equal ones are those of a sensor without noise. A guard stops a sensor with noise of an
    encoder step or more sooner.
    """
    return sensor.noisy == 1 and FEWEST_EQUAL <= sensor.equal < MOST_EQUAL
