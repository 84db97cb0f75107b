"""Translation of statements: assignments, conditions and loops over a known range."""

import ast
import re
from collections import Counter
from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

from stickslip.export.c.translator.arrays import Arrays, has_slice
from stickslip.export.c.translator.types import (
    INT,
    NOTHING,
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
    unified,
)

_CHANGES: dict[type[ast.operator], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
}
_PLAIN = re.compile(r"[\w>.&()-]*")


class Statements(Arrays):
    """Translation of the statements of one function."""

    def __init__(self) -> None:
        super().__init__()
        self.places: dict[str, int] = {}  # variables that count from a region of the state
        self.result: Type = NOTHING
        self.unknown = True  # whether a type has changed in this pass
        self.assigned: Counter[str] = Counter()
        self.indices: set[str] = set()  # names in the index of a state
        self.skips_raise = False
        self.unrolled = 0

    def block(self, statements: list[ast.stmt]) -> None:
        """Translate statements."""
        for statement in statements:
            try:
                method: Any = getattr(self, f"_{type(statement).__name__}", None)
                if method is None:
                    raise UntranslatableError(f"the statement {ast.unparse(statement)}")  # noqa: TRY301
                method(statement)
            except UntranslatableError as error:
                if error.place is None:
                    error.place = (
                        f"{self.python.__module__}.{self.python.__name__}",
                        statement.lineno,
                    )
                raise

    # --- assignments ---

    def _Assign(self, node: ast.Assign) -> None:  # noqa: N802 - named after the syntax tree
        targets = node.targets
        if len(targets) > 1:
            value = self.value(node.value)
            if value.const is None:
                value = self._held(value)
            for target in reversed(targets):
                self.assign(target, value)
            return
        target = targets[0]
        if isinstance(target, ast.Tuple):
            self._assign_several(target, node.value)
        else:
            self.assign_from(target, node.value)

    def _assign_several(self, target: ast.Tuple, source: ast.expr) -> None:
        """Translate ``a, b = ...``."""
        if isinstance(source, ast.Tuple):
            if _hazard(target.elts, source.elts):
                values = [self._held(self.value(each)) for each in source.elts]
                for one, value in zip(target.elts, values, strict=True):
                    self.assign(one, value)
                return
            for one, each in zip(target.elts, source.elts, strict=True):
                self.assign_from(one, each)
            return
        value = self.value(source)
        if not isinstance(value.type, Tuple) or len(value.type.items) != len(target.elts):
            raise UntranslatableError(f"{ast.unparse(source)} is not {len(target.elts)} values")
        held = self._held(value)
        for k, one in enumerate(target.elts):
            if not (isinstance(one, ast.Name) and one.id == "_"):
                member = value.type.member(str(k))
                self.assign(one, Value(value.type.items[k], f"{held.code}.{member}"))

    def assign_from(self, target: ast.expr, source: ast.expr) -> None:
        """Translate one assignment."""
        if isinstance(target, ast.Name) and self._new_array(target.id, source):
            return
        if isinstance(target, ast.Subscript) and has_slice(target):
            self._assign_slice(target, source)
            return
        self.assign(target, self.value(source))

    def assign(self, target: ast.expr, value: Value) -> None:
        """Assign a value to a name, a field, or an element."""
        if isinstance(target, ast.Name):
            self._assign_name(target.id, value)
            return
        if not isinstance(target, ast.Attribute | ast.Subscript) or has_slice(target):
            raise UntranslatableError(f"an assignment to {ast.unparse(target)}")
        place = self.value(target)
        for origin in place.origins:
            self.write(origin)
        if isinstance(place.type, Record):
            if place.type != value.type or not isinstance(target, ast.Attribute):
                raise UntranslatableError(f"a record is assigned to {ast.unparse(target)}")
            place.type.struct.write_all()
            owner = self.value(target.value)
            assert isinstance(owner.type, Record)  # noqa: S101 - it has a field
            owner.type.struct.written.add(target.attr)
            self.emit(f"{_pointed(place.code)} = {_pointed(value.code)};")
            return
        if isinstance(place.type, Array):
            raise UntranslatableError(f"an array is assigned to {ast.unparse(target)}")
        if self._nowhere(target):
            return
        self.emit(f"{place.code} = {cast(value, place.type).code};")

    def _nowhere(self, target: ast.expr) -> bool:
        """Return whether an element is one of an array of no size: it cannot be reached."""
        if not isinstance(target, ast.Subscript):
            return False
        owner = self.value(target.value)
        return isinstance(owner.type, Array) and 0 in owner.type.dims

    def _assign_name(self, name: str, value: Value) -> None:
        once = self.assigned[name] == 1
        if once and value.const is not None and isinstance(value.type, Scalar):
            self.names[name] = value
            return
        if isinstance(value.type, Vector):
            raise UntranslatableError(f"{name} is a second state")
        plain = _PLAIN.fullmatch(value.code) and _PLAIN.fullmatch(value.config)
        if once and plain and not isinstance(value.type, Scalar | Tuple):
            self.names[name] = value
            return
        if isinstance(value.type, Record):
            self._assign_pointer(name, value)
            return
        if name in self.stored:
            raise UntranslatableError(f"the array {name} is assigned again")
        kind = unified(self.types.get(name, value.type), value.type)
        region = None
        if kind == INT and name in self.indices:
            region, value = self._counted_from_region(name, value)
        if self.types.get(name) != kind:
            self.unknown = True
        self.types[name] = kind
        code = cast(value, kind).code
        self.names[name] = Value(kind, c_name(name), origins=value.origins)
        if region is not None:
            rest = Value(INT, c_name(name))
            self.names[name] = at_place(Place(region, rest, region))
        self.emit(f"{c_name(name)} = {code};")

    def _counted_from_region(self, name: str, value: Value) -> tuple[int | None, Value]:
        """Return the first place of the region that a place is in, and the place from there on."""
        if self.unit.layout is None or value.place is None:
            return None, value
        place = value.place
        region = place.region
        if region is None:
            flat = self.unit.layout.flat(place.constant)
            if flat is None:
                return None, value
            region = flat.start
        known = self.places.setdefault(name, region)
        if known != region:
            raise UntranslatableError(f"{name} is a place in two regions of the state")
        return region, at_place(Place(place.constant - region, place.rest))

    def _assign_pointer(self, name: str, value: Value) -> None:
        """Let a name be a record that is found when the program runs."""
        state = c_name(name) if value.code else ""
        config = f"{c_name(name)}_config" if value.config else ""
        self.types[name] = value.type
        self.names[name] = Value(value.type, state, config=config)
        if value.code:
            self.emit(f"{state} = {value.code};")
        if value.config:
            self.emit(f"{config} = {value.config};")

    def _AugAssign(self, node: ast.AugAssign) -> None:  # noqa: N802
        place, value = self.value(node.target), self.value(node.value)
        result = self.binary(node.op, place, value)
        symbol = _CHANGES.get(type(node.op))
        if symbol and place.type == result.type == REAL and not value.impure:
            for origin in place.origins if not isinstance(node.target, ast.Name) else ():
                self.write(origin)
            self.emit(f"{place.code} {symbol}= {cast(value, REAL).code};")
            return
        self.assign(node.target, result)

    # --- flow ---

    def _If(self, node: ast.If) -> None:  # noqa: N802
        if self.skips_raise and len(node.body) == 1 and isinstance(node.body[0], ast.Raise):
            return
        test = self.condition(node.test)
        if test.const is not None:
            self.block(node.body if test.const else node.orelse)
            return
        self.emit(f"if ({test.code}) {{")
        self._nested(node.body)
        if node.orelse:
            self.emit("} else {")
            self._nested(node.orelse)
        self.emit("}")

    def _nested(self, statements: list[ast.stmt]) -> None:
        self.depth += 1
        self.block(statements)
        self.depth -= 1

    def _For(self, node: ast.For) -> None:  # noqa: N802
        if node.orelse:
            raise UntranslatableError("a loop with else")
        if isinstance(node.iter, ast.Tuple):
            self._unroll(node, node.iter)
            return
        call = node.iter
        ranges = isinstance(call, ast.Call) and self.known(call.func) is range
        if not ranges or not isinstance(node.target, ast.Name) or not isinstance(call, ast.Call):
            raise UntranslatableError(f"a loop over {ast.unparse(node.iter)}")
        bounds = [self.value(each) for each in call.args]
        if len(bounds) == 1:
            bounds = [constant(0), *bounds]
        step = int(bounds[2].const or 0) if len(bounds) == 3 else 1
        if step == 0 or any(bound.type != INT for bound in bounds):
            raise UntranslatableError(f"the range {ast.unparse(call)}")
        self._loop(node, bounds[0], bounds[1], step)

    def _While(self, node: ast.While) -> None:  # noqa: N802
        if node.orelse or not self.unit.open_loops:
            what = "a loop with else" if node.orelse else "a loop without a bound"
            raise UntranslatableError(what)
        before = len(self.lines)
        test = self.condition(node.test)
        if len(self.lines) != before:
            raise UntranslatableError(f"the condition {ast.unparse(node.test)} takes statements")
        self.emit(f"while ({test.code}) {{")
        self._repeated(node.body)
        self.emit("}")

    def _repeated(self, statements: list[ast.stmt]) -> None:
        """Translate the statements of a loop, which they may leave."""
        outer, self.unrolled = self.unrolled, 0
        self._nested(statements)
        self.unrolled = outer

    @contextmanager
    def _counter(self, name: str, value: Value) -> Generator[None]:
        """Bind a name within a loop; its last value is not that of Python."""
        before = self.names.get(name)
        self.names[name] = value
        yield
        if before is None:
            del self.names[name]
        else:
            self.names[name] = before

    def _loop(self, node: ast.For, start: Value, stop: Value, step: int) -> None:
        assert isinstance(node.target, ast.Name)  # noqa: S101 - as the caller has found
        name = node.target.id
        own = "k_" if name == "_" else c_name(name)
        region = None
        if name in self.indices:
            region, start = self._counted_from_region(name, start)
            stop = self.binary(ast.Sub(), stop, constant(region or 0))
        if (stop.const is None and not stop.code.isidentifier()) or (
            stop.const is None and self._assigns(node.body, stop.code)
        ):
            stop = self._held(stop)
        value = Value(INT, own)
        counter = value if region is None else at_place(Place(region, value, region))
        compare, change = ("<", "+=") if step > 0 else (">", "-=")
        self.emit(
            f"for (int64_t {own} = {start.code}; {own} {compare} {stop.code}; "
            f"{own} {change} {abs(step)}) {{"
        )
        if self._assigns(node.body, name):
            raise UntranslatableError(f"the loop over {name} changes it")
        with self._counter(name, counter):
            self._repeated(node.body)
        self.emit("}")

    def _assigns(self, body: list[ast.stmt], name: str) -> bool:
        """Return whether statements assign a name."""
        return any(
            isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store) and each.id == name
            for statement in body
            for each in ast.walk(statement)
        )

    def _unroll(self, node: ast.For, items: ast.Tuple) -> None:
        """Translate a loop over a tuple, once for each item."""
        if isinstance(node.target, ast.Name):
            values = [self.value(item) for item in items.elts]
            if all(isinstance(value.type, Scalar) for value in values):
                self._loop_over(node, node.target.id, values)
                return
        targets = node.target.elts if isinstance(node.target, ast.Tuple) else [node.target]
        self.unrolled += 1
        for item in items.elts:
            parts = item.elts if isinstance(node.target, ast.Tuple) else [item]  # type: ignore[attr-defined]
            for target, part in zip(targets, parts, strict=True):
                assert isinstance(target, ast.Name)  # noqa: S101 - kernels unpack to names
                self.names[target.id] = self.value(part)
            self.block(node.body)
        self.unrolled -= 1

    def _loop_over(self, node: ast.For, name: str, values: list[Value]) -> None:
        """Translate a loop over numbers."""
        kind = common_type(values)
        self.scratch += 1
        table, counter = f"t{self.scratch}", f"k{self.scratch}"
        codes = ", ".join(cast(value, kind).code for value in values)
        self.emit(f"const {self.unit.declared(kind, table)}[{len(values)}] = {{{codes}}};")
        self.emit(f"for (int64_t {counter} = 0; {counter} < {len(values)}; {counter} += 1) {{")
        self.depth += 1
        self.emit(f"const {self.unit.declared(kind, c_name(name))} = {table}[{counter}];")
        self.depth -= 1
        with self._counter(name, Value(kind, c_name(name))):
            self._repeated(node.body)
        self.emit("}")

    def _Break(self, _: ast.Break) -> None:  # noqa: N802
        self._leave("break;")

    def _Continue(self, _: ast.Continue) -> None:  # noqa: N802
        self._leave("continue;")

    def _leave(self, text: str) -> None:
        if self.unrolled:
            raise UntranslatableError("a loop over a tuple is left early")
        self.emit(text)

    def _Pass(self, _: ast.Pass) -> None:  # noqa: N802
        """Translate nothing."""

    def _Expr(self, node: ast.Expr) -> None:  # noqa: N802
        if isinstance(node.value, ast.Constant):
            return  # a docstring
        value = self.value(node.value)
        self.emit(f"{'' if value.type == NOTHING else '(void)'}{value.code};")

    def _Return(self, node: ast.Return) -> None:  # noqa: N802
        if node.value is None:
            self.emit("return;")
            return
        if isinstance(node.value, ast.Tuple):
            values = self.items_of(node.value)
            # The state is changed in place
            values = [value for value in values if not isinstance(value.type, Vector)]
            self._one_effect(node.value, values)
        else:
            values = [self.value(node.value)]
        if len(values) == 1:
            self._widen(values[0].type)
            self.emit(f"return {cast(values[0], self.result).code};")
            return
        self._widen(Tuple(tuple(value.type for value in values)))
        assert isinstance(self.result, Tuple)  # noqa: S101 - there are several values
        parts = [cast(value, kind) for value, kind in zip(values, self.result.items, strict=True)]
        self.emit(f"return {self.gathered(parts).code};")

    def _widen(self, kind: Type) -> None:
        """Let the result hold values of another type too."""
        before = self.result
        if before == NOTHING:
            self.result = kind
        elif isinstance(before, Tuple) and isinstance(kind, Tuple):
            items = (unified(a, b) for a, b in zip(before.items, kind.items, strict=True))
            self.result = Tuple(tuple(items))
        else:
            self.result = unified(before, kind)
        self.unknown = self.unknown or self.result != before


def _pointed(pointer: str) -> str:
    """Return what a pointer points to."""
    return pointer[1:] if pointer.startswith("&") else f"*{pointer}"


def _hazard(targets: list[ast.expr], sources: list[ast.expr]) -> bool:
    """Return whether a later source reads what an earlier target changes."""
    return any(
        _may_be_same(target, each)
        for k, target in enumerate(targets)
        for source in sources[k + 1 :]
        for each in ast.walk(source)
    )


def _may_be_same(target: ast.expr, each: ast.AST) -> bool:
    if isinstance(target, ast.Name) and isinstance(each, ast.Name):
        return target.id == each.id
    if isinstance(target, ast.Attribute) and isinstance(each, ast.Attribute):
        return target.attr == each.attr
    if isinstance(target, ast.Subscript) and isinstance(each, ast.Subscript):
        return ast.unparse(target.value) == ast.unparse(each.value)
    return False
