"""Translation of expressions: one method for each kind that kernels use, an error for any other."""

import ast
import inspect
import math
import types
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple

from stickslip.export.c.translator.types import (
    BOOL,
    INT,
    REAL,
    Array,
    Record,
    Scalar,
    Tuple,
    Type,
    UntranslatableError,
    Vector,
    item_of,
)
from stickslip.export.c.translator.values import (
    AND,
    BAND,
    BOR,
    COND,
    OR,
    SHIFT,
    UNARY,
    Place,
    Value,
    arithmetic,
    at_place,
    cast,
    comparison,
    constant,
    element,
    field_of,
    python_of,
    quotient,
    unified,
)

if TYPE_CHECKING:
    from stickslip.export.c.translator.unit import Function, Unit

_COMPARISONS: dict[type[ast.cmpop], str] = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="
}  # fmt: skip
_REAL_FUNCTIONS: dict[Any, str] = {
    math.sqrt: "real_sqrt", np.sqrt: "real_sqrt",
    math.exp: "real_exp", np.exp: "real_exp",
    math.expm1: "real_expm1", np.expm1: "real_expm1",
    math.log: "real_log", np.log: "real_log",
    math.log1p: "real_log1p", np.log1p: "real_log1p",
    np.ceil: "real_ceil",
    math.sin: "real_sin", math.atan2: "real_atan2", math.hypot: "real_hypot",
    np.sign: "real_sign",
}  # fmt: skip
_TESTS: dict[Any, str] = {
    np.isnan: "is_nan", math.isnan: "is_nan", np.isfinite: "is_finite", np.isinf: "is_infinite"
}  # fmt: skip
_LARGEST_POWER = 8  # exponent for which the generated code has a function


class Expressions(ABC):
    """Translation of the expressions of one function."""

    unit: "Unit"
    names: dict[str, Value]
    python: types.FunctionType

    # --- values known in Python ---

    def known(self, node: ast.expr) -> Any:
        """Return the Python object that a name or attribute outside the function is, or None."""
        if isinstance(node, ast.Name):
            if node.id in self.names:
                return None
            space = inspect.getclosurevars(self.python)
            for names in (space.nonlocals, space.globals, space.builtins):
                if node.id in names:
                    return names[node.id]
            return None
        if isinstance(node, ast.Attribute):
            owner = self.known(node.value)
            if isinstance(owner, types.ModuleType):
                return getattr(owner, node.attr)
        return None

    # --- expressions ---

    def value(self, node: ast.expr) -> Value:
        """Translate an expression."""
        known = self.known(node)
        if isinstance(known, bool | int | float | np.integer | np.floating):
            return constant(known.item() if isinstance(known, np.generic) else known)
        if isinstance(known, np.ndarray):
            return self.unit.table(ast.unparse(node), known)
        if isinstance(known, tuple):
            return self.gathered([constant(each) for each in known])
        method: Callable[[Any], Value] | None = getattr(self, f"_{type(node).__name__}", None)
        if method is None:
            raise UntranslatableError(f"{ast.unparse(node)} ({type(node).__name__})")
        return method(node)

    def condition(self, node: ast.expr) -> Value:
        """Translate an expression whose truth is asked for."""
        return cast(self.value(node), BOOL)

    def _Constant(self, node: ast.Constant) -> Value:  # noqa: N802 - named after the syntax tree
        if not isinstance(node.value, bool | int | float):
            raise UntranslatableError(f"the constant {node.value!r}")
        return constant(node.value)

    def _Name(self, node: ast.Name) -> Value:  # noqa: N802
        if node.id not in self.names:
            raise UntranslatableError(f"{node.id} has no value here")
        return self.names[node.id]

    def _Attribute(self, node: ast.Attribute) -> Value:  # noqa: N802
        owner = self.value(node.value)
        kind = owner.type
        if isinstance(kind, Record):
            return self.field(owner, node.attr)
        if node.attr == "size" and isinstance(kind, Vector):
            return constant(kind.layout.size)
        if node.attr == "size" and isinstance(kind, Array):
            return constant(math.prod(kind.dims))
        raise UntranslatableError(f"the attribute {ast.unparse(node)}")

    def field(self, owner: Value, name: str) -> Value:
        """Return a field of a record, of whichever half it lies in."""
        assert isinstance(owner.type, Record)  # noqa: S101 - the callers have looked
        struct = owner.type.struct
        if name not in struct.fields:
            raise UntranslatableError(f"{struct.name} has no field {name}")
        kind = struct.fields[name][1]
        if name in struct.pins:
            return constant(struct.pins[name])
        struct.read.add(name)
        inner = item_of(kind)
        if isinstance(inner, Record):
            halves = inner.struct.halves or ("state",)
            states, configs = "state" in halves, "config" in halves
            state = field_of(owner.code, name) if states else ""
            config = field_of(owner.config, name) if configs else ""
            if isinstance(kind, Array):
                return Value(kind, state, config=config)
            return Value(kind, state and f"&{state}", config=config and f"&{config}")
        if struct.in_half(name, "config"):
            code = field_of(owner.config, name)
            kind = replace(kind, const=True) if isinstance(kind, Array) else kind
            return Value(kind, code, origins=frozenset({("field", struct, name)}))
        return Value(kind, field_of(owner.code, name), origins=frozenset({("field", struct, name)}))

    def _Subscript(self, node: ast.Subscript) -> Value:  # noqa: N802
        owner = self.value(node.value)
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        if any(isinstance(each, ast.Slice) for each in indices):
            raise UntranslatableError(f"{ast.unparse(node)} outside an assignment")
        if isinstance(owner.type, Vector):
            return self.number(owner, self.value(indices[0]))
        places = [self.value(each) for each in indices]
        if isinstance(owner.type, Tuple):
            index = places[0]
            if len(places) != 1 or (index.const is None and not owner.type.alike):
                raise UntranslatableError(f"{ast.unparse(node)}: a tuple needs a constant index")
            item = owner.type.items[int(index.const or 0)]
            member = owner.type.member(index.code)
            return Value(item, f"{owner.within(UNARY + 1)}.{member}", impure=owner.impure)
        return element(owner, places)

    def number(self, vector: Value, index: Value) -> Value:
        """Return a number of a state by its place."""
        assert isinstance(vector.type, Vector)  # noqa: S101
        layout = vector.type.layout
        place = index.place or Place(0, index)
        flat = layout.flat(place.constant if place.region is None else place.region)
        if flat is None:
            raise UntranslatableError(f"the place {index.code}, which is not in a flat part")
        offset = at_place(Place(place.constant - flat.start, place.rest))
        if offset.const is not None and not 0 <= offset.const < flat.size:
            raise UntranslatableError(f"the place {place.constant} is outside {flat.name}")
        return Value(
            REAL,
            f"{vector.code}->{flat.name}[{offset.code}]",
            origins=frozenset({("flat", layout, flat.name)}),
            impure=index.impure,
        )

    def _Tuple(self, node: ast.Tuple) -> Value:  # noqa: N802
        """Return a tuple inside an expression, as a value of its own."""
        values = self.items_of(node)
        self._one_effect(node, values)
        return self.gathered(values)

    def items_of(self, node: ast.Tuple) -> list[Value]:
        """Return the values of a tuple, of which a starred one is a tuple itself."""
        found: list[Value] = []
        for each in node.elts:
            if isinstance(each, ast.Starred):
                found += self.unpacked(self.value(each.value))
            else:
                found.append(self.value(each))
        return found

    def unpacked(self, value: Value) -> list[Value]:
        """Return the values of a tuple that a name or field holds."""
        if not isinstance(value.type, Tuple) or value.impure:
            raise UntranslatableError(f"the values of {value.code}")
        code = value.within(UNARY + 1)
        return [
            Value(item, f"{code}.{value.type.member(str(k))}")
            for k, item in enumerate(value.type.items)
        ]

    def gathered(self, values: list[Value]) -> Value:
        """Return values as a tuple."""
        kind = Tuple(tuple(value.type for value in values))
        inner = ", ".join(value.code for value in values)
        braced = f"{{{{{inner}}}}}" if kind.alike else f"{{{inner}}}"
        impure = any(value.impure for value in values)
        return Value(kind, f"({self.unit.type_name(kind)}){braced}", impure=impure)

    def _UnaryOp(self, node: ast.UnaryOp) -> Value:  # noqa: N802
        if isinstance(node.op, ast.Not):
            operand = self.condition(node.operand)
            if operand.const is not None:
                return constant(not operand.const)
            return Value(BOOL, f"!{operand.within(UNARY)}", UNARY, impure=operand.impure)
        operand = self.value(node.operand)
        if not isinstance(node.op, ast.USub) or operand.type not in (INT, REAL):
            raise UntranslatableError(ast.unparse(node))
        if operand.const is not None:
            return constant(-operand.const)
        return Value(
            operand.type, f"-{operand.within(UNARY, right=True)}", UNARY, impure=operand.impure
        )

    def _BinOp(self, node: ast.BinOp) -> Value:  # noqa: N802
        left, right = self.value(node.left), self.value(node.right)
        self._one_effect(node, [left, right])
        return self.binary(node.op, left, right)

    def binary(self, operator: ast.operator, left: Value, right: Value) -> Value:
        """Return the value of a binary operator."""
        for kind, symbol in ((ast.Add, "+"), (ast.Sub, "-"), (ast.Mult, "*")):
            if isinstance(operator, kind):
                return arithmetic(symbol, left, right)
        if isinstance(operator, ast.Div):
            return quotient(left, right)
        if isinstance(operator, ast.Pow):
            return _power(left, right)
        if left.type == INT and right.type == INT:
            return self._whole(operator, left, right)
        if not isinstance(operator, ast.Mod):
            raise UntranslatableError(f"{type(operator).__name__} of numbers that are not whole")
        left, right = cast(left, REAL), cast(right, REAL)
        impure = left.impure or right.impure
        return Value(REAL, f"real_mod({left.code}, {right.code})", impure=impure)

    def _whole(self, operator: ast.operator, left: Value, right: Value) -> Value:
        """Return the value of an operator that only whole numbers have."""
        a, b = left.const, right.const
        impure = left.impure or right.impure
        for kind, name in ((ast.Mod, "floor_mod"), (ast.FloorDiv, "floor_div")):
            if isinstance(operator, kind):
                if a is not None and b is not None:
                    return constant(int(a % b if kind is ast.Mod else a // b))
                return Value(INT, f"{name}({left.code}, {right.code})", impure=impure)
        for kind, symbol, rank in (
            (ast.LShift, "<<", SHIFT), (ast.RShift, ">>", SHIFT), (ast.BitAnd, "&", BAND),
            (ast.BitOr, "|", BOR),
        ):  # fmt: skip
            if isinstance(operator, kind):
                if symbol == "<<":
                    left = Value(INT, f"(int64_t){left.within(UNARY)}", UNARY)
                code = f"{left.within(rank)} {symbol} {right.within(rank, right=True)}"
                return Value(INT, code, rank, impure=impure)
        raise UntranslatableError(f"the operator {type(operator).__name__}")

    def _Compare(self, node: ast.Compare) -> Value:  # noqa: N802
        if isinstance(node.ops[0], ast.In) and isinstance(node.comparators[0], ast.Tuple):
            left = self.value(node.left)
            choices = self.items_of(node.comparators[0])
            self._one_effect(node, [left, left, *choices])
            return _joined("||", [comparison("==", left, each) for each in choices])
        values = [self.value(each) for each in (node.left, *node.comparators)]
        if len(values) > 2 and any(value.impure for value in values):
            raise UntranslatableError(f"{ast.unparse(node)} evaluates a call twice")
        self._one_effect(node, values)
        parts: list[Value] = []
        for operator, left, right in zip(node.ops, values[:-1], values[1:], strict=True):
            symbol = _COMPARISONS.get(type(operator))
            if symbol is None:
                raise UntranslatableError(ast.unparse(node))
            parts.append(comparison(symbol, left, right))
        return _joined("&&", parts)

    def _BoolOp(self, node: ast.BoolOp) -> Value:  # noqa: N802
        parts = [self.condition(each) for each in node.values]
        return _joined("&&" if isinstance(node.op, ast.And) else "||", parts)

    def _IfExp(self, node: ast.IfExp) -> Value:  # noqa: N802
        test = self.condition(node.test)
        if test.const is not None:
            return self.value(node.body if test.const else node.orelse)
        then, other = self.value(node.body), self.value(node.orelse)
        impure = test.impure or then.impure or other.impure
        if isinstance(then.type, Record) and then.type == other.type:

            def chosen(a: str, b: str) -> str:
                return f"({test.within(COND, right=True)} ? {a} : {b})" if a else ""

            return Value(
                then.type, chosen(then.code, other.code), config=chosen(then.config, other.config)
            )
        kind = unified(then.type, other.type)
        then, other = cast(then, kind), cast(other, kind)
        code = (
            f"{test.within(COND, right=True)} ? {then.within(COND, right=True)} : "
            f"{other.within(COND, right=True)}"
        )
        return Value(kind, code, COND, impure=impure)

    # --- calls ---

    def _Call(self, node: ast.Call) -> Value:  # noqa: N802
        if isinstance(node.func, ast.Attribute) and self.known(node.func) is None:
            raise UntranslatableError(f"the call {ast.unparse(node)}")
        function = self.known(node.func)
        if function is None:
            raise UntranslatableError(f"{ast.unparse(node.func)} is not known")
        if function is np.empty:
            return self.scratch_array(node)
        if function is to_fixed_tuple:
            array, size = self.value(node.args[0]), self.value(node.args[1])
            places = range(int(size.const or 0))
            return self.gathered([element(array, [constant(k)]) for k in places])
        if getattr(function, "__qualname__", "") == "fields_at.<locals>.fields":
            return self._fields(function, self.value(node.args[0]))
        if isinstance(kernel := python_of(function), types.FunctionType):
            return self._kernel_call(kernel, node)
        values = [self.value(each) for each in node.args]
        self._one_effect(node, values)
        return self._built_in(function, values, node)

    def _built_in(  # noqa: PLR0911
        self, function: Any, values: list[Value], node: ast.Call
    ) -> Value:
        impure = any(value.impure for value in values)
        arguments = ", ".join(cast(v, REAL).code for v in values if isinstance(v.type, Scalar))
        if function in _REAL_FUNCTIONS:
            return Value(REAL, f"{_REAL_FUNCTIONS[function]}({arguments})", impure=impure)
        if function in _TESTS:
            return Value(BOOL, f"{_TESTS[function]}({arguments})", impure=impure)
        if function in (math.ceil, math.floor):
            code = f"(int64_t)real_{function.__name__}({arguments})"
            return Value(INT, code, UNARY, impure=impure)
        if function in (max, min) and len(values) > 1:
            return _extreme(function.__name__, values)
        if function is abs:
            if values[0].type == REAL:
                return Value(REAL, f"real_abs({arguments})", impure=impure)
            raise UntranslatableError(f"{ast.unparse(node)} of a whole number")
        if function is int:
            return cast(values[0], INT)
        if function is float:
            return cast(values[0], REAL)
        raise UntranslatableError(f"the function {ast.unparse(node.func)}")

    def _fields(self, function: Any, vector: Value) -> Value:
        """Return the named fields of a state."""
        space = inspect.getclosurevars(inspect.unwrap(function)).nonlocals
        struct = self.unit.structs.of(space["dtype"])
        if vector.type == Record(struct):
            return vector  # a vector that is one record is that record in C
        if not isinstance(vector.type, Vector):
            raise UntranslatableError(f"{vector.code} has no named fields")
        member = vector.type.layout.record(struct, space["start"])
        return Value(
            Record(struct), f"&{vector.code}->{member}", config=f"&{vector.config}->{member}"
        )

    def _kernel_call(self, function: types.FunctionType, node: ast.Call) -> Value:
        if node.keywords:
            raise UntranslatableError(f"{ast.unparse(node)}: arguments by name")
        arguments = [self.value(each) for each in node.args]
        self._one_effect(node, arguments)
        called = self.unit.function(function, arguments)
        self.calls(called)
        codes: list[str] = []
        for name, argument in zip(called.parameters, arguments, strict=False):
            if name in called.specialised:
                continue
            for origin in argument.origins if name in called.writes else ():
                self.write(origin)
            codes += self._passed(argument, called.parameters[name])
        impure = called.impure or any(argument.impure for argument in arguments)
        return Value(called.result, f"{called.name}({', '.join(codes)})", impure=impure)

    def _passed(self, value: Value, kind: Type) -> list[str]:
        """Return the C arguments that an argument is."""
        if isinstance(kind, Array) and isinstance(kind.item, Record):
            kind = kind.item
        if isinstance(kind, Record):
            halves = kind.struct.halves
            parts = [(half, value.config if half == "config" else value.code) for half in halves]
            return [code for _, code in parts]
        if isinstance(kind, Vector):
            return [value.config, value.code]
        if isinstance(kind, Array) and 0 in kind.dims:
            return []  # there is nothing in it
        return [cast(value, kind).code]

    @abstractmethod
    def write(self, origin: tuple[str, Any, str]) -> None:
        """Note that memory is written."""

    @abstractmethod
    def calls(self, called: "Function") -> None:
        """Note that a kernel is called."""

    @abstractmethod
    def scratch_array(self, node: ast.Call) -> Value:
        """Return a new array that has no name in Python."""

    def _one_effect(self, node: ast.expr, values: list[Value]) -> None:
        """Check that no two operands change anything: C leaves their order open."""
        if sum(value.impure for value in values) > 1:
            raise UntranslatableError(f"{ast.unparse(node)}: two calls that change the state")


def _joined(operator: str, parts: list[Value]) -> Value:
    """Join conditions by ``&&`` or ``||``; constants are left out."""
    absorbing = operator == "||"
    for k, part in enumerate(parts):
        if part.const is not None and bool(part.const) == absorbing:
            parts = parts[: k + 1]
            break
    if parts[-1].const is not None and bool(parts[-1].const) == absorbing:
        if any(part.impure for part in parts):
            raise UntranslatableError("a call whose result does not matter")
        return constant(absorbing)
    left = [part for part in parts if part.const is None]
    if not left:
        return constant(not absorbing)
    if len(left) == 1:
        return left[0]
    rank = AND if operator == "&&" else OR
    # Compilers warn of && within || without parentheses
    codes = [
        f"({part.code})" if part.rank <= rank or part.rank in (AND, OR) else part.code
        for part in left
    ]
    return Value(BOOL, f" {operator} ".join(codes), rank, impure=any(part.impure for part in left))


def _power(base: Value, exponent: Value) -> Value:
    """Return a power: by repeated squaring, as Numba does, where the exponent is a whole constant.

    That of a real exponent is the library's.
    """
    if exponent.type == INT:
        n = exponent.const
        if n is None or not 2 <= n <= _LARGEST_POWER:
            raise UntranslatableError(f"the power {base.code} ** {exponent.code}")
        if base.type == INT and base.const is not None:
            return constant(int(base.const) ** int(n))
        if base.const is not None:
            return constant(_squared(float(base.const), int(n)))
        real = cast(base, REAL)
        return Value(REAL, f"power_{int(n)}({real.code})", impure=base.impure)
    base = cast(base, REAL)
    return Value(
        REAL, f"real_pow({base.code}, {exponent.code})", impure=base.impure or exponent.impure
    )


def _squared(base: float, n: int) -> float:
    """Return a power in the order of Numba's multiplications."""
    result = 1.0
    while n:
        if n & 1:
            result *= base
        n >>= 1
        base *= base
    return result


def _extreme(name: str, values: list[Value]) -> Value:
    """Return the largest or smallest of numbers, as Python compares them: NaN included."""
    result = values[0]
    for value in values[1:]:
        kind = unified(result.type, value.type)
        first, second = cast(result, kind), cast(value, kind)
        prefix = "real" if kind == REAL else "int"
        if kind not in (REAL, INT):
            raise UntranslatableError(f"{name} of {kind}")
        result = Value(
            kind,
            f"{prefix}_{name}({first.code}, {second.code})",
            impure=first.impure or second.impure,
        )
    return result
