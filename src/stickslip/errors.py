"""The errors a user can meet, and the checks of values."""

import copyreg
from collections.abc import Callable, Iterable, Mapping
from copy import copy
from math import isclose, isfinite
from numbers import Integral, Real
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    import numpy as np
    from jaxtyping import Float

    from stickslip.messages import Message


class StickslipError(Exception):
    """Root of every error this package raises on purpose.

    An error is a code and quantities. ``stickslip.messages`` holds the sentence of each code, which
    ``str`` renders with the names that settings have in Python.

    Parameters
    ----------
    code
        What is wrong.
    where
        File, row, column, table or key where it was found; empty when there is no such place.
    **quantities
        Values, units, limits and names that the sentence mentions.

    Attributes
    ----------
    code, where, quantities
        As given.
    keys
        Whether names of settings are keys of the file at ``where``, whatever the front end.
    """

    keys = False

    def __init__(self, code: str, *, where: str = "", **quantities: Any) -> None:
        self.code = code
        self.where = where
        self._quantities = quantities
        super().__init__(code)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle without a call of the constructor, whose arguments subclasses choose."""
        return copyreg.__newobj__, (type(self), self.code), self.__dict__  # type: ignore[attr-defined]

    @property
    def quantities(self) -> Mapping[str, Any]:
        """Values, units, limits and names, by name."""
        return MappingProxyType(self._quantities)

    @property
    def what(self) -> str:
        """The fault, as a sentence without place and remedy."""
        return self._rendered(str).what

    @property
    def remedy(self) -> str:
        """The remedy, as an instruction."""
        return self._rendered(str).remedy

    def sentence(self, naming: Callable[[str], str] = str) -> str:
        """Return place, what is wrong, and the remedy; ``naming`` names settings in a front end.

        It is one line that can be printed, whatever names a damaged file has.
        """
        message = self._rendered(naming)
        place = f"{self.where}: " if self.where else ""
        line = f"{place}{message.what}; {message.remedy}"
        if line.isprintable():
            return line
        return "".join(each if each.isprintable() else " " for each in line)

    def below(self, *headings: str) -> str:
        """Return the sentence, without its place if that is one of the headings above it."""
        bare = copy(self)
        bare.where = "" if self.where in headings else self.where
        return str(bare)

    def __str__(self) -> str:
        return self.sentence()

    def _rendered(self, naming: Callable[[str], str]) -> "Message":
        # Imported here, as only an error that is shown needs the sentences
        from stickslip.messages import rendered

        return rendered(self.code, self._quantities, str if self.keys else naming)


class InputError(StickslipError, ValueError):
    """Something handed in cannot be used; see `StickslipError` for what it holds.

    Examples
    --------
    >>> error = InputError("not_positive", name="mass", value=-1.0, unit="kg")
    >>> error.code, error.quantities["value"]
    ('not_positive', -1.0)
    >>> str(error)
    'mass is -1 kg, it must be positive; give a positive value'
    """

    def at(self, where: str, *, keys: bool = False) -> "InputError":
        """Return the same error placed at ``where``: a reader has the file, a record does not.

        ``keys`` is whether the names of settings are keys there.
        """
        placed = copy(self)
        placed.where = ", ".join(filter(None, (where, self.where)))
        placed.keys = self.keys or keys
        return placed

    def on(self, kind: Literal["linear", "rotary"]) -> "InputError":
        """Return the same error with the units of one kind of axis where it has those of both."""
        own = copy(self)
        own._quantities = {
            name: value.split(" or ")[kind == "rotary"] if _is_either_unit(name, value) else value
            for name, value in self._quantities.items()
        }
        return own


class MissingExtraError(StickslipError, ImportError):
    """An optional dependency is needed and not installed."""

    def __init__(self, purpose: str, *, extra: str) -> None:
        super().__init__("missing_extra", purpose=purpose, extra=extra)


class RequiredExtra:
    """Context of the import of an optional dependency.

    Parameters
    ----------
    extra
        Extra of the package that installs it.
    purpose
        What needs it, as in `MissingExtraError`.

    Raises
    ------
    MissingExtraError
        On leaving the context, if the import fails.
    """

    def __init__(self, extra: str, purpose: str) -> None:
        self._absent = MissingExtraError(purpose, extra=extra)

    def __enter__(self) -> None: ...

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        if isinstance(error, ImportError):
            raise self._absent from None


class EventBudgetError(StickslipError, RuntimeError):
    """More sticks and slips inside one sample than the simulator's budget allows."""


def interruption_behind(error: BaseException | None) -> KeyboardInterrupt | None:
    """Return the interruption (Ctrl-C, or a request to terminate) that an error comes from, if any.

    A signal that arrives while a compiled function takes its arguments apart leaves it as a
    ``SystemError``, whose cause is what the signal's handler raised.
    """
    while isinstance(error, SystemError):
        error = error.__cause__ or error.__context__
    return error if isinstance(error, KeyboardInterrupt) else None


_REAL = "biuf"  # kinds of NumPy types


def _is_either_unit(name: str, value: object) -> bool:
    return "unit" in name and isinstance(value, str) and " or " in value


def finite_vector(name: str, values: Any, unit: str) -> "Float[np.ndarray, ' n']":
    """Return a read-only copy of ``values`` as a vector of finite floats.

    Raises
    ------
    InputError
        If it holds no real numbers, is not one-dimensional, or if a value is masked or not finite
        (its index is named).
    """
    import numpy as np  # here, as a wrong path is reported without it

    if np.ma.is_masked(values):
        masked = np.flatnonzero(np.ma.getmaskarray(values))
        raise InputError("samples_masked", name=name, sample=int(masked[0]), count=masked.size)
    array = np.array(_real(name, values), dtype=np.float64)
    if array.ndim != 1:
        raise InputError("not_a_vector", name=name, dimensions=array.ndim)
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        raise InputError(
            "samples_not_finite",
            name=name,
            value=float(array[bad[0]]),
            unit=unit,
            sample=int(bad[0]),
            count=bad.size,
            samples=array.size,
        )
    array.flags.writeable = False
    return array


def _real(name: str, values: Any) -> Any:
    """Return an array of real numbers; text, dates and complex numbers are none."""
    import numpy as np

    try:
        array = np.asarray(values)
        if array.dtype.kind == "O" and not any(isinstance(v, str | bytes) for v in array.flat):
            array = array.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        array = np.array(None)
    if array.dtype.kind not in _REAL:
        held = "objects" if array.dtype.kind == "O" else str(array.dtype)
        raise InputError("not_real_numbers", name=name, held=held)
    return array


def _number(name: str, value: Any, unit: str) -> float:
    """Return a value as a float, also one that is not finite; text and flags are no numbers."""
    try:
        return float("text" if isinstance(value, str | bytes | bool) else value)
    except (TypeError, ValueError):
        raise InputError("not_a_number", name=name, value=value, unit=unit) from None


def _checked(name: str, value: float, unit: str, *, zero: bool) -> float:
    """Return a finite number that is positive, or zero where that is allowed."""
    number = finite(name, value, unit)
    if number < 0.0 or (number == 0.0 and not zero):
        raise InputError("negative" if zero else "not_positive", name=name, value=number, unit=unit)
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


def finite(name: str, value: float, unit: str) -> float:
    """Check a finite quantity; see `non_negative`.

    Parameters
    ----------
    value
        Its value [``unit``].

    Raises
    ------
    InputError
        If it is no number, or not finite.
    """
    number = _number(name, value, unit)
    if not isfinite(number):
        raise InputError("not_finite", name=name, value=number, unit=unit)
    return number


def whole(name: str, value: Any, *, least: int = 0, unit: str = "") -> int:
    """Check a whole number of at least ``least``; an InputError otherwise."""
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        raise InputError("not_whole", name=name, value=value, least=least, unit=unit)
    return int(value)


def one_of(name: str, value: Any, choices: Iterable[str], *, where: str = "") -> None:
    """Check that a value is one of several words; an InputError otherwise."""
    choices = tuple(choices)
    if not isinstance(value, str) or value not in choices:
        raise InputError("not_a_choice", where=where, name=name, value=value, choices=choices)


def check_class(name: str, part: object, *kinds: type) -> None:
    """Check that a part is an object of one of several classes; an InputError otherwise."""
    if not isinstance(part, kinds) or isinstance(part, type):
        needed = [kind.__name__ for kind in kinds]
        raise InputError("wrong_type", name=name, found=type(part).__name__, needed=needed)


_SAME_SAMPLING_TIME = 1e-6  # relative; more than its rounding


def check_sampling_time(name: str, own: float, other: str, sampling_time: float) -> None:
    """Check that a part was made for the sampling time [s] of another; an InputError otherwise."""
    if not isclose(own, sampling_time, rel_tol=_SAME_SAMPLING_TIME):
        raise InputError(
            "other_sampling_time", name=name, own=own, other=other, sampling_time=sampling_time
        )


def check_controller(controller: object, sampling_time: float) -> None:
    """Check that an object is a controller for a loop's sampling time [s]; an InputError otherwise.

    One without an attribute ``sampling_time`` is for any.
    """
    for method in ("init", "step"):
        if not callable(getattr(controller, method, None)):
            raise InputError("no_controller", controller=type(controller).__name__, method=method)
    own = getattr(controller, "sampling_time", None)
    if isinstance(own, Real):
        check_sampling_time("the controller", float(own), "the loop", sampling_time)
