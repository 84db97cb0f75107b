"""The errors a user can meet, and the checks of values; each message says how to mend it."""

from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Float


class StickslipError(Exception):
    """Root of every error this package raises on purpose."""


class InputError(StickslipError, ValueError):
    """Something handed in cannot be used.

    Parameters
    ----------
    what
        The quantity or thing at fault, with its value, unit and limit.
    where
        File, row, column or key where it was found; empty when there is no such place.
    remedy
        What to do about it, as an instruction.

    Examples
    --------
    >>> str(InputError("mass is -1 kg, it must be positive", remedy="give the moving mass"))
    'mass is -1 kg, it must be positive; give the moving mass'
    """

    def __init__(self, what: str, *, where: str = "", remedy: str) -> None:
        self.what = what
        self.where = where
        self.remedy = remedy
        place = f"{where}: " if where else ""
        super().__init__(f"{place}{what}; {remedy}")

    def __reduce__(self) -> tuple[partial["InputError"], tuple[()]]:
        """Pickle the arguments, some of which are keyword-only."""
        return partial(InputError, self.what, where=self.where, remedy=self.remedy), ()

    def at(self, where: str) -> "InputError":
        """Return the same error placed at ``where``: a reader knows the file, a record does not."""
        place = f"{where}, {self.where}" if self.where else where
        return InputError(self.what, where=place, remedy=self.remedy)


class MissingExtraError(StickslipError, ImportError):
    """An optional dependency is needed and not installed."""

    def __init__(self, purpose: str, *, extra: str) -> None:
        self.purpose = purpose
        self.extra = extra
        super().__init__(
            f"{purpose} needs an optional dependency; "
            f"install it with: pip install 'stickslip[{extra}]'"
        )

    def __reduce__(self) -> tuple[partial["MissingExtraError"], tuple[()]]:
        """Pickle the arguments, one of which is keyword-only."""
        return partial(MissingExtraError, self.purpose, extra=self.extra), ()


class EventBudgetError(StickslipError, RuntimeError):
    """More sticks and slips inside one sample than the simulator's budget allows."""


_NO_UNIT = ("", "-")


def finite_vector(name: str, values: Any, unit: str) -> Float[np.ndarray, " n"]:
    """Return a read-only copy of ``values`` as a vector of finite floats.

    Raises
    ------
    InputError
        If it is not one-dimensional, or if a value is not finite (its index is named).
    """
    array = np.array(values, dtype=np.float64)
    if array.ndim != 1:
        raise InputError(
            f"{name} has {array.ndim} dimensions, it must be a vector",
            remedy="pass one value a sample",
        )
    if not np.isfinite(array).all():
        bad = np.flatnonzero(~np.isfinite(array))
        raise InputError(
            f"{name} is {array[bad[0]]} [{unit}] at sample {bad[0]} ({bad.size} of {array.size} "
            "samples are not finite)",
            remedy="remove or repair those samples; nothing is interpolated silently",
        )
    array.flags.writeable = False
    return array


def _number(name: str, value: Any, unit: str) -> float:
    """Return a value as a float, also one that is not finite; text is no number."""
    try:
        return float("text" if isinstance(value, str | bytes) else value)
    except (TypeError, ValueError):
        within = "" if unit in _NO_UNIT else f" in {unit}"
        raise InputError(
            f"{name} is {value!r}, it must be a number", remedy=f"give a number{within}"
        ) from None


def _checked(name: str, value: float, unit: str, *, zero: bool) -> float:
    """Return a finite number that is positive, or zero where that is allowed."""
    number = _number(name, value, unit)
    if not (np.isfinite(number) and (number > 0 or (zero and number == 0))):
        shown = f"{number:g}" if unit in _NO_UNIT else f"{number:g} {unit}"
        limit = "must not be negative" if zero else "must be positive"
        limit = "must be finite" if number == np.inf else limit
        remedy = "give a positive value" + ", or 0" * zero
        raise InputError(f"{name} is {shown}, it {limit}", remedy=remedy)
    return number


def positive(name: str, value: float, unit: str) -> float:
    """Check a quantity that must be positive; see `non_negative`.

    Parameters
    ----------
    value
        Its value [``unit``].

    Raises
    ------
    InputError
        If it is no number, or not finite and above zero.
    """
    return _checked(name, value, unit, zero=False)


def non_negative(name: str, value: float, unit: str) -> float:
    """Check a quantity that must not be negative.

    Parameters
    ----------
    name
        Name of the quantity in the message.
    value
        Its value [``unit``].
    unit
        Its SI unit; ``"-"`` for none.

    Raises
    ------
    InputError
        If it is no number, not finite, or below zero.
    """
    return _checked(name, value, unit, zero=True)
