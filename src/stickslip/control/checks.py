"""Checks that the settings of several controllers have in common."""

from collections.abc import Callable, Mapping

from stickslip.records import InputError


def check_fields(
    record: object, check: Callable[[str, float, str], float], units: Mapping[str, str]
) -> None:
    """Check fields of a frozen record that are not None, and keep the numbers that it returns."""
    for name, unit in units.items():
        value = getattr(record, name)
        if value is not None:
            object.__setattr__(record, name, check(name, value, unit))


def check_class(name: str, part: object, *kinds: type) -> None:
    """Check that a part is of one of several classes."""
    if not isinstance(part, kinds):
        needed = [kind.__name__ for kind in kinds]
        raise InputError("wrong_type", name=name, found=type(part).__name__, needed=needed)
