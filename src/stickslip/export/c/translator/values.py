"""Values of C expressions: code, type, and what is known of them when the code is written."""

import math
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

from stickslip.export.c.translator.types import (
    BOOL,
    INT,
    REAL,
    Array,
    Record,
    Scalar,
    Type,
    UntranslatableError,
    c_name,
)

ATOM, UNARY, MUL, ADD, SHIFT, REL, EQ, BAND, BOR, AND, OR, COND = (
    16, 15, 13, 12, 11, 10, 9, 8, 6, 5, 4, 3
)  # fmt: skip
"""Precedence of operators in C, the strongest first."""

Origin = tuple[str, object, str]
"""Where the memory of an array is: ``("field", struct, name)``, ``("flat", layout, name)``,
``("parameter", None, name)`` or ``("local", None, name)``."""


@dataclass(frozen=True)
class Place:
    """A whole number as a constant and a rest: ``vector[place]`` asks which region that is.

    ``region`` is the first place of the region that a variable counts from, if it does.
    """

    constant: int
    rest: "Value | None"
    region: int | None = None


@dataclass(frozen=True)
class Value:
    """A value. ``config`` is the second pointer of a record or state, to its configuration."""

    type: Type
    code: str
    rank: int = ATOM
    config: str = ""
    const: bool | int | float | None = None
    place: Place | None = None
    origins: frozenset[Origin] = frozenset()
    impure: bool = False

    def within(self, rank: int, *, right: bool = False) -> str:
        """Return the code as an operand of an operator of a rank."""
        weak = self.rank <= rank if right else self.rank < rank
        return f"({self.code})" if weak else self.code


def constant(value: bool | int | float) -> Value:
    """Return a constant."""
    if isinstance(value, bool):
        return Value(BOOL, "true" if value else "false", const=value)
    if isinstance(value, int):
        rank = ATOM if value >= 0 else UNARY
        return Value(INT, str(value), rank, const=value, place=Place(value, None))
    return Value(REAL, _literal(float(value)), const=float(value))


def _literal(value: float) -> str:
    if math.isnan(value):
        return "REAL_NAN"
    if math.isinf(value):
        return "REAL_INFINITY" if value > 0.0 else "(-REAL_INFINITY)"
    return f"REAL({value!r})"


def unified(first: Type, second: Type) -> Type:
    """Return the type that holds values of both."""
    if first == second:
        return first
    order: list[Type] = [BOOL, INT, REAL]
    if first in order and second in order:
        return order[max(order.index(first), order.index(second))]
    raise UntranslatableError(f"a value is a {first} and a {second}")


def common_type(values: list[Value]) -> Type:
    """Return the type that holds all of some values."""
    return reduce(unified, (value.type for value in values))


def cast(value: Value, to: Type) -> Value:
    """Return a value as another type."""
    if value.type == to or not isinstance(to, Scalar) or not isinstance(value.type, Scalar):
        if value.type == to or (isinstance(to, Array) and isinstance(value.type, Array)):
            return value
        raise UntranslatableError(f"{value.code} is a {value.type} and not a {to}")
    if value.const is not None and (to != INT or float(value.const).is_integer()):
        return constant({REAL: float, INT: int, BOOL: bool}[to](value.const))
    if to == BOOL:
        return replace(comparison("!=", value, cast(constant(0), value.type)), impure=value.impure)
    if value.type == BOOL:
        one, zero = cast(constant(1), to), cast(constant(0), to)
        code = f"{value.within(COND, right=True)} ? {one.code} : {zero.code}"
        return Value(to, code, COND, impure=value.impure)
    name = "real" if to == REAL else "int64_t"
    return Value(to, f"({name}){value.within(UNARY)}", UNARY, impure=value.impure)


def arithmetic(operator: str, left: Value, right: Value) -> Value:
    """Return a sum, difference or product."""
    kind = unified(unified(left.type, right.type), INT)
    left, right = cast(left, kind), cast(right, kind)
    if left.const is not None and right.const is not None:
        a, b = left.const, right.const
        return constant({"+": a + b, "-": a - b, "*": a * b}[operator])
    impure = left.impure or right.impure
    if kind == INT and operator in "+-":
        return _sum(left, right, 1 if operator == "+" else -1)
    rank = MUL if operator == "*" else ADD
    code = f"{left.within(rank)} {operator} {right.within(rank, right=True)}"
    return Value(kind, code, rank, impure=impure)


def _sum(left: Value, right: Value, sign: int) -> Value:
    """Return a sum of whole numbers, with its constant part known."""
    a = left.place or Place(0, left)
    b = right.place or Place(0, right)
    region = a.region if a.region is not None else b.region
    if a.region is not None and b.region is not None:
        raise UntranslatableError("two places in a state are added")
    rest = a.rest
    if b.rest is not None:
        if rest is not None:
            operator = "+" if sign > 0 else "-"
            code = f"{rest.within(ADD)} {operator} {b.rest.within(ADD, right=True)}"
            rest = Value(INT, code, ADD, impure=rest.impure or b.rest.impure)
        elif sign > 0:
            rest = b.rest
        else:
            rest = Value(INT, f"-{b.rest.within(UNARY)}", UNARY, impure=b.rest.impure)
    return at_place(Place(a.constant + sign * b.constant, rest, region))


def at_place(place: Place) -> Value:
    """Return the whole number that a constant and a rest are."""
    if place.rest is None:
        return replace(constant(place.constant), place=place)
    rest = place.rest
    if place.constant == 0:
        return replace(rest, place=place)
    operator = "+" if place.constant > 0 else "-"
    code = f"{rest.within(ADD)} {operator} {abs(place.constant)}"
    return Value(INT, code, ADD, place=place, impure=rest.impure)


def quotient(left: Value, right: Value) -> Value:
    """Return a true quotient."""
    left, right = cast(left, REAL), cast(right, REAL)
    if left.const is not None and right.const is not None and right.const:
        return constant(float(left.const) / float(right.const))
    code = f"{left.within(MUL)} / {right.within(MUL, right=True)}"
    return Value(REAL, code, MUL, impure=left.impure or right.impure)


def comparison(operator: str, left: Value, right: Value) -> Value:
    """Return a comparison of numbers."""
    kind = unified(left.type, right.type)
    left, right = cast(left, kind), cast(right, kind)
    if left.const is not None and right.const is not None:
        a, b = left.const, right.const
        found = {
            "<": a < b, "<=": a <= b, ">": a > b, ">=": a >= b, "==": a == b, "!=": a != b
        }  # fmt: skip
        return constant(found[operator])
    rank = EQ if operator in ("==", "!=") else REL
    code = f"{left.within(rank, right=True)} {operator} {right.within(rank, right=True)}"
    return Value(BOOL, code, rank, impure=left.impure or right.impure)


def python_of(function: Any) -> Any:
    """Return the Python function of a compiled kernel; other objects are returned as they are."""
    return getattr(function, "py_func", function)


def field_of(pointer: str, name: str) -> str:
    """Return a member of what a pointer points to."""
    name = c_name(name)
    return f"{pointer[1:]}.{name}" if pointer.startswith("&") else f"{pointer}->{name}"


def element(value: Value, indices: list[Value]) -> Value:
    """Return an element, or a row, of an array."""
    kind = value.type
    if not isinstance(kind, Array) or len(indices) > len(kind.dims):
        raise UntranslatableError(f"{value.code} has no element with {len(indices)} indices")
    for size, index in zip(kind.dims, indices, strict=False):
        if index.type != INT:
            raise UntranslatableError(f"an index of {value.code} is no whole number")
        if index.const is not None and not 0 <= index.const < size:
            raise UntranslatableError(f"{value.code} has no place {index.const}")
    at = "".join(f"[{index.code}]" for index in indices)
    rest = kind.dims[len(indices) :]
    inner: Type = replace(kind, dims=rest) if rest else kind.item
    if isinstance(inner, Record):
        state = f"&{value.code}{at}" if value.code else ""
        config = f"&{value.config}{at}" if value.config else ""
        return Value(inner, state, config=config)
    return Value(inner, f"{value.within(ATOM)}{at}", origins=value.origins)
