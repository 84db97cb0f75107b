"""Tables of a scenario: strict models whose keys declare meaning, unit, range and default."""

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from stickslip.input_files import not_a_table, read_toml, unknown_key, wrong_value
from stickslip.records import QUANTITIES, AxisKind, InputError

T = TypeVar("T", bound="Table")
S = TypeVar("S")
Units = tuple[str, str]
Check = Callable[[str, Any, str], object]
_GUIDE = "docs/reference/scenario.md"


@dataclass(frozen=True)
class Key:
    """Declaration of a key, in the annotation of its field."""

    meaning: str  # one line for the reference
    unit: str | Units = ""  # name of a quantity, or the units on a linear and on a rotary axis
    check: Check | None = None  # such as `positive`; takes name, value and unit
    says: str = ""  # the default in words, where the field's default does not state it

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
    check: Check | None = None,
    *,
    says: str = "",
    default: Any = None,
) -> Any:
    """Declare a field by its `Key`, with a default."""
    extra: Any = {"key": Key(meaning, unit, check, says)}
    return Field(default, json_schema_extra=extra)


required = partial(key, default=...)
"""Declare a field by its `Key`, without a default."""


class ScenarioError(InputError):
    """A scenario contradicts itself; names of settings in the message are its keys."""

    keys = True


class Table(BaseModel):
    """A table of a scenario. Unknown keys, text for numbers and values out of range are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
    shows_defaults: ClassVar[bool] = True  # whether `shown` returns keys that were not given
    alternative: ClassVar[str] = ""  # key that may be given in place of a missing one

    @classmethod
    def declared(cls) -> dict[str, Key]:
        """Return the declaration of each key."""
        fields: dict[str, Any] = {**cls.model_fields}
        return {name: field.json_schema_extra["key"] for name, field in fields.items()}

    @model_validator(mode="after")
    def _check_range(self, info: Any) -> "Table":
        for name, each in type(self).declared().items():
            value = getattr(self, name)
            if each.check is not None and value is not None:
                each.check(name, value, each.unit_on(kind_in(info)))
        return self

    def given(self) -> dict[str, Any]:
        """Return the keys that were given."""
        names = [name for name in type(self).model_fields if name in self.model_fields_set]
        return {name: value for name in names if (value := getattr(self, name)) is not None}

    def shown(self, kind: AxisKind) -> dict[str, tuple[Any, str]]:
        """Return the values with their units, ``kind`` first, for the results of a scenario."""
        values: dict[str, tuple[Any, str]] = {}
        for name, each in sorted(type(self).declared().items(), key=lambda pair: pair[0] != "kind"):
            value = getattr(self, name)
            always = self.shows_defaults or name == "kind"
            if value is not None and (always or name in self.model_fields_set):
                plain = list(value) if isinstance(value, tuple) else value
                values[name] = (plain, each.unit_on(kind))
        return values


@dataclass(frozen=True)
class Variants(Generic[T]):
    """A table of one of several models, chosen by the value of one key: a discriminated union."""

    key: str
    default: str  # value of the key if it is absent
    models: Mapping[str, type[T]]  # by the value of the key
    where: str = ""  # the axis that these models are for, such as "a rigid axis"
    others: Mapping[str, type[Table]] | None = None  # models of the same table for other axes

    def chosen(self, values: Mapping[str, Any]) -> tuple[str, type[T]]:
        """Return the value of the key, and the model that it names."""
        name = values.get(self.key, self.default)
        if not isinstance(name, str) or name not in self.models:
            raise InputError("not_a_choice", name=self.key, value=name, choices=tuple(self.models))
        return name, self.models[name]

    def unused(self, key: str, value: object, name: str) -> InputError | None:
        """Return the refusal of a key that only other models have; None if none has it."""
        users = [other for other, model in self.models.items() if key in model.model_fields]
        others = self.others or {}
        same = name in others and key in others[name].model_fields
        if not users and not any(key in model.model_fields for model in others.values()):
            return None
        return InputError(
            "unused_key",
            name=key,
            value=value,
            tag=self.key,
            tag_value=name,
            axis=self.where if same else "",
            users=users,
        )


def kind_in(info: Any) -> AxisKind:
    """Return the kind of axis that a table is read for, from pydantic's information.

    Its type is a protocol that the tests cannot check at run time.
    """
    return (info.context or {}).get("kind", "linear")


def table_from(of: type[T] | Variants[T], values: Any, *, name: str, kind: AxisKind) -> T:
    """Validate the values of a table by its model, or by the one of several that they choose.

    ``name`` is that of the table, and ``kind``, ``"linear"`` or ``"rotary"``, decides the units in
    messages. An unknown or missing key, a wrong type and a value out of its range are errors.
    """
    if not isinstance(values, Mapping):
        raise not_a_table(name, values)
    try:
        if isinstance(of, Variants):
            variants, (tag, model) = of, of.chosen(values)
            values = {of.key: tag, **values}
        else:
            variants, tag, model = None, "", of
        # As JSON, so that types are taken strictly: no numbers in quotes, no true for 1
        text = json.dumps(values, default=str)
        try:
            return model.model_validate_json(text, strict=True, context={"kind": kind})
        except ValidationError as error:
            raise _refusal(error, model, variants, tag, kind) from None
    except InputError as error:
        raise error.at(f"[{name}]", keys=True) if name else error from None


def _refusal(
    error: ValidationError,
    model: type[Table],
    variants: Variants[Any] | None,
    tag: str,
    kind: AxisKind,
) -> InputError:
    faults = error.errors()
    # A mistyped name is also a missing one: the name that is there is of more help
    fault = next((each for each in faults if each["type"] == "extra_forbidden"), faults[0])
    own = fault.get("ctx", {}).get("error")
    if isinstance(own, InputError):
        return own.on(kind)
    key = str(fault["loc"][-1])
    if fault["type"] == "extra_forbidden":
        unused = None if variants is None else variants.unused(key, fault["input"], tag)
        return unused or unknown_key(key, model.model_fields)
    if fault["type"] == "missing":
        every = () if variants is None else variants.models.values()
        return InputError(
            "missing_key",
            name=key,
            unit=model.declared()[key].unit_on(kind),
            tag="" if variants is None else variants.key,
            tag_value=tag,
            particular=not all(key in each.model_fields for each in every),
            alternative=model.alternative,
        )
    return wrong_value(key, fault, _GUIDE)


_OTHER_FILES = (
    ("task", "a positioning task", "stickslip position"),
    ("input", "a scenario to compare estimators on", "stickslip compare"),
    ("effort", "a schema, which says how a log is read", "--schema, beside the log"),
    ("axes", "a schema, which says how a log is read", "--schema, beside the log"),
)
"""A key of files of one sort only, what they are, and where they go."""


class Document:
    """The tables of a scenario file, each to be validated by its model.

    ``head`` is the model of the keys before the first table, which is read as the table ``""``. A
    file for something else and an unknown table are errors.
    """

    def __init__(self, path: Path, head: type[Table], tables: tuple[str, ...]) -> None:
        self.path = path
        self._values = values = read_toml(path, what="scenario", line="mass = 150.0")
        known = (*head.model_fields, *tables)
        if not any(key in known and key in values for key, _, _ in _OTHER_FILES):
            for key, what, where_to in _OTHER_FILES:
                if key in values and key not in known:
                    raise InputError("other_file", where=str(path), found=what, place=where_to)
        for key in values:
            if key not in known:
                raise unknown_key(key, known).at(str(path))
        values[""] = {name: values[name] for name in head.model_fields if name in values}
        self._kind: AxisKind = "rotary" if self.raw("axis").get("kind") == "rotary" else "linear"
        self.sha256 = hashlib.sha256(path.read_bytes()).hexdigest()

    def raw(self, name: str) -> Mapping[str, Any]:
        """Return a table as it stands in the file; empty if it is missing or no table."""
        values = self._values.get(name)
        return values if isinstance(values, Mapping) else {}

    def table(self, name: str, of: type[T] | Variants[T], *, optional: bool = False) -> T:
        """Return a table."""
        if not optional and name not in self._values:
            raise InputError("table_missing", where=str(self.path), table=name)
        try:
            return table_from(of, self._values.get(name, {}), name=name, kind=self._kind)
        except InputError as error:
            raise error.at(str(self.path), keys=True) from None


@dataclass(frozen=True, kw_only=True)
class Read(Generic[S]):
    """A scenario with its file."""

    scenario: S
    title: str | None  # None for the file's name
    path: Path  # other files that it names are relative to its folder
    sha256: str  # of its bytes

    @property
    def name(self) -> str:
        """Title, or the file's name in words."""
        return self.title or self.path.stem.replace("_", " ").replace("-", " ")
