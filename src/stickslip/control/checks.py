"""Checks that the settings of several controllers have in common."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from stickslip.records import InputError


def check_fields(
    record: object, check: Callable[[str, float, str], float], units: Mapping[str, str]
) -> None:
    """Check fields of a frozen record that are not None, and keep the numbers that it returns."""
    for name, unit in units.items():
        value = getattr(record, name)
        if value is not None:
            object.__setattr__(record, name, check(name, value, unit))


def check_choice(name: str, value: str, *choices: str) -> None:
    """Check that a value is one of two choices."""
    if value not in choices:
        raise InputError(
            f"{name} is {value!r}", remedy=f"give {' or '.join(repr(one) for one in choices)}"
        )


def check_class(record: object, name: str, kind: type, remedy: str) -> None:
    """Check that a field is of a class."""
    part: Any = getattr(record, name)
    if not isinstance(part, kind):
        raise InputError(
            f"{name} must be a {kind.__name__}, it is a {type(part).__name__}", remedy=remedy
        )


def check_finite(name: str, value: float, unit: str, remedy: str) -> float:
    """Return a finite number."""
    if not np.isfinite(value):
        raise InputError(f"{name} is {value:g} {unit}, it must be finite", remedy=remedy)
    return float(value)


def whole(value: object) -> bool:
    """Return whether a value is a whole number, of whatever integer type."""
    return isinstance(value, int | np.integer) and not isinstance(value, bool)
