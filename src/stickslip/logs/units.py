"""Units of logs, and their factors to SI."""

import re
import tokenize
from functools import cache
from typing import Any, get_args

from stickslip.logs.unit_spelling import for_unit_library, number_in
from stickslip.records import AxisKind, EffortUnit, InputError, unit_of

_PLAUSIBLE = re.compile(r"(?:(?:[^\W\d_]++|\))(?:(?:\^|\*\*)-?[1-9](?!\d))?|1(?= ?/)|[%*/( ])++")
"""Words, products and small powers: what is handed to the unit library's parser at all."""

_PARSER_FAULTS = (ValueError, TypeError, AttributeError, AssertionError, tokenize.TokenError)
"""Errors of the unit library's parser, beside its own, on text that is no unit."""

_SIZES_OF_COUNTS = {"position": "1/4096 rev", "velocity": "1/4096 rev/s"}
"""Examples of units in place of encoder counts."""


def quantity_of(channel: str) -> str:
    """Return the quantity that a channel of a log holds."""
    return channel.removeprefix("load_")


def effort_unit(unit: str) -> EffortUnit:
    """Return ampere or percent for an effort in such a unit, and nothing for another one."""
    if for_unit_library(number_in(unit)[1]) == "percent":
        return "%"
    if unit in {unit_of("effort", "linear"), unit_of("effort", "rotary")}:
        return ""  # needs no unit library
    return "A" if _factor(unit, "ampere") is not None else ""


def measures(unit: str, channel: str) -> bool:
    """Return whether a channel can have such a unit; a unit that is not known counts as one.

    >>> measures("rad", "position"), measures("A", "position"), measures("Nm/A", "effort")
    (True, False, False)
    """
    try:
        return bool(channel == "effort" and effort_unit(unit)) or _kind(channel, unit) is not None
    except InputError:
        return True  # raised where the column is used


def kind_of_unit(channel: str, unit: str) -> AxisKind | None:
    """Return the kind of axis on which a channel has such a unit, None where that says nothing.

    A unit that the channel has on no axis is an error.
    """
    if channel == "time" or (channel == "effort" and effort_unit(unit)):
        return None
    if kind := _kind(channel, unit):
        return kind
    targets = [unit_of(quantity_of(channel), kind) for kind in get_args(AxisKind)]
    raise _wrong_unit(channel, unit, targets)


def _kind(channel: str, unit: str) -> AxisKind | None:
    """Return the first kind of axis on which a channel can have such a unit."""
    return next(
        (
            kind
            for kind in get_args(AxisKind)
            if _factor(unit, unit_of(quantity_of(channel), kind)) is not None
        ),
        None,
    )


def scale_to_si(channel: str, unit: str, kind: AxisKind) -> float:
    """Return what a channel in the given unit is multiplied by to be in SI units.

    An effort in a unit of current is converted to A, one in percent is left. A unit of another
    dimension is an error that names both.

    >>> scale_to_si("position", "mm", "linear")
    0.001
    """
    target = unit_of(quantity_of(channel), kind)
    own = effort_unit(unit) if channel == "effort" else ""
    if own:
        return number_in(unit)[0] if own == "%" else _factor(unit, "ampere") or 1.0
    factor = _factor(unit, target)
    if factor is None:
        raise _wrong_unit(channel, unit, [target])
    return factor


def same_unit(one: str, other: str) -> bool:
    """Return whether two spellings mean one unit; False if one of them is no unit."""
    try:
        return _factor(one, other) == 1.0
    except InputError:
        return False


def _wrong_unit(channel: str, unit: str, targets: list[str]) -> InputError:
    counts = for_unit_library(unit).strip("()").partition("/")[0] == "count"
    example = _SIZES_OF_COUNTS.get(quantity_of(channel))
    if counts and example is not None:
        return InputError("encoder_counts", name=channel, unit=unit, example=example)
    return InputError("other_quantity", name=channel, unit=unit, targets=targets)


@cache
def _factor(unit: str, target: str) -> float | None:
    """Return how many targets one unit is, or None if they measure different things.

    An angle is distinguished from a bare number, so a position in percent is not taken for radians.
    """
    if unit == target:
        return 1.0
    registry = _registry()
    number, bare = number_in(unit.strip())
    here = registry.Quantity(number, _parsed(bare)).to_root_units()
    there = registry.Quantity(1.0, _parsed(target)).to_root_units()
    return float(here.magnitude / there.magnitude) if here.units == there.units else None


def _parsed(unit: str) -> Any:
    """Return the unit library's form of a unit, however it was spelled."""
    import pint

    spelled = for_unit_library(unit)
    if not _PLAUSIBLE.fullmatch(spelled):
        raise InputError("unknown_unit", unit=unit)
    try:
        return _registry().Unit(spelled)
    except (*_PARSER_FAULTS, pint.errors.PintError) as error:
        raise InputError("unknown_unit", unit=unit) from error


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(cache_folder=None)
