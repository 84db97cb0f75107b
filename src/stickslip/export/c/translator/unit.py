"""Translation of a set of kernels to one C file.

Kernels are restricted Python: numbers, arrays of fixed size, records with named fields, loops over
a range, calls of other kernels. Each is translated for the types of its arguments, as Numba
compiles it, with the same operations in the same order: with IEEE double arithmetic and without
contraction the results are those of the compiled kernel to the last bit, as far as the functions of
the mathematical library agree. Anything else is an `UntranslatableError`, with the kernel and
the line.

All is translated twice: the first pass finds which fields are written. The others are the
configuration, a structure of its own that can lie in read-only memory.
"""

import ast
import inspect
import re
import textwrap
import types
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stickslip.export.c.translator.statements import Statements
from stickslip.export.c.translator.types import (
    INT,
    NOTHING,
    REAL,
    Array,
    Layout,
    Record,
    Scalar,
    Struct,
    Structs,
    Tuple,
    Type,
    UntranslatableError,
    Vector,
    c_name,
    suffix,
)
from stickslip.export.c.translator.values import Value, constant

_PASSES = 6  # over a function until its types are settled
_WIDTH = 100  # characters a line


@dataclass
class Function:
    """A kernel in C, for certain types of its arguments."""

    name: str
    parameters: dict[str, Type]
    specialised: dict[str, bool | int | float]  # arguments that are constants
    result: Type = NOTHING
    writes: set[str] = field(default_factory=set[str])  # arrays among its arguments
    impure: bool = False
    readonly: bool = False  # whether its state can be declared const
    prototype: str = ""
    body: str = ""


class Unit:
    """The kernels of one C file.

    Parameters
    ----------
    structs
        The structures of the records.
    layout
        The parts of the state vector; None for kernels without one.
    prefix
        Of the names of types: the name of the module.
    in_place
        Kernels whose copy of the state is the state itself: the C step changes it in place.
    preconditions
        Kernels that raise an error for a state of another kind, which C's types exclude.
    overrides
        Functions that are written in place of the translation of a kernel.
    open_loops
        Whether kernels may have loops without a bound.
    """

    def __init__(
        self,
        structs: Structs,
        layout: Layout | None = None,
        *,
        prefix: str,
        in_place: tuple[str, ...] = (),
        preconditions: tuple[str, ...] = (),
        overrides: "Mapping[Any, Callable[[Unit], Function]] | None" = None,
        open_loops: bool = False,
    ) -> None:
        self.structs = structs
        self.layout = layout
        self.prefix = prefix
        self.in_place = in_place
        self.preconditions = preconditions
        self.overrides = dict(overrides or {})
        self.open_loops = open_loops
        self._functions: dict[Any, Function] = {}
        self._open: list[Any] = []
        self._tuples: dict[Tuple, str] = {}
        self._taken: dict[str, Any] = {}
        self._tables: dict[str, str] = {}

    def translate(self, entry: Callable[["Unit"], None]) -> None:
        """Translate what ``entry`` asks for by `function`."""
        entry(self)
        for struct in self.structs:
            struct.settled = True
        self._functions, self._tuples, self._taken = {}, {}, {}
        entry(self)

    # --- functions ---

    def function(self, python: types.FunctionType, arguments: list[Value]) -> Function:
        """Return a kernel translated for the types, and constants, of some arguments."""
        tree = _tree_of(python)
        names = [each.arg for each in tree.args.args]
        defaults = python.__defaults__ or ()
        if not python.__module__.startswith("stickslip."):
            raise UntranslatableError(f"the function {python.__module__}.{python.__name__}")
        given = [
            *arguments,
            *map(constant, defaults[len(defaults) - len(names) + len(arguments) :]),
        ]
        if len(given) != len(names):
            raise UntranslatableError(f"{python.__name__} is called with {len(arguments)} values")
        parameters = {n: v.type for n, v in zip(names, given, strict=True)}
        fixed = _sizes(tree, parameters)
        specialised = {
            name: value.const
            for k, (name, value) in enumerate(zip(names, given, strict=True))
            if value.const is not None
            and (k >= len(arguments) or (value.type == INT and name in fixed))
        }
        if python in self.overrides:
            return self._functions.setdefault((python, None), self.overrides[python](self))
        key = (python, tuple(parameters.items()), tuple(specialised.items()))
        if key in self._open:
            raise UntranslatableError(f"{python.__name__} calls itself")
        if key not in self._functions:
            self._open.append(key)
            name = self._free_name(python, key)
            made = _Translation(self, python, tree, parameters, specialised, name)
            self._functions[key] = made.run()
            self._open.pop()
        return self._functions[key]

    def _free_name(self, python: types.FunctionType, key: Any) -> str:
        """Return a name for a kernel: its module, as variables have the same names, and its own."""
        base = f"{python.__module__.rpartition('.')[2]}_{python.__name__.lstrip('_')}"
        name, count = base, 2
        while name in self._taken:
            name, count = f"{base}_{count}", count + 1
        self._taken[name] = key
        return name

    def name_of(self, python: types.FunctionType) -> str:
        """Return the name in C of a kernel that is translated once."""
        (name,) = (made.name for key, made in self._functions.items() if key[0] is python)
        return name

    def all_functions(self) -> tuple[Function, ...]:
        """Return the translated kernels, callees first."""
        return tuple(self._functions.values())

    def table(self, name: str, numbers: np.ndarray) -> Value:
        """Return the numbers of an array outside all kernels, as a constant of the file."""
        code = f"{self.prefix}_{name}".lower()
        kind = Array(numbers.shape, REAL, const=True)
        made = f"static const {self.declared(kind, code)} = {_braced(numbers.tolist())};"
        if self._tables.setdefault(code, made) != made:
            raise UntranslatableError(f"there are two arrays named {name}")
        return Value(kind, code)

    # --- code ---

    def type_name(self, kind: Type) -> str:
        """Return the name of a type of values."""
        if isinstance(kind, Scalar):
            return kind.name
        if isinstance(kind, Tuple):
            if kind not in self._tuples:
                for item in kind.items:
                    self.type_name(item)
                letters = "".join(map(suffix, kind.items))
                alike = set(letters) == {"r"}
                end = f"real{len(letters)}_t" if alike else f"tuple_{letters}_t"
                self._tuples[kind] = f"{self.prefix}_{end}"
            return self._tuples[kind]
        raise UntranslatableError(f"{kind} has no name")

    def declared(self, kind: Type, name: str) -> str:
        """Return the declaration of a variable."""
        if isinstance(kind, Tuple):
            return f"{self.type_name(kind)} {name}"
        return declaration(kind, name)

    def tuples(self) -> str:
        """Return the types of what functions return."""
        lines: list[str] = []
        for kind, name in self._tuples.items():
            if kind.alike:
                members = f"{self.declared(kind.items[0], 'v')}[{len(kind.items)}];"
            else:
                declared = (self.declared(item, f"v{k}") for k, item in enumerate(kind.items))
                members = " ".join(f"{each};" for each in declared)
            lines.append(f"typedef struct {{ {members} }} {name};")
        return "\n".join(lines)

    def functions(self) -> str:
        """Return all tables and functions, callees first."""
        made = (f"{each.prototype}\n{{\n{each.body}}}" for each in self._functions.values())
        return "\n\n".join([*self._tables.values(), *made])

    def structures(self) -> str:
        """Return the structures of both halves of all records that are used."""
        return "\n\n".join(
            self._structure(struct, half) for struct in self.structs for half in struct.halves
        )

    def _structure(self, struct: Struct, half: str) -> str:
        lines = ["typedef struct {"]
        for name in struct.used(half):
            declared = declaration(struct.fields[name][1], c_name(name), half)
            comment = struct.comments.get(name)
            lines.append(f"    {declared};" + (f" /* {comment} */" if comment else ""))
        lines.append(f"}} {struct_name(struct, half)};")
        return "\n".join(lines)


def declaration(kind: Type, name: str, half: str = "config") -> str:
    """Return the declaration of numbers, or of a half of a record."""
    if isinstance(kind, Array):
        return declaration(kind.item, name, half) + "".join(f"[{size}]" for size in kind.dims)
    if isinstance(kind, Record):
        return f"{struct_name(kind.struct, half)} {name}"
    assert isinstance(kind, Scalar)  # noqa: S101 - no other kind has a declaration
    return f"{kind.name} {name}"


def looped(dims: tuple[int, ...], lines: list[str]) -> list[str]:
    """Return statements in loops over all places of an array, by ``k0``, ``k1`` and so on."""
    for k, size in reversed(list(enumerate(dims))):
        head = f"for (int64_t k{k} = 0; k{k} < {size}; k{k} += 1) {{"
        lines = [head, *(f"    {line}" for line in lines), "}"]
    return lines


def struct_name(struct: Struct, half: str) -> str:
    """Return the name of half of a structure in C."""
    return f"{struct.name}_t" if struct.given else f"{struct.name}_{half}_t"


class _Translation(Statements):
    """The translation of one kernel for certain types."""

    def __init__(
        self,
        unit: Unit,
        python: types.FunctionType,
        tree: ast.FunctionDef,
        parameters: dict[str, Type],
        specialised: dict[str, bool | int | float],
        name: str,
    ) -> None:
        super().__init__()
        self.unit, self.python, self.tree = unit, python, tree
        self.made = Function(name, parameters, specialised)
        self.in_place = python.__name__ in unit.in_place
        self.skips_raise = python.__name__ in unit.preconditions
        stores = [
            each.id
            for each in ast.walk(tree)
            if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store)
        ]
        self.assigned = Counter([*stores, *parameters])
        self.indices = _index_names(tree, parameters)
        self.borrows = False  # whether it hands memory to a function that may change it
        self.c_parameters: list[str] = []

    def write(self, origin: tuple[str, Any, str]) -> None:
        """Note that memory is written."""
        kind, owner, name = origin
        if kind == "field":
            owner.written.add(name)
            self.made.impure = True
        elif kind == "parameter":
            self.made.writes.add(name)
            self.made.impure = True
        elif kind == "flat":
            self.made.impure = True

    def calls(self, called: Function) -> None:
        """Note that a kernel is called."""
        self.made.impure = self.made.impure or called.impure
        memory = any(not isinstance(kind, Scalar | Tuple) for kind in called.parameters.values())
        self.borrows = self.borrows or (memory and not called.readonly)

    def run(self) -> Function:
        """Translate until no type changes any more; then write the function."""
        for _ in range(_PASSES):
            self.unknown = False
            self.lines, self.scratch = [], 0
            self.names = dict(self._arguments())
            self.block(self.tree.body)
            if not self.unknown:
                break
        else:
            raise UntranslatableError("its types do not settle")
        self.made.result = self.result
        views = any(
            not isinstance(kind, Scalar | Tuple) and name not in self.stored
            for name, kind in self.types.items()
        )
        self.made.readonly = not (self.made.impure or self.borrows or views)
        self.made.prototype = self._prototype()
        body = "".join(f"{line}\n" for line in [*self._declarations(), *self.lines])
        self.made.body = "".join(f"{_wrapped(line)}\n" for line in body.splitlines())
        return self.made

    def _arguments(self) -> list[tuple[str, Value]]:
        found: list[tuple[str, Value]] = []
        for name, kind in self.made.parameters.items():
            code = c_name(name)
            if name in self.made.specialised:
                found.append((name, constant(self.made.specialised[name])))
            elif isinstance(kind, Record | Vector):
                config = (
                    code if isinstance(kind, Record) and kind.struct.given else f"{code}_config"
                )
                found.append((name, Value(kind, code, config=config)))
            else:
                origins = frozenset({("parameter", None, name)})
                found.append((name, Value(kind, code, origins=origins)))
            if isinstance(kind, Scalar):
                self.types.setdefault(name, kind)
        return found

    def _prototype(self) -> str:
        parts: list[str] = []
        read = "const " if self.made.readonly else ""
        for name, kind in self.made.parameters.items():
            code = c_name(name)
            if name in self.made.specialised or (isinstance(kind, Array) and 0 in kind.dims):
                continue
            if isinstance(kind, Array) and isinstance(kind.item, Record):
                kind = kind.item  # noqa: PLW2901 - a pointer to the first of them
            if isinstance(kind, Record):
                for half in kind.struct.halves:
                    const = "const " if half == "config" else read
                    own = f"{code}_config" if half == "config" and not kind.struct.given else code
                    parts.append(f"{const}{struct_name(kind.struct, half)} *{own}")
            elif isinstance(kind, Vector):
                label = kind.layout.name
                parts += [
                    f"const {label}_config_t *{code}_config",
                    f"{read}{label}_state_t *{code}",
                ]
            else:
                flat = isinstance(kind, Array) and len(kind.dims) == 1
                const = "const " if isinstance(kind, Array) and kind.const else ""
                const = const or (read if flat else "")
                parts.append(const + self.unit.declared(kind, code))
        self.c_parameters = [re.sub(r"\[\d+\]", "", part).split()[-1].strip("*") for part in parts]
        result = "void" if self.result == NOTHING else self.unit.type_name(self.result)
        lines = [f"static {result} {self.made.name}({', '.join(parts) or 'void'})"]
        document = ast.get_docstring(self.tree)
        if document:
            text = " ".join(document.split("\n\n")[0].split()).replace("*/", "* /")
            lines[:0] = _comment(text.replace("``", ""))
        return "\n".join([*lines[:-1], _wrapped(lines[-1])])

    def _declarations(self) -> list[str]:
        """Return the declarations of variables, and casts of those that nothing reads."""
        body = "\n".join(self.lines)
        lines: list[str] = []
        unread: list[str] = []
        for name, kind in self.types.items():
            code = c_name(name)
            if name in self.made.parameters:
                continue
            if isinstance(kind, Record):
                for half in kind.struct.halves:
                    own = f"{code}_config" if half == "config" else code
                    const = "const " if half == "config" else ""
                    if re.search(rf"\b{own} = ", body):
                        lines.append(f"{const}{struct_name(kind.struct, half)} *{own} = NULL;")
                        unread += [own] if not _reads(own, body) else []
                continue
            if not re.search(rf"\b{code}\b", body):
                continue
            if isinstance(kind, Array) and name not in self.stored:
                lines.append(self._view(kind, code))
            elif isinstance(kind, Array | Tuple):
                lines.append(f"{self.unit.declared(kind, code)};")
            else:
                first = {"real": "REAL(0.0)", "bool": "false"}.get(kind.name, "0")  # type: ignore[union-attr]
                lines.append(f"{self.unit.declared(kind, code)} = {first};")
            unread += [code] if not _reads(code, body) else []
        unread += [name for name in self.c_parameters if not re.search(rf"\b{name}\b", body)]
        return ["    " + line for line in [*lines, *(f"(void){name};" for name in unread)]]

    def _view(self, kind: Array, code: str) -> str:
        assert isinstance(kind.item, Scalar)  # noqa: S101 - records have pointers of their own
        const = "const " if kind.const else ""
        if len(kind.dims) == 1:
            return f"{const}{kind.item.name} *{code} = NULL;"
        rest = "".join(f"[{size}]" for size in kind.dims[1:])
        return f"{const}{kind.item.name} (*{code}){rest} = NULL;"


def _braced(numbers: Any) -> str:
    """Return nested numbers as an initialiser; zeros at the end of a row are left to C."""
    if not isinstance(numbers, list):
        return f"REAL({float(numbers)!r})"
    parts = [_braced(each) for each in numbers]
    while len(parts) > 1 and parts[-1] in ("REAL(0.0)", "{REAL(0.0)}"):
        del parts[-1]
    nested = isinstance(numbers[0], list)
    return f"{{{(',' + chr(10) if nested else ', ').join(parts)}}}"


def _reads(name: str, body: str) -> bool:
    """Return whether a variable is read anywhere."""
    writes = len(re.findall(rf"^\s*{name} = ", body, flags=re.MULTILINE))
    return len(re.findall(rf"\b{name}\b", body)) > writes


def _tree_of(python: types.FunctionType) -> ast.FunctionDef:
    """Return the syntax tree of a kernel, with the lines of its file."""
    lines, first = inspect.getsourcelines(python)
    tree = ast.parse(textwrap.dedent("".join(lines)))
    ast.increment_lineno(tree, first - 1)
    node = tree.body[0]
    if not isinstance(node, ast.FunctionDef):
        raise UntranslatableError(f"{python.__name__} is not a function")
    return node


def _index_names(tree: ast.FunctionDef, parameters: dict[str, Type]) -> set[str]:
    """Return the names in subscripts of a state, or of its copy."""
    states = {name for name, kind in parameters.items() if isinstance(kind, Vector)}
    copies = {
        each.targets[0].id
        for each in ast.walk(tree)
        if isinstance(each, ast.Assign)
        and isinstance(each.targets[0], ast.Name)
        and ast.unparse(each.value) in {f"{state}.copy()" for state in states}
    }
    found: set[str] = set()
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Subscript)
            and isinstance(node.value, ast.Name)
            and node.value.id in states | copies
        ):
            found |= {each.id for each in ast.walk(node.slice) if isinstance(each, ast.Name)}
    return found


def _sizes(tree: ast.FunctionDef, parameters: dict[str, Type]) -> set[str]:
    """Return the arguments of which a constant is kept: places in a state, bounds and sizes."""
    if any(isinstance(kind, Vector) for kind in parameters.values()):
        return set(parameters)
    found: set[str] = set()
    for node in ast.walk(tree):
        looked: list[ast.AST] = []
        if isinstance(node, ast.Call) and ast.unparse(node.func) in (
            "range",
            "np.empty",
            "np.zeros",
        ):
            looked = list(node.args)
        elif isinstance(node, ast.IfExp):
            looked = [node.test]
        found |= {each.id for one in looked for each in ast.walk(one) if isinstance(each, ast.Name)}
    return found & set(parameters)


def _comment(text: str) -> list[str]:
    lines = textwrap.wrap(text, _WIDTH - 6)
    if len(lines) == 1:
        return [f"/* {lines[0]} */"]
    return [f"/* {lines[0]}", *(f"   {line}" for line in lines[1:-1]), f"   {lines[-1]} */"]


def _wrapped(line: str) -> str:
    """Return a line broken after an operator or a comma where it is too long."""
    indent = " " * (len(line) - len(line.lstrip()) + 8)
    done: list[str] = []
    while len(line) > _WIDTH:
        head = line[:_WIDTH]
        places = [
            head.rfind(mark) + len(mark) for mark in (", ", " && ", " || ", " + ", " - ", " * ")
        ]
        place = max(places)
        if place <= len(indent) + 4:
            break
        done.append(line[:place].rstrip())
        line = indent + line[place:]
    return "\n".join([*done, line])
