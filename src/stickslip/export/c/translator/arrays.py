"""Translation of arrays of fixed size: new ones, copies and slices."""

import ast
from dataclasses import replace
from typing import Any

import numpy as np

from stickslip.export.c.translator.expressions import Expressions
from stickslip.export.c.translator.types import (
    INT,
    REAL,
    Array,
    Record,
    Scalar,
    Tuple,
    Type,
    UntranslatableError,
    Vector,
    c_name,
)
from stickslip.export.c.translator.values import (
    Place,
    Value,
    at_place,
    cast,
    common_type,
    constant,
    element,
)


def has_slice(node: ast.expr) -> bool:
    """Return whether a subscript has a slice."""
    if not isinstance(node, ast.Subscript):
        return False
    parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
    return any(isinstance(part, ast.Slice) for part in parts)


def _item_of(node: ast.Call) -> Scalar:
    """Return the type of the items of a new array: the only dtype that kernels give is of flags."""
    return INT if node.keywords or len(node.args) > 1 else REAL


class Arrays(Expressions):
    """Translation of the arrays of one function."""

    def __init__(self) -> None:
        self.types: dict[str, Type] = {}
        self.stored: set[str] = set()  # arrays that are the function's own
        self.lines: list[str] = []
        self.depth = 1
        self.scratch = 0
        self.in_place = False

    def emit(self, text: str) -> None:
        """Write a line."""
        self.lines.append("    " * self.depth + text)

    def _held(self, value: Value) -> Value:
        """Return a value that no later statement changes."""
        if value.const is not None or isinstance(value.type, Record):
            return value
        if isinstance(value.type, Tuple) and value.code.isidentifier():
            return value
        if isinstance(value.type, Array):
            raise UntranslatableError(f"{value.code}: arrays are assigned one by one")
        self.scratch += 1
        name = f"t{self.scratch}"
        self.emit(f"const {self.unit.declared(value.type, name)} = {value.code};")
        return replace(value, code=name, rank=16, impure=False, place=None)

    def _new_array(self, name: str, source: ast.expr) -> bool:  # noqa: PLR0911
        """Translate ``name = np.empty(...)``, a copy or a tuple; return whether it is one."""
        before = self.names.get(name)
        if isinstance(source, ast.Tuple) and before and isinstance(before.type, Tuple):
            return False  # a tuple that changes as a whole
        if isinstance(source, ast.Tuple):
            values = self.items_of(source)
            if all(isinstance(value.type, Tuple) for value in values):
                self._rows_of_tuples(name, values)
                return True
            kind = common_type(values)
            if not isinstance(kind, Scalar):
                raise UntranslatableError(f"{name} is a tuple of a {kind}")
            self._store(name, Array((len(values),), kind))
            for k, value in enumerate(values):
                self.emit(f"{c_name(name)}[{k}] = {cast(value, kind).code};")
            return True
        if not isinstance(source, ast.Call):
            return False
        function = self.known(source.func)
        if function in (np.empty, np.zeros, np.ones):
            dims = self._dims(source.args[0])
            self._store(name, Array(dims, _item_of(source)))
            if function is not np.empty:
                first = 0.0 if function is np.zeros else 1.0
                self._fill(self.names[name], (), constant(first))
            return True
        if isinstance(source.func, ast.Attribute) and source.func.attr == "copy":
            value = self.value(source.func.value)
            if isinstance(value.type, Vector):
                if not self.in_place:
                    raise UntranslatableError("a copy of the state")
                self.names[name] = value
                return True
            if isinstance(value.type, Array):
                self._store(name, replace(value.type, const=False))
                self._fill(self.names[name], (), value)
                return True
        return False

    def _rows_of_tuples(self, name: str, values: list[Value]) -> None:
        """Make a table of calls that each return a row."""
        first = values[0].type
        assert isinstance(first, Tuple)  # noqa: S101 - as the caller has found
        if any(value.type != first for value in values) or set(first.items) != {REAL}:
            raise UntranslatableError(f"{name} has rows of different types")
        self._store(name, Array((len(values), len(first.items)), REAL))
        for k, value in enumerate(values):
            held = self._held(value)
            for j in range(len(first.items)):
                self.emit(f"{c_name(name)}[{k}][{j}] = {held.code}.{first.member(str(j))};")

    def scratch_array(self, node: ast.Call) -> Value:
        """Return a new array that has no name in Python."""
        kind = Array(self._dims(node.args[0]), _item_of(node))
        if kind.dims == (0,):
            return Value(kind, "")
        self.scratch += 1
        self.emit(f"{self.unit.declared(kind, f't{self.scratch}')};")
        return Value(kind, f"t{self.scratch}")

    def _Subscript(self, node: ast.Subscript) -> Value:  # noqa: N802
        """Return an element, or a part of a tuple."""
        if not isinstance(node.slice, ast.Slice):
            return super()._Subscript(node)
        values = self.unpacked(self._held(self.value(node.value)))
        ends = (node.slice.lower, node.slice.upper)
        bounds = [None if end is None else self.value(end).const for end in ends]
        if node.slice.step or any(b is None and e for b, e in zip(bounds, ends, strict=True)):
            raise UntranslatableError(f"the slice {ast.unparse(node)}")
        low, high = (None if bound is None else int(bound) for bound in bounds)
        return self.gathered(values[low:high])

    def _dims(self, node: ast.expr) -> tuple[int, ...]:
        known = self.known(node)
        if isinstance(known, tuple):
            return known
        parts = node.elts if isinstance(node, ast.Tuple) else [node]
        sizes = [self.value(part).const for part in parts]
        if any(size is None for size in sizes):
            raise UntranslatableError(f"an array of the size {ast.unparse(node)}")
        return tuple(int(size) for size in sizes if size is not None)

    def _store(self, name: str, kind: Array) -> None:
        if self.types.get(name, kind) != kind:
            raise UntranslatableError(f"{name} is an array of two types")
        self.types[name] = kind
        self.stored.add(name)
        self.names[name] = Value(kind, c_name(name), origins=frozenset({("local", None, name)}))

    # --- slices ---

    def _assign_slice(self, target: ast.Subscript, source: ast.expr) -> None:
        """Translate ``a[:, 1:] = ...``."""
        owner, picks = self._sliced(target)
        for origin in owner.origins:
            self.write(origin)
        if isinstance(source, ast.Subscript) and has_slice(source):
            value, from_picks = self._sliced(source)
            self._copy(owner, picks, value, from_picks)
            return
        value = self.value(source)
        if isinstance(value.type, Array):
            whole = tuple((0, size) for size in value.type.dims)
            self._copy(owner, picks, value, whole)
            return
        self._fill(owner, picks, value)

    def _sliced(self, node: ast.Subscript) -> tuple[Value, tuple[Any, ...]]:
        """Return an array, and for each dimension an index or a range (first, size)."""
        owner = self.value(node.value)
        if not isinstance(owner.type, Array):
            raise UntranslatableError(f"a slice of {ast.unparse(node.value)}")
        parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        picks: list[Any] = []
        for k, size in enumerate(owner.type.dims):
            part = parts[k] if k < len(parts) else ast.Slice()
            if not isinstance(part, ast.Slice):
                picks.append(self.value(part))
                continue
            low = 0 if part.lower is None else self.value(part.lower).const
            high = size if part.upper is None else self.value(part.upper).const
            if low is None or high is None or part.step or not 0 <= low <= high <= size:
                raise UntranslatableError(f"the slice {ast.unparse(node)}")
            picks.append((int(low), int(high) - int(low)))
        return owner, tuple(picks)

    def _fill(self, target: Value, picks: tuple[Any, ...], value: Value) -> None:
        """Set a part of an array to a number, or a whole array to another."""
        assert isinstance(target.type, Array)  # noqa: S101 - as the callers have found
        whole = picks or tuple((0, size) for size in target.type.dims)
        if isinstance(value.type, Array):
            self._copy(target, whole, value, tuple((0, size) for size in value.type.dims))
            return
        indices = self._open(whole)
        place = element(target, indices)
        self.emit(f"{place.code} = {cast(value, place.type).code};")
        self._close(whole)

    def _copy(
        self, target: Value, picks: tuple[Any, ...], source: Value, sources: tuple[Any, ...]
    ) -> None:
        """Copy one part of an array to another of the same shape."""
        shape = [pick[1] for pick in picks if isinstance(pick, tuple)]
        if shape != [pick[1] for pick in sources if isinstance(pick, tuple)]:
            raise UntranslatableError(f"{source.code} has not the shape of {target.code}")
        indices = self._open(picks)
        counters = [
            (index, pick[0])
            for index, pick in zip(indices, picks, strict=True)
            if isinstance(pick, tuple)
        ]
        others: list[Value] = []
        for pick in sources:
            if not isinstance(pick, tuple):
                others.append(pick)
                continue
            index, begin = counters.pop(0)
            moved = at_place(Place(pick[0] - begin, None))
            others.append(self.binary(ast.Add(), index, moved))
        place, value = element(target, indices), element(source, others)
        self.emit(f"{place.code} = {cast(value, place.type).code};")
        self._close(picks)

    def _open(self, picks: tuple[Any, ...]) -> list[Value]:
        """Open loops over a part of an array; return its indices."""
        indices: list[Value] = []
        for k, pick in enumerate(picks):
            if not isinstance(pick, tuple):
                indices.append(pick)
                continue
            first, size = pick
            name = f"k{k}"
            self.emit(f"for (int64_t {name} = {first}; {name} < {first + size}; {name} += 1) {{")
            self.depth += 1
            indices.append(Value(INT, name))
        return indices

    def _close(self, picks: tuple[Any, ...]) -> None:
        for pick in picks:
            if isinstance(pick, tuple):
                self.depth -= 1
                self.emit("}")
