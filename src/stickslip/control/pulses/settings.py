"""Checks of the settings of pulse controllers."""

from math import floor, inf
from typing import Literal

import numpy as np

from stickslip.control.pulses.kernel import ROUNDING
from stickslip.records import InputError, positive

__all__ = ["checked_share", "longest_samples", "whole"]


def checked_share(
    name: str, value: float, highest: float, *, ends: Literal["", "low", "high"], usual: float
) -> None:
    """Check a number without unit that must lie between 0 and ``highest``; which end is included.

    ``usual`` is what to give when in doubt.
    """
    low = value >= 0.0 if ends == "low" else value > 0.0
    high = value <= highest if ends == "high" else value < highest
    if not (low and high):
        left = "[" if ends == "low" else "("
        right = "]" if ends == "high" else ")"
        raise InputError(
            f"{name} is {value:g}, it must lie in {left}0, {highest:g}{right}",
            remedy=f"give {usual:g} when in doubt",
        )


def whole(value: object) -> bool:
    """Return whether a value is a whole number, of whatever integer type."""
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def longest_samples(width: float | None, sampling_time: float) -> float:
    """Return how many whole samples a pulse may last at most."""
    if width is None:
        return inf
    samples = floor(positive("longest_width", width, "s") / sampling_time + ROUNDING)
    if samples < 1:
        raise InputError(
            f"longest_width is {width:g} s, a pulse lasts at least one sample of "
            f"{sampling_time:g} s",
            remedy="allow a longer pulse or sample faster",
        )
    return float(samples)
