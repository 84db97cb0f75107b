"""Tables of a scenario: strict models whose keys declare meaning, unit, range and default."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, Generic, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from stickslip.input_files import not_a_table, unknown_key, wrong_value
from stickslip.records import QUANTITIES, AxisKind, InputError, in_units_of

__all__ = ["Key", "Table", "Variants", "key", "required", "table_from", "with_units_of"]

T = TypeVar("T", bound="Table")
Units = tuple[str, str]
_GUIDE = "see scenario keys in the reference"


@dataclass(frozen=True)
class Key:
    """Declaration of a key, in the annotation of its field.

    Attributes
    ----------
    meaning
        One line for the reference.
    unit
        Name of a quantity, or the units on a linear and on a rotary axis; empty for none.
    check
        Check of the value, such as `stickslip.records.positive`, which takes name, value and unit.
    says
        The default in words, where the field's default does not say it.
    """

    meaning: str
    unit: str | Units = ""
    check: Callable[[str, Any, str], object] | None = None
    says: str = ""

    @property
    def units(self) -> Units:
        """Unit on a linear and on a rotary axis."""
        if isinstance(self.unit, tuple):
            return self.unit
        quantity = QUANTITIES.get(self.unit)
        return ("", "") if quantity is None else (quantity.linear, quantity.rotary)

    def unit_on(self, kind: AxisKind) -> str:
        """Return the unit on a kind of axis."""
        return self.units[kind == "rotary"]


def key(
    meaning: str,
    unit: str | Units = "",
    check: Callable[[str, Any, str], object] | None = None,
    *,
    says: str = "",
    default: Any = None,
) -> Any:
    """Declare a field by its `Key`, with a default."""
    extra: Any = {"key": Key(meaning, unit, check, says)}
    return Field(default, json_schema_extra=extra)


required = partial(key, default=...)
"""Declare a field by its `Key`, without a default."""


class Table(BaseModel):
    """A table of a scenario. Unknown keys, text for numbers and values out of range are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    shows_defaults: ClassVar[bool] = True
    """Whether `shown` returns keys that were not given."""

    alternative: ClassVar[str] = ""
    """What can be given in place of a missing key."""

    @classmethod
    def declared(cls) -> dict[str, Key]:
        """Return the declaration of each key."""
        extras: dict[str, Any] = {
            name: field.json_schema_extra for name, field in cls.model_fields.items()
        }
        return {name: extra["key"] for name, extra in extras.items()}

    @model_validator(mode="after")
    def _check_range(self, info: Any) -> "Table":
        for name, each in type(self).declared().items():
            value = getattr(self, name)
            if each.check is not None and value is not None:
                each.check(name, value, each.unit_on(kind_in(info)))
        return self

    def given(self) -> dict[str, Any]:
        """Return the keys that were given."""
        return {
            name: value
            for name in type(self).model_fields
            if name in self.model_fields_set and (value := getattr(self, name)) is not None
        }

    def shown(self, kind: AxisKind) -> dict[str, tuple[Any, str]]:
        """Return the values with their units, ``kind`` first, for the results of a scenario."""
        values: dict[str, tuple[Any, str]] = {}
        declared = type(self).declared()
        for name, each in sorted(declared.items(), key=lambda pair: pair[0] != "kind"):
            value = getattr(self, name)
            always = self.shows_defaults or name == "kind"
            if value is not None and (always or name in self.model_fields_set):
                plain = list(value) if isinstance(value, tuple) else value
                values[name] = (plain, each.unit_on(kind))
        return values


@dataclass(frozen=True)
class Variants(Generic[T]):
    """A table of one of several models, chosen by the value of one key: a discriminated union.

    Attributes
    ----------
    key
        The key whose value names the model.
    default
        Its value where it is not given.
    models
        By that value.
    where
        On what these are the models, such as ``"a rigid axis"``; may be empty.
    others
        Models of the same table elsewhere, by the value of the key.
    """

    key: str
    default: str
    models: Mapping[str, type[T]]
    where: str = ""
    others: Mapping[str, type[Table]] | None = None

    def chosen(self, values: Mapping[str, Any]) -> tuple[str, type[T]]:
        """Return the value of the key, and the model that it names."""
        name = values.get(self.key, self.default)
        if not isinstance(name, str) or name not in self.models:
            raise InputError(
                f"{self.key} is {name!r}, it must be one of {', '.join(map(repr, self.models))}",
                remedy=_GUIDE,
            )
        return name, self.models[name]

    def unused(self, key: str, value: object, name: str) -> InputError | None:
        """Return the refusal of a key that only other models have; None if none has it."""
        users = [other for other, model in self.models.items() if key in model.model_fields]
        others = self.others or {}
        same = name in others and key in others[name].model_fields
        if not users and not any(key in model.model_fields for model in others.values()):
            return None
        choices = " or ".join(map(repr, users))
        shown = f"{value:g}" if isinstance(value, float) else repr(value)
        return InputError(
            f"{key} is {shown}, and {self.key} {name!r} has no use for it"
            + (f" on {self.where}" if same else ""),
            remedy="leave it out" + (f", or use {self.key} {choices}" if users else ""),
        )


def kind_in(info: Any) -> AxisKind:
    """Return the kind of axis that a table is read for, from pydantic's information.

    Its type is a protocol that the tests cannot check at run time.
    """
    return (info.context or {}).get("kind", "linear")


def with_units_of(kind: AxisKind, error: InputError) -> InputError:
    """Return an error with the units of one kind of axis where it names those of both."""
    what, remedy = in_units_of(kind, error.what), in_units_of(kind, error.remedy)
    return InputError(what, where=error.where, remedy=remedy)


def table_from(of: type[T] | Variants[T], values: Any, *, name: str, kind: AxisKind) -> T:
    """Return a table.

    Parameters
    ----------
    of
        Its model, or the models to choose from.
    values
        What the file says of it.
    name
        The table's name.
    kind
        ``"linear"`` or ``"rotary"``, for the units in messages.

    Raises
    ------
    InputError
        If a key is unknown or missing, or a value is of the wrong type or out of its range.
    """
    if not isinstance(values, Mapping):
        raise not_a_table(name, values)
    try:
        if not isinstance(of, Variants):
            return _validated(of, values, kind)
        tag, model = of.chosen(values)
        return _validated(model, {of.key: tag, **values}, kind, variants=of)
    except InputError as error:
        raise error.at(f"[{name}]") if name else error from None


def _validated(
    model: type[T], values: Mapping[str, Any], kind: AxisKind, variants: Variants[T] | None = None
) -> T:
    # As JSON, so that types are taken strictly: no numbers in quotes, no true for 1
    text = json.dumps(values, default=str)
    try:
        return model.model_validate_json(text, strict=True, context={"kind": kind})
    except ValidationError as error:
        tag = "" if variants is None else values[variants.key]
        raise _refusal(error, model, variants, tag, kind) from None


def _refusal(
    error: ValidationError,
    model: type[Table],
    variants: Variants[Any] | None,
    tag: str,
    kind: AxisKind,
) -> InputError:
    faults = error.errors()
    # A name that is mistyped is also missing: the one that is there says more
    fault = next((each for each in faults if each["type"] == "extra_forbidden"), faults[0])
    own = fault.get("ctx", {}).get("error")
    if isinstance(own, InputError):
        return with_units_of(kind, own)
    key = str(fault["loc"][-1])
    if fault["type"] == "extra_forbidden":
        unused = None if variants is None else variants.unused(key, fault["input"], tag)
        return unused or unknown_key(key, model.model_fields)
    if fault["type"] == "missing":
        unit = model.declared()[key].unit_on(kind)
        own_key = variants is not None and not all(
            key in each.model_fields for each in variants.models.values()
        )
        needs = f", and {variants.key} {tag!r} needs it" if variants and own_key else ""
        within = f", in {unit}" if unit else ""
        return InputError(
            f"{key} is missing{needs}", remedy=f"give it there{within}{model.alternative}"
        )
    return wrong_value(key, fault, _GUIDE)
