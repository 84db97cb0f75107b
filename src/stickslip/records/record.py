"""The base of records: read-only mappings, equality, a JSON form, and outcomes in words."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import fields
from enum import Enum
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, TypeVar

import numpy as np

Key = TypeVar("Key")
Value = TypeVar("Value")


class ReadOnlyMapping(Mapping[Key, Value]):
    """Read-only copy of a mapping, its items in their order.

    Examples
    --------
    >>> options = ReadOnlyMapping({"offset": True})
    >>> options | {"cutoff": None}
    {'offset': True, 'cutoff': None}
    """

    __slots__ = ("_values",)

    def __init__(self, values: Mapping[Key, Value]) -> None:
        self._values = dict(values)

    def __getitem__(self, key: Key) -> Value:
        return self._values[key]

    def __iter__(self) -> Iterator[Key]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __or__(self, other: Mapping[Key, Value]) -> dict[Key, Value]:
        return {**self._values, **other}

    def __ror__(self, other: Mapping[Key, Value]) -> dict[Key, Value]:
        return {**other, **self._values}

    def __repr__(self) -> str:
        return f"ReadOnlyMapping({self._values!r})"


JsonForm = tuple["str | Mapping[str, JsonForm]", ...]
"""Keys of a JSON document in their order, separated by spaces: ``key`` for the attribute of that
name, ``key=path`` for another, such as ``fit=resimulation.fit``; a mapping for tables within it."""


class Valued(NamedTuple):
    """A plain value with its unit."""

    value: Any
    unit: str


ScenarioTables = Mapping[str, Mapping[str, tuple[Any, str]]]
"""Contents of a scenario by table and key, each a plain value with its unit."""


def valued_tables(tables: ScenarioTables) -> dict[str, dict[str, Valued]]:
    """Return the contents of a scenario with each value as `Valued`."""
    return {
        name: {key: Valued(*pair) for key, pair in table.items()} for name, table in tables.items()
    }


class Comparable:
    """Base of the dataclasses that are equal if their contents are.

    Arrays are equal if all elements are, and so are missing numbers (NaN). A record with arrays or
    mappings has no hash.
    """

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        # Otherwise each dataclass has methods of its own, which cannot compare arrays
        cls.__eq__ = Comparable.__eq__
        cls.__hash__ = Comparable.__hash__

    def __eq__(self, other: object) -> bool:
        """Return whether another record is of the same class and has the same contents."""
        if other.__class__ is not self.__class__:
            return NotImplemented
        return self is other or _same(_contents(self), _contents(other))

    def __hash__(self) -> int:
        """Return the hash of the contents, if all of them have one."""
        return hash(_with_one_nan(_contents(self)))


def _contents(record: Any) -> tuple[Any, ...]:
    return tuple(getattr(record, field.name) for field in fields(record) if field.compare)


def _same(one: Any, other: Any) -> bool:
    """Return whether two values are equal, arrays element by element."""
    match one:
        case np.ndarray():
            numbers = one.dtype.kind in "fc"
            same = isinstance(other, np.ndarray) and np.array_equal(one, other, equal_nan=numbers)
        case Mapping():
            same = isinstance(other, Mapping) and one.keys() == other.keys()
            same = same and all(_same(value, other[key]) for key, value in one.items())
        case tuple() | list():
            same = type(one) is type(other) and len(one) == len(other)
            same = same and all(map(_same, one, other))
        case float() if math.isnan(one):
            same = isinstance(other, float) and math.isnan(other)
        case _:
            same = bool(one == other)
    return same


def _with_one_nan(value: Any) -> Any:
    """Return a value with the same object, and so the same hash, for every missing number."""
    if isinstance(value, tuple):
        return tuple(map(_with_one_nan, value))
    return math.nan if isinstance(value, float) and math.isnan(value) else value


class Exportable(Comparable):
    """Base of results with a method ``to_NAME`` for each target of `stickslip.export.targets`.

    ``estimate.to_urdf("arm.urdf", into="arm.urdf", joint="elbow")`` is
    ``stickslip.export.write(estimate, "urdf", ...)``.
    """

    if not TYPE_CHECKING:  # every other attribute is checked

        def __getattr__(self, name: str) -> Any:
            if name.startswith("to_"):  # records are a leaf: loaded by name, when it is asked for
                return import_module("stickslip.export.writing").method_of(self, name)
            raise AttributeError(f"{type(self).__name__!r} has no attribute {name!r}")

        def __dir__(self) -> list[str]:
            export = import_module("stickslip.export.writing")
            return [*super().__dir__(), *export.method_names()]


class Record(Comparable):
    """Base of the dataclasses that have a JSON form.

    Their mappings become read-only copies. ``json_form`` lists the keys of the JSON form; if it is
    empty, they are all fields.
    """

    json_form: ClassVar[JsonForm] = ()

    def __post_init__(self) -> None:
        for field in fields(self):  # pyright: ignore[reportArgumentType] - of a dataclass
            value = getattr(self, field.name)
            if isinstance(value, Mapping):
                object.__setattr__(self, field.name, _read_only(value))

    def to_dict(self) -> dict[str, Any]:
        """Return the record as plain JSON types: numbers, text, lists and dictionaries."""
        names = [field.name for field in fields(self)]  # pyright: ignore[reportArgumentType]
        return _table(self, self.json_form or tuple(names))


def plain(value: Any) -> Any:
    """Return a record, or a value within one, as plain JSON types.

    A record becomes a dictionary of its fields in their order, a sequence or an array a list.
    """
    match value:
        case Record():
            value = value.to_dict()
        case Mapping():
            value = {name: plain(each) for name, each in value.items()}
        case Valued():
            value = {"value": plain(value.value), "unit": value.unit}
        case tuple() | list():
            value = [plain(each) for each in value]
        case Enum():
            value = value.value
        case np.ndarray():
            value = value.tolist()
        case _:
            pass
    return value


def _table(record: Record, form: JsonForm) -> dict[str, Any]:
    table: dict[str, Any] = {}
    for each in form:
        if isinstance(each, Mapping):
            table |= {key: _table(record, inner) for key, inner in each.items()}
            continue
        for key, _, path in (item.partition("=") for item in each.split()):
            value: Any = record
            for name in (path or key).split("."):
                value = None if value is None else getattr(value, name)
            table[key] = plain(value)
    return table


def _read_only(values: Mapping[Any, Any]) -> ReadOnlyMapping[Any, Any]:
    return ReadOnlyMapping(
        {
            key: _read_only(each) if isinstance(each, Mapping) else each
            for key, each in values.items()
        }
    )


class Worded(Enum):
    """Base of enumerations of outcomes: each member is a value, a heading and a sentence."""

    word: str  #: Heading of a few words.
    text: str  #: One sentence on what it means and what to do.

    def __new__(cls, value: str, word: str, text: str) -> "Worded":
        """Return a member whose value is the first of the three."""
        member = object.__new__(cls)
        member._value_ = value
        member.word, member.text = word, text
        return member
