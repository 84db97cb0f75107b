"""Types of kernel values, and the C structures made of the field definitions of kernel states."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

_PLACE = 8  # bytes of a number in a state vector


_WORDS = """
    auto break case char const continue default do double else enum extern float for
    goto if inline int long register restrict return short signed sizeof static struct
    switch typedef union unsigned void volatile while bool true false real j0 j1 jn y0
    y1 yn
"""
_KEYWORDS = frozenset(_WORDS.split())


def c_name(name: str) -> str:
    """Return a name that is free in C."""
    return f"{name}_" if name in _KEYWORDS else name


class UntranslatableError(Exception):
    """A kernel contains something that the translator does not support: a defect, not bad input."""

    def __init__(self, what: str) -> None:
        super().__init__(what)
        self.what = what
        self.place: tuple[str, int] | None = None

    def __str__(self) -> str:
        """Name the kernel and the line."""
        place = "" if self.place is None else f"{self.place[0]}, line {self.place[1]}: "
        return f"{place}{self.what} cannot be translated to C"


@dataclass(frozen=True)
class Scalar:
    """A number: ``real``, ``int64_t`` or ``bool`` in C."""

    name: str


REAL, INT, BOOL = Scalar("real"), Scalar("int64_t"), Scalar("bool")
NOTHING = Scalar("void")


@dataclass(frozen=True)
class Array:
    """An array of fixed size; ``const`` if it lies in the configuration."""

    dims: tuple[int, ...]
    item: "Scalar | Record"
    const: bool = False


@dataclass(frozen=True)
class Record:
    """A structure, which a kernel changes in place."""

    struct: "Struct"


@dataclass(frozen=True)
class Tuple:
    """A tuple of values; one of values of the same type is an array in C."""

    items: tuple["Type", ...]

    @property
    def alike(self) -> bool:
        """Whether all values are numbers of the same type."""
        return isinstance(self.items[0], Scalar) and len(set(self.items)) == 1

    def member(self, index: str) -> str:
        """Return the C member of a value."""
        return f"v[{index}]" if self.alike else f"v{index}"


@dataclass(frozen=True)
class Vector:
    """A whole state: regions of numbers and of named fields."""

    layout: "Layout"


Type = Scalar | Array | Record | Tuple | Vector


def suffix(kind: Type) -> str:
    """Return a short name of a type, for the names of tuples."""
    if isinstance(kind, Scalar):
        return {"real": "r", "int64_t": "i", "bool": "b"}[kind.name]
    if isinstance(kind, Tuple) and kind.alike:
        return f"t{len(kind.items)}{suffix(kind.items[0])}"
    raise UntranslatableError(f"a tuple with a {kind}")


def item_of(kind: Type) -> Type:
    """Return the type of the items of an array; other types are returned as they are."""
    return kind.item if isinstance(kind, Array) else kind


@dataclass(eq=False)
class Struct:
    """The fields of a record, and which of them the kernels read and write.

    Fields that no kernel writes are the configuration, the others are the state. Each half is a
    structure of its own in C.
    """

    name: str
    fields: dict[str, tuple[int, Type]]  # place in the record, and type
    comments: dict[str, str]
    given: bool = False  # whether it is an argument that the caller owns, which nothing changes
    read: set[str] = field(default_factory=set[str])
    written: set[str] = field(default_factory=set[str])
    settled: bool = False  # whether reads and writes are known
    pins: dict[str, int] = field(default_factory=dict[str, int])  # fields that are constants
    state_only: bool = False  # whether it is a copy of the state half of its fields

    def used(self, half: str) -> list[str]:
        """Return the fields of the ``config`` or ``state`` half, in their order."""
        return [name for name in self.fields if self.in_half(name, half)]

    def in_half(self, name: str, half: str) -> bool:
        """Return whether a field has a part in a half."""
        if name not in self.read | self.written or (self.state_only and half == "config"):
            return False
        inner = item_of(self.fields[name][1])
        if isinstance(inner, Record):
            return bool(inner.struct.used(half))
        if self.given or not self.settled:
            return half == ("config" if self.given else "state")
        return half == ("state" if name in self.written else "config")

    @property
    def halves(self) -> tuple[str, ...]:
        """The halves that have fields."""
        return tuple(half for half in ("config", "state") if self.used(half))

    def write_all(self) -> None:
        """Note that every field is written, and those of its structures."""
        for name, (_, kind) in self.fields.items():
            self.written.add(name)
            inner = item_of(kind)
            if isinstance(inner, Record):
                inner.struct.write_all()


class Structs:
    """The structures of one translation, by their field definitions."""

    def __init__(
        self, names: dict[np.dtype[Any], str], comments: dict[str, dict[str, str]]
    ) -> None:
        self._names = names
        self._comments = comments
        self._made: dict[np.dtype[Any], Struct] = {}

    def of(self, dtype: np.dtype[Any]) -> Struct:
        """Return the structure of a dtype."""
        if dtype not in self._made:
            if dtype not in self._names:
                raise UntranslatableError(f"no name in C is given for the fields {dtype.names}")
            name = self._names[dtype]
            fields = {
                key: (offset // _PLACE, self._type_of(inner))
                for key, (inner, offset, *_) in (dtype.fields or {}).items()
            }
            self._made[dtype] = Struct(name, fields, self._comments.get(name, {}))
        return self._made[dtype]

    def _type_of(self, dtype: np.dtype[Any]) -> Type:
        item: Scalar | Record
        if dtype.base.names is not None:
            item = Record(self.of(dtype.base))
        elif dtype.base.kind == "f":
            item = REAL
        elif dtype.base.kind == "i":
            item = INT
        else:
            raise UntranslatableError(f"fields of type {dtype.base} have no type in C")
        return Array(tuple(dtype.shape), item) if dtype.shape else item

    def __iter__(self) -> Iterator[Struct]:
        """Iterate over structures, inner ones first."""
        done: list[Struct] = []

        def visit(struct: Struct) -> None:
            for _, kind in struct.fields.values():
                inner = item_of(kind)
                if isinstance(inner, Record):
                    visit(inner.struct)
            if struct not in done:
                done.append(struct)

        for struct in self._made.values():
            visit(struct)
        return iter(done)


def given_struct(name: str, fields: tuple[str, ...], comments: dict[str, str]) -> Struct:
    """Return a structure of numbers that the caller fills, such as a sample."""
    return Struct(name, {key: (k, REAL) for k, key in enumerate(fields)}, comments, given=True)


@dataclass(frozen=True, eq=False)
class Flat:
    """Numbers without names of their own: one array of the state."""

    name: str
    start: int
    size: int
    comment: str


@dataclass(eq=False)
class Layout:
    """The parts of a state vector: records from certain places on, and flat arrays."""

    name: str
    size: int
    flats: tuple[Flat, ...]
    records: tuple[tuple[str, int, Struct], ...]  # member, place, structure

    def flat(self, place: int) -> Flat | None:
        """Return the flat part that contains a place; the end of the vector counts to the last."""
        place = min(place, self.size - 1)
        for flat in self.flats:
            if flat.start <= place < flat.start + flat.size:
                return flat
        return None

    def record(self, struct: Struct, start: int) -> str:
        """Return the member that a record at a place is."""
        for member, place, each in self.records:
            if each is struct and place == start:
                return member
        raise UntranslatableError(f"{self.name} has no {struct.name} at place {start}")


_FIELD = re.compile(r'^\s*\("(\w+)",.*?\),\s*#\s*(.*)$')


def field_comments(source: str) -> dict[str, str]:
    """Return the comments beside the fields of a definition in Python, by field name."""
    found: dict[str, str] = {}
    for line in source.splitlines():
        match = _FIELD.match(line)
        if match is not None:
            found[match[1]] = match[2]
    return found
