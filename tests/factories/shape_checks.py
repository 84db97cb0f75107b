"""Run-time checks of array shapes: of the first calls of every function in every test."""

import dataclasses
import functools
import inspect
from collections.abc import Sequence
from types import CodeType
from typing import Any

import jaxtyping
from beartype import beartype

CALLS = 5
"""Calls of a function that are checked in a test. A check takes some 0.1 ms: those of every call in
a loop over time took three times as long as the tests themselves."""

_left: dict[CodeType, int] = {}
_checked = jaxtyping.jaxtyped


def next_test() -> None:
    """Check the first calls anew."""
    _left.clear()


def _first_calls_checked(function: Any = None, *, typechecker: Any = None) -> Any:
    """Return a function or a dataclass whose first calls in a test are checked."""
    if function is None:
        return functools.partial(_first_calls_checked, typechecker=typechecker)
    if inspect.isclass(function):
        if dataclasses.is_dataclass(function) and not hasattr(function.__init__, "checked"):
            function.__init__ = _first_calls_checked(function.__init__)
        return function
    code, checked = function.__code__, None

    @functools.wraps(function)
    def wrapper(*args: Any, **kwargs: Any) -> Any:
        nonlocal checked
        left = _left.get(code, CALLS)
        if left == 0:
            return function(*args, **kwargs)
        _left[code] = left - 1
        if checked is None:  # built late: a process calls few of all functions
            checked = _checked(function, typechecker=beartype)
        return checked(*args, **kwargs)

    wrapper.checked = True  # type: ignore[attr-defined]
    return wrapper


def check_shapes(modules: Sequence[str]) -> None:
    """Check the array annotations of modules that are imported later.

    The import hook decorates every function and class with ``jaxtyping.jaxtyped``.
    """
    jaxtyping.jaxtyped = _first_calls_checked
    jaxtyping.install_import_hook(modules, "beartype.beartype")
