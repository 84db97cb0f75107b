"""Configuration and first state of a C module, from the first state that Python makes."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.export.c.modules import Module
from stickslip.export.c.translator.types import (
    BOOL,
    INT,
    REAL,
    Array,
    Layout,
    Record,
    Scalar,
    Struct,
    Type,
    UntranslatableError,
    c_name,
)


@dataclass(frozen=True)
class FirstValue:
    """A part of the state that `init` sets from the configuration."""

    member: str  # of the state
    kind: Type
    places: slice  # in the vector

    @property
    def name(self) -> str:
        """Name of the member of the first values."""
        return self.member.replace(".", "_")


def first_values(module: Module) -> tuple[FirstValue, ...]:
    """Return the parts of the state that ``init`` sets."""
    layout = module.layout
    assert layout is not None  # noqa: S101 - a law has no first state
    return tuple(_first_value(layout, path) for path in module.first)


def _first_value(layout: Layout, path: str) -> FirstValue:
    member, *names = path.split(".")
    start, struct = next((s, each) for name, s, each in layout.records if name == member)
    kind: Type = Record(struct)
    for name in names:
        assert isinstance(kind, Record)  # noqa: S101 - only the last name is a number
        offset, kind = kind.struct.fields[name]
        start += offset
    return FirstValue(path, kind, slice(start, start + count(kind)))


def initialiser(kind: Type, numbers: Float[np.ndarray, " n"]) -> str:
    """Return the C initialiser of numbers of a state vector; only the configuration of records."""
    if isinstance(kind, Scalar):
        return number(kind, numbers)
    if isinstance(kind, Array):
        rows = kind.dims[0]
        size = numbers.size // rows
        inner: Type = Array(kind.dims[1:], kind.item) if len(kind.dims) > 1 else kind.item
        parts = [initialiser(inner, numbers[k * size : (k + 1) * size]) for k in range(rows)]
        return f"{{{', '.join(parts)}}}"
    assert isinstance(kind, Record)  # noqa: S101 - no other kind lies in a state
    return f"{{{', '.join(f'.{name} = {text}' for name, text in members(kind.struct, numbers))}}}"


def members(struct: Struct, numbers: Float[np.ndarray, " n"]) -> list[tuple[str, str]]:
    """Return name and initialiser of the fields of a record's configuration."""
    found: list[tuple[str, str]] = []
    for name in struct.used("config"):
        offset, kind = struct.fields[name]
        found.append((c_name(name), initialiser(kind, numbers[offset : offset + count(kind)])))
    return found


def number(kind: Scalar, numbers: Float[np.ndarray, " n"]) -> str:
    """Return a number as C writes it."""
    if kind == INT:
        return str(int(numbers.view(np.int64)[0]))
    value = float(numbers[0])
    if math.isnan(value):
        return "STICKSLIP_NAN"
    if math.isinf(value):
        return "STICKSLIP_INFINITY" if value > 0.0 else "-STICKSLIP_INFINITY"
    return f"STICKSLIP_REAL({value!r})"


def count(kind: Type) -> int:
    """Return how many numbers of a state a type takes."""
    if isinstance(kind, Array):
        return math.prod(kind.dims) * count(kind.item)
    if isinstance(kind, Record):
        return sum(count(each) for _, each in kind.struct.fields.values())
    return 1


def check_first(module: Module, vector: Float[np.ndarray, " s"]) -> None:
    """Check that a first state is zero wherever ``init`` does not set it.

    It raises an `UntranslatableError` if a kernel's state has got a first value of its own that the
    module does not know.
    """
    layout = module.layout
    assert layout is not None  # noqa: S101 - a law has no first state
    left = vector.copy()
    if module.copied:
        copied = _first_value(layout, module.copied)
        if np.any(left[copied.places] != left[: count(copied.kind)]):
            raise UntranslatableError(f"the first state of {module.copied}")
        left[copied.places] = 0.0
    for first in first_values(module):
        left[first.places] = 0.0
    for _, start, struct in layout.records:
        _check_record(struct, left, start)
    for flat in layout.flats:
        if np.any(left[flat.start : flat.start + flat.size]):
            raise UntranslatableError(f"the first state of {layout.name}.{flat.name}")


def _check_record(struct: Struct, left: Any, start: int) -> None:
    for name in struct.used("state"):
        offset, kind = struct.fields[name]
        place = start + offset
        if isinstance(kind, Record):
            _check_record(kind.struct, left, place)
        elif np.any(left[place : place + count(kind)]):
            raise UntranslatableError(f"the first state of {struct.name}.{name}")


def state_bytes(module: Module, half: str, real: int) -> int:
    """Return the size of a half of a module's memory [bytes], with reals of so many bytes."""
    layout = module.layout
    if layout is None:
        assert module.record is not None  # noqa: S101 - the law has a record
        return _bytes(Record(module.record), half, real)
    total = sum(_bytes(Record(struct), half, real) for _, _, struct in layout.records)
    if half == "state":
        return total + real * sum(flat.size for flat in layout.flats)
    return total + sum(_bytes(each.kind, half, real) for each in first_values(module))


def _bytes(kind: Type, half: str, real: int) -> int:
    if isinstance(kind, Array):
        return math.prod(kind.dims) * _bytes(kind.item, half, real)
    if isinstance(kind, Record):
        struct = kind.struct
        return sum(_bytes(struct.fields[name][1], half, real) for name in struct.used(half))
    return {REAL: real, INT: 8, BOOL: 1}[kind]  # type: ignore[index]
