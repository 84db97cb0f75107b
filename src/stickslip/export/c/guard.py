"""The guard of an online estimator in C: a copy of what the recursion has learned.

In Python it copies numbers of the state without their names. In C it is a structure of the same
fields, without those that are configuration.
"""

from collections.abc import Callable
from typing import Any

from stickslip.estimation.online.faults import guard
from stickslip.export.c.translator.types import (
    BOOL,
    NOTHING,
    REAL,
    Array,
    Layout,
    Record,
    Scalar,
    Struct,
    Type,
    UntranslatableError,
    Vector,
)
from stickslip.export.c.translator.unit import Function, Unit, looped
from stickslip.export.c.translator.values import python_of

_INDENT = "    "


class GuardOverrides:
    """The kernels of the guard in C.

    The first record of the ``layout`` of the state begins with the fields that are kept.
    """

    def __init__(self, layout: Layout, struct: Struct) -> None:
        self.layout, self.struct = layout, struct
        member, start, owner = layout.records[0]
        size = struct.fields["kept"][1]
        if start != 0 or not isinstance(size, Array):
            raise UntranslatableError("the guard of a state that does not begin with what it keeps")
        fields = {
            name: (offset, kind)
            for name, (offset, kind) in owner.fields.items()
            if offset < size.dims[0]
        }
        self.learned = Struct(f"{layout.name}_kept", fields, {}, state_only=True)
        self.learned.read |= set(fields)
        self.learned.written |= set(fields)
        struct.fields["kept"] = (struct.fields["kept"][0], Record(self.learned))
        self.member, self.owner = member, owner

    def kernels(self) -> dict[Any, Callable[[Unit], Function]]:
        """Return what is written in place of each kernel."""
        return {
            python_of(guard.keep_state): self._keep,
            python_of(guard.restore_state): self._restore,
        }

    def first_copy(self) -> list[str]:
        """Return the statements that copy the first state."""
        return [
            line.replace("guard->", f"state->{self.member}.guard.")
            for line in self._copy(to_guard=True)
        ]

    def _copy(self, *, to_guard: bool) -> list[str]:
        lines: list[str] = []
        for name in self.learned.used("state"):
            kind = self.learned.fields[name][1]
            own, kept = f"state->{self.member}.{name}", f"guard->kept.{name}"
            target, source = (kept, own) if to_guard else (own, kept)
            if isinstance(kind, Array):
                lines.append(f"(void)memcpy({target}, {source}, sizeof {source});")
            else:
                lines.append(f"{target} = {source};")
        return lines

    def _finite(self, path: str, kind: Type) -> list[str]:
        """Return the statements that look for numbers that are not finite."""
        if kind == REAL:
            return [f"finite = finite && is_finite({path});"]
        if isinstance(kind, Record):
            parts = [
                self._finite(f"{path}.{name}", kind.struct.fields[name][1])
                for name in kind.struct.used("state")
            ]
            return [line for part in parts for line in part]
        if isinstance(kind, Array):
            place = "".join(f"[k{k}]" for k in range(len(kind.dims)))
            return looped(kind.dims, self._finite(path + place, kind.item))
        return []

    def _keep(self, unit: Unit) -> Function:
        lines = ["bool finite = true;", "(void)state_config;"]
        for name in self.learned.used("state"):
            lines += self._finite(f"state->{self.member}.{name}", self.learned.fields[name][1])
        lines += ["if (finite) {", *(_INDENT + line for line in self._copy(to_guard=True))]
        lines += [f"{_INDENT}guard->since = 0;", "}", "return finite;"]
        return self._made(unit, guard.keep_state, BOOL, lines)

    def _restore(self, unit: Unit) -> Function:
        lines = ["(void)state_config;", *self._copy(to_guard=False)]
        lines += ["guard->resets += 1;", "guard->since = 0;"]
        return self._made(unit, guard.restore_state, NOTHING, lines)

    def _made(self, unit: Unit, kernel: Any, result: Scalar, lines: list[str]) -> Function:
        self.struct.read |= {"resets", "since", "kept"}
        self.struct.written |= {"resets", "since", "kept"}
        self.owner.read |= set(self.learned.fields)
        self.owner.written |= {
            name for name, (_, kind) in self.learned.fields.items() if not isinstance(kind, Record)
        }
        name, label = f"guard_{kernel.__name__}", self.layout.name
        arguments = (
            f"const {label}_config_t *state_config, {label}_state_t *state,\n"
            f"{_INDENT * 3}{self.struct.name}_state_t *guard"
        )
        return Function(
            name=name,
            parameters={"state": Vector(self.layout), "guard": Record(self.struct)},
            specialised={},
            result=result,
            impure=True,
            prototype=f"static {unit.type_name(result)} {name}({arguments})",
            body="".join(f"{_INDENT}{line}\n" for line in lines),
        )
