"""Checks of the settings that pulse width and pulse amplitude width control share."""

from math import floor, inf
from typing import Literal

import numpy as np

from stickslip.control.pulse_kernel import ROUNDING
from stickslip.records import AxisKind, InputError, positive, unit_of

__all__ = [
    "checked_first_friction",
    "checked_patience",
    "checked_share",
    "longest_samples",
    "whole",
]


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


def checked_patience(patience: int | None) -> None:
    """Check how many pulses without motion are allowed."""
    if patience is not None and not (whole(patience) and patience >= 1):
        raise InputError(
            f"patience is {patience!r} pulses, it must be a whole number of at least 1",
            remedy="give how many pulses in a row may fail to move the axis, or None for any",
        )


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


def checked_first_friction(
    mass: float,
    coulomb_friction: float,
    static_friction: float | None,
    pulse_effort: float,
    kind: AxisKind,
) -> None:
    """Check mass and friction, and that the pulses can overcome it."""
    unit = unit_of("effort", kind)
    positive("mass", mass, unit_of("mass", kind))
    positive("coulomb_friction", coulomb_friction, unit)
    positive("pulse_effort", pulse_effort, unit)
    limit, name = coulomb_friction, "Coulomb friction"
    if static_friction is not None:
        if not static_friction >= coulomb_friction:
            raise InputError(
                f"static_friction is {static_friction:g} {unit}, less than the Coulomb friction "
                f"of {coulomb_friction:g} {unit}",
                remedy="give the effort it takes to break away, at least the Coulomb friction",
            )
        limit, name = static_friction, "breakaway (static) friction"
    if not pulse_effort > limit:
        raise InputError(
            f"pulse_effort is {pulse_effort:g} {unit}, not more than the {name} of {limit:g} "
            f"{unit}: no pulse would move the axis",
            remedy="allow more effort",
        )
