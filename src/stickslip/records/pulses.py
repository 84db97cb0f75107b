"""Pulse control: its pulses, its outcome, and what it has learned."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Literal, get_args

import numpy as np
from jaxtyping import Float

from stickslip.errors import InputError, one_of
from stickslip.records.quantities import (
    QUANTITIES,
    AxisKind,
    quantity_field,
    quantity_name,
    unit_of,
)
from stickslip.records.record import ReadOnlyMapping, Record, Valued

PulseMethod = Literal["pwc", "papwc", "exact", "landing"]

_SCHEMA = 1  # version of the JSON form
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

    method: PulseMethod  #: ``"pwc"``, ``"papwc"``, ``"exact"`` or ``"landing"``.
    kind: AxisKind  #: ``"linear"`` or ``"rotary"``.
    values: Mapping[str, float]  #: By name [SI, the unit that `stickslip.records.unit_of` names].
    #: Covariance from which the recursion resumes, shape (n, n) [of the method]; of least squares
    #: the inverse of the sum of the regressors' squares.
    covariance: Float[np.ndarray, "n n"]

    def __post_init__(self) -> None:
        one_of("method", self.method, get_args(PulseMethod), where="method")
        one_of("kind", self.kind, get_args(AxisKind), where="kind")
        values: dict[str, float] = {}
        for name, value in self.values.items():
            if quantity_name(name) not in QUANTITIES:
                raise InputError("not_learned", where="values", name=name)
            values[name] = _number(value, f"values.{name}", unit_of(name, self.kind))
        object.__setattr__(self, "values", ReadOnlyMapping(values))
        covariance = np.array(self.covariance, dtype=np.float64)
        shape = covariance.shape
        if len(shape) != 2 or shape[0] != shape[1]:
            raise InputError("covariance_not_square", where="covariance", shape=shape)
        if not np.isfinite(covariance).all():
            raise InputError("covariance_not_finite", where="covariance")
        covariance.flags.writeable = False
        object.__setattr__(self, "covariance", covariance)

    def check(
        self, *, method: str, kind: AxisKind, names: tuple[str, ...], size: int | None = None
    ) -> None:
        """Check that it was learned by a method on a kind of axis, and holds what is needed.

        ``names`` are values, ``size`` is that of the covariance. An InputError if not.
        """
        for name, own, needed in (("method", self.method, method), ("kind", self.kind, kind)):
            if own != needed:
                raise InputError(
                    "learned_otherwise", where=name, name=name, own=own, needed=needed, unit=""
                )
        for name in names:
            if name not in self.values:
                raise InputError("learned_lacks", where="values", name=name, needed=names)
        shape = self.covariance.shape
        if size is not None and shape != (size, size):
            raise InputError("covariance_shape", where="covariance", shape=shape, size=size)

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
            raise InputError("other_schema", where="schema", schema=saved["schema"], known=_SCHEMA)
        kind = saved["kind"]
        one_of("kind", kind, get_args(AxisKind), where="kind")
        if not isinstance(saved["values"], Mapping):
            found = type(saved["values"]).__name__
            raise InputError("not_as_saved", where="values", found=found, keys=("value", "unit"))
        values: dict[str, float] = {}
        for name, entry in saved["values"].items():
            where = f"values.{name}"
            _keys(entry, ("value", "unit"), where)
            known = quantity_name(name) in QUANTITIES
            if known and entry["unit"] != unit_of(name, kind):
                raise InputError(
                    "other_unit",
                    where=where,
                    name=name,
                    unit=entry["unit"],
                    kind=kind,
                    needed=unit_of(name, kind),
                )
            values[name] = entry["value"]
        try:
            covariance = np.array(saved["covariance"], dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InputError("covariance_no_numbers", where="covariance") from error
        return cls(method=saved["method"], kind=kind, values=values, covariance=covariance)


def _number(value: Any, where: str, unit: str) -> float:
    if not isinstance(value, int | float | np.floating) or isinstance(value, bool):
        raise InputError("not_a_number", where=where, name="value", value=value, unit=unit)
    if not np.isfinite(value):
        raise InputError("not_finite", where=where, name="value", value=value, unit=unit)
    if abs(value) > _LARGEST:
        raise InputError("saved_value_too_large", where=where, value=value, unit=unit)
    return float(value)


def _keys(table: Any, names: tuple[str, ...], where: str) -> None:
    """Check that a table has these keys and no others."""
    if not isinstance(table, Mapping):
        raise InputError("not_as_saved", where=where, found=type(table).__name__, keys=names)
    for name in names:
        if name not in table:
            raise InputError("key_missing", where=where, key=name, keys=names)
    for name in table:
        if name not in names:
            raise InputError("unknown_key", where=where, key=name, keys=names)
