"""Pulse control: its pulses, its outcome, and what it has learned."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Literal, get_args

import numpy as np
from jaxtyping import Float

from stickslip.errors import InputError
from stickslip.records.quantities import (
    QUANTITIES,
    AxisKind,
    quantity_field,
    quantity_name,
    unit_of,
)
from stickslip.records.record import ReadOnlyMapping, Record, Valued

PulseMethod = Literal["pwc", "papwc", "exact", "landing"]

_SCHEMA = 1
_LARGEST = 1e15  # SI: a damaged number rather than one that some axis has


class PositioningOutcome(Enum):
    """Progress of a pulse controller; the text says what it means and what to do."""

    MOVING = "moving"
    REACHED = "reached"
    STOPPED = "stopped"

    @property
    def text(self) -> str:
        """One sentence on what it means and what to do."""
        return _OUTCOME_TEXT[self]


_OUTCOME_TEXT = {
    PositioningOutcome.MOVING: "The axis moves, or a pulse is due; give it more time.",
    PositioningOutcome.REACHED: "The axis rests on its target, within the tolerance.",
    PositioningOutcome.STOPPED: (
        "The axis rests outside the tolerance and no pulse of this controller brings it nearer; "
        "allow more effort, a shorter sampling time or a wider tolerance, or give better first "
        "guesses of the friction."
    ),
}


@dataclass(frozen=True, kw_only=True)
class PulseRecord(Record):
    """One pulse, from rest to rest, with its predicted and its achieved displacement."""

    time: float = quantity_field("time")  #: Of its first sample.
    #: Its levels in order, each an effort and how long it was held [N or N m, s].
    levels: tuple[tuple[float, float], ...]
    error: float = quantity_field("position")  #: Target minus position, at rest before it.
    #: From rest to rest, as the controller expected it.
    predicted_displacement: float = quantity_field("position")
    achieved_displacement: float = quantity_field("position")  #: The same as measured.
    moved: bool  #: Whether it moved the axis at all, as far as the sensors can resolve.

    @property
    def duration(self) -> float:
        """Duration of the pulse, all levels together [s]."""
        return sum(held for _, held in self.levels)


@dataclass(frozen=True, kw_only=True)
class LearnedPulses(Record):
    """Values that a pulse controller has learned, for its next run.

    Attributes
    ----------
    method
        ``"pwc"``, ``"papwc"``, ``"exact"`` or ``"landing"``.
    kind
        ``"linear"`` or ``"rotary"``.
    values
        By name [SI, the unit that `stickslip.records.unit_of` names].
    covariance
        What the method's recursion resumes from, shape (n, n) [that of the method]: of least
        squares the inverse of the sum of the regressors' squares.

    Raises
    ------
    InputError
        If the method is unknown, a name has no unit, or a number is not finite or beyond all
        measure.

    Examples
    --------
    >>> learned = LearnedPulses(method="pwc", kind="linear", values={"pulse_gain": 2.5},
    ...                       covariance=np.array([[1e5]]))
    >>> LearnedPulses.from_dict(learned.to_dict()).values["pulse_gain"]
    2.5
    """

    schema = _SCHEMA
    json_form = ("schema method kind values=valued covariance",)

    method: PulseMethod
    kind: AxisKind
    values: Mapping[str, float]
    covariance: Float[np.ndarray, "n n"]

    def __post_init__(self) -> None:
        _one_of("method", self.method, get_args(PulseMethod))
        _one_of("kind", self.kind, get_args(AxisKind))
        values: dict[str, float] = {}
        for name, value in self.values.items():
            if quantity_name(name) not in QUANTITIES:
                what = f"{name!r} is not the name of a value that a pulse controller learns"
                raise InputError(what, where="values", remedy="leave it out")
            values[name] = _number(value, f"values.{name}", unit_of(name, self.kind))
        object.__setattr__(self, "values", ReadOnlyMapping(values))
        covariance = np.array(self.covariance, dtype=np.float64)
        square = covariance.ndim == 2 and covariance.shape[0] == covariance.shape[1]
        if not (square and np.isfinite(covariance).all()):
            raise _unlike_saved(
                f"the covariance must be a square matrix of finite numbers, it has shape "
                f"{covariance.shape}" + (" and numbers that are not finite" if square else ""),
                "covariance",
            )
        covariance.flags.writeable = False
        object.__setattr__(self, "covariance", covariance)

    @property
    def valued(self) -> dict[str, Valued]:
        """Values with their units."""
        return {
            name: Valued(value, unit_of(name, self.kind)) for name, value in self.values.items()
        }

    @classmethod
    def from_dict(cls, saved: Mapping[str, Any]) -> "LearnedPulses":
        """Return what `to_dict` wrote.

        Raises
        ------
        InputError
            If a key is missing or unknown, the schema is another, a value is not a finite number,
            or it is given in another unit.
        """
        _keys(saved, ("schema", "method", "kind", "values", "covariance"), "")
        if saved["schema"] != _SCHEMA:
            raise InputError(
                f"the schema is {saved['schema']!r}, this version reads schema {_SCHEMA}",
                where="schema",
                remedy="read it with the version of stickslip that wrote it, or learn anew",
            )
        kind = saved["kind"]
        _one_of("kind", kind, get_args(AxisKind))
        if not isinstance(saved["values"], Mapping):
            what = f"values is a {type(saved['values']).__name__}, it must be a table of values"
            raise _unlike_saved(what, "values")
        values: dict[str, float] = {}
        for name, entry in saved["values"].items():
            where = f"values.{name}"
            _keys(entry, ("value", "unit"), where)
            known = quantity_name(name) in QUANTITIES
            if known and entry["unit"] != unit_of(name, kind):
                raise InputError(
                    f"{name} is given in {entry['unit']!r}, on a {kind} axis it must be in "
                    f"{unit_of(name, kind)!r}",
                    where=where,
                    remedy="give it in that unit",
                )
            values[name] = entry["value"]
        try:
            covariance = np.array(saved["covariance"], dtype=np.float64)
        except (TypeError, ValueError) as error:
            what = "the covariance is not a matrix of numbers"
            raise _unlike_saved(what, "covariance") from error
        return cls(method=saved["method"], kind=kind, values=values, covariance=covariance)


def _one_of(name: str, value: Any, known: tuple[str, ...]) -> None:
    if value not in known:
        remedy = f"give one of {', '.join(known)}"
        raise InputError(f"the {name} is {value!r}", where=name, remedy=remedy)


def _number(value: Any, where: str, unit: str) -> float:
    number = isinstance(value, int | float | np.floating) and not isinstance(value, bool)
    if not (number and np.isfinite(value)):
        raise _unlike_saved(f"the value is {value!r} [{unit}], it must be a finite number", where)
    if abs(value) > _LARGEST:
        raise _unlike_saved(f"the value is {value:g} [{unit}], more than any axis has", where)
    return float(value)


def _keys(table: Any, names: tuple[str, ...], where: str) -> None:
    """Check that a table has these keys and no others."""
    listed = ", ".join(names)
    if not isinstance(table, Mapping):
        what = f"what was learned is a {type(table).__name__}, it must be a table with the keys"
        raise _unlike_saved(f"{what} {listed}", where)
    for name in names:
        if name not in table:
            raise _unlike_saved(f"the key {name!r} is missing", where)
    for name in table:
        if name not in names:
            remedy = f"the keys are {listed}"
            raise InputError(f"the key {name!r} is unknown", where=where, remedy=remedy)


def _unlike_saved(what: str, where: str) -> InputError:
    return InputError(what, where=where, remedy="give it as it was saved")
