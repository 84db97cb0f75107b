"""Checks that the settings of several controllers have in common."""

from collections.abc import Callable, Mapping


def check_fields(
    record: object, check: Callable[[str, float, str], float], units: Mapping[str, str]
) -> None:
    """Check fields of a frozen record that are not None, and keep the numbers that it returns."""
    for name, unit in units.items():
        value = getattr(record, name)
        if value is not None:
            object.__setattr__(record, name, check(name, value, unit))
