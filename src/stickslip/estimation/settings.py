"""Checks of the settings of estimators, and their form as options."""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import asdict, fields, is_dataclass
from typing import Any

import numpy as np

from stickslip.estimation.online.recursion import Variance
from stickslip.records import InputError, ReadOnlyMapping, positive


def first_guesses(
    values: Mapping[str, float] | None, known: Collection[str]
) -> Mapping[str, float]:
    """Return validated first guesses by parameter name [SI], read-only."""
    guesses = dict(values or {})
    for name, value in guesses.items():
        if name not in known:
            raise InputError("guess_not_estimated", name=name, choices=known)
        if not np.isfinite(value):
            raise InputError("not_finite", name=f"first guess of {name}", value=value, unit="")
    return ReadOnlyMapping(guesses)


def check_given(
    settings: object, check: Callable[[str, float, str], float], units: Mapping[str, str]
) -> None:
    """Check each named setting that is not None, by a check that takes name, value and unit."""
    for name, unit in units.items():
        value = getattr(settings, name)
        if value is not None:
            check(name, value, unit)


def check_arm(load_inertia: float | None, stiffness: float | None) -> None:
    """Check that load inertia and stiffness of a flexible arm are given together."""
    if (load_inertia is None) != (stiffness is None):
        raise InputError("half_an_arm")


def checked_variance(value: float | Iterable[Iterable[float]], count: int) -> Variance:
    """Return the validated P(0) of ``count`` parameters.

    It is a positive number, or a positive definite matrix as rows of numbers.
    """
    if isinstance(value, int | float | np.number):
        return positive("initial_variance", float(value), "(unit of the parameter)^2")
    try:
        matrix = np.array([[float(each) for each in row] for row in value])
    except (TypeError, ValueError) as error:  # no rows of numbers, or rows of different length
        needed = ("a number", "rows of numbers of the same length")
        found = type(value).__name__
        raise InputError(
            "wrong_type", name="initial_variance", found=found, needed=needed
        ) from error
    square = matrix.shape == (count, count) and bool(np.isfinite(matrix).all())
    if not (square and np.allclose(matrix, matrix.T) and np.linalg.eigvalsh(matrix)[0] > 0.0):
        raise InputError("initial_variance_wrong", shape=matrix.shape, count=count)
    return tuple(tuple(row) for row in (0.5 * (matrix + matrix.T)).tolist())


def check_forgetting_factor(value: float) -> None:
    """Validate a forgetting factor, which is in (0, 1]."""
    if not 0 < value <= 1:
        raise InputError(
            "not_in_interval", name="forgetting_factor", value=value, interval="(0, 1]", usual=1.0
        )


def options_of(estimator: Any) -> dict[str, Any]:
    """Return name and settings of an estimator as plain values, for a result's provenance."""
    values = {field.name: getattr(estimator, field.name) for field in fields(estimator)}
    return {"estimator": estimator.name, **{name: _plain(each) for name, each in values.items()}}


def _plain(value: Any) -> Any:
    """Return a setting without records and mappings of other types than dict."""
    if isinstance(value, Mapping):
        return dict(value)
    if is_dataclass(value) and not isinstance(value, type):
        return asdict(value)
    return tuple(map(_plain, value)) if isinstance(value, tuple) else value
