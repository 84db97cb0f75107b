"""C programs for Frama-C: a call of exported code in any state that its invariant allows."""

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from stickslip.export.c.folder import LIBRARY_FUNCTIONS, PAIR_FUNCTIONS, Part
from stickslip.export.c.translator.types import INT, Array, Record, Struct, c_name

COUNTED = 2**52
"""Largest count before a call: 142 000 years at 1 kHz."""
_MOST = 64  # that a call adds to a count or, where an error is learned, takes from it


@dataclass(frozen=True, kw_only=True)
class _Calls:
    """Statements of the calls of a module, and the variables that they need."""

    given: dict[str, str]  # types by name
    calls: tuple[str, ...]


def _estimator(name: str, real: str) -> _Calls:
    return _Calls(
        given={"u": real, "x": real, "v": real, "result": f"stickslip_{name}_result_t"},
        calls=(
            f"stickslip_{name}_step(&config, &state, u, x, v)",
            f"stickslip_{name}_step_missing(&config, &state, u, x, v)",
            f"stickslip_{name}_result(&config, &state, &result)",
        ),
    )


_CALLS = {
    "law": _Calls(
        given=dict.fromkeys(("v", "a", "effort"), "stickslip_real"),
        calls=(
            "stickslip_law_friction(&config, v, &effort)",
            "stickslip_law_feedforward(&config, v, a, &effort)",
        ),
    ),
    "pulses": _Calls(
        given={
            "sample": "stickslip_sample_t",
            "target": "stickslip_real",
            "effort": "stickslip_real",
            "result": "stickslip_pulses_result_t",
        },
        calls=(
            "stickslip_pulses_step(&config, &state, &sample, &effort)",
            "stickslip_pulses_retarget(&config, &state, target)",
            "stickslip_pulses_result(&config, &state, &result)",
        ),
    ),
    "kalman": _estimator("kalman", "stickslip_real"),
    "energy": _estimator("energy", "double"),
}


def _ranges(part: Part) -> Mapping[str, tuple[int, int] | None]:
    """Return smallest and largest value by member of the state; None for one that may be anything.

    Whole numbers that are not listed are counts. Two double in a call at most: a length of batches
    where as many samples have come, and a stride of positions where it is a 32nd of the age.
    """
    name, layout = part.module.name, part.module.layout
    kept = 0 if layout is None else sum(flat.size for flat in layout.flats)
    flag = (0, 1)
    lengths = {"own.batches.length": (0, COUNTED), "own.batches.closed": (0, 9)}
    found: dict[str, Mapping[str, tuple[int, int] | None]] = {
        "pulses": {
            **dict.fromkeys(("motion.phase", "motion.outcome"), (0, 2)),
            **dict.fromkeys(("motion.pending", "motion.fresh"), flag),
            "motion.level": (0, 0),
            "motion.filled": (0, kept),
            "motion.next": (0, kept - 1),
            "motion.position_count": (0, 64),
            "motion.stride": (0, COUNTED),
            **dict.fromkeys(("motion.pulse.moved", "motion.pulse.level_count"), flag),
            **dict.fromkeys(("motion.last.moved", "motion.last.level_count"), flag),
            "learned.reason": (0, 3),
        },
        "kalman": {
            **lengths,
            "own.sharp_batches.length": (0, COUNTED),
            "own.sharp_batches.closed": (0, 9),
            "own.stage": (0, 3),
            "own.stored": (0, kept // 3),
            "own.replayed": (1, kept // 3),
        },
        "energy": {
            **lengths,
            "own.force_events": (0, COUNTED),  # a real number
            **{f"own.ring[{k}].missing": None for k in range(65)},
        },
    }
    return found.get(name, {})


_DOUBLED = ("length", "stride")


def program(part: Part) -> str:
    """Return a program with two entries: ``begin`` makes the first state, ``call`` takes any state.

    Before a call the real numbers of configuration, state and inputs are anything, NaN and
    infinity included; whole numbers of the configuration are those that were exported, and those
    of the state are in their ranges. Both entries assert these ranges at their end, so that what
    holds of one call holds of any number of calls.
    """
    name, layout = part.module.name, part.module.layout
    records, ranges = () if layout is None else layout.records, _ranges(part)
    of_state = [each for at, _, struct in records for each in _whole(struct, "state", at)]
    of_state = [each for each in {*of_state, *ranges} if ranges.get(each, ()) is not None]
    of_config = [each for at, _, struct in records for each in _whole(struct, "config", at)]
    before = [_within(each, ranges.get(each), 0) for each in sorted(of_state)]
    after = [_within(each, ranges.get(each), _MOST) for each in sorted(of_state)]
    given = {"config": f"stickslip_{name}_config_t", **_CALLS[name].given}
    if layout is not None:
        given["state"] = f"stickslip_{name}_state_t"
    lines = [
        f'#include "stickslip_{name}.h"',
        "static volatile double any_double;",
        "static volatile float any_float;",
        "static volatile int any_call;",
        *_library(),
    ]
    for variable, kind in given.items():
        lines += [f"static volatile {kind} any_{variable};", f"static {kind} {variable};"]
    if layout is not None:
        lines += [
            "void begin(void) {",
            f"    stickslip_{name}_init(&stickslip_{name}, &state);",
            *_asserted(before),
            "}",
        ]
    lines += [
        "void call(void) {",
        *(f"    {variable} = any_{variable};" for variable in given),
        # Eva does not conclude from the other comparisons that a number is none
        *(f"    if (state.{each} != state.{each}) return;" for each in ranges if ranges[each]),
        *(f"    if (!({each})) return;" for each in before),
        *(f"    config.{each} = stickslip_{name}.{each};" for each in of_config),
        "    switch (any_call) {",
        *(f"    case {k}: {call}; break;" for k, call in enumerate(_CALLS[name].calls)),
        "    default: break;",
        "    }",
        *_asserted(after),
        "}",
    ]
    return "\n".join(lines) + "\n"


def _library() -> list[str]:
    """Return functions of the mathematical library that may return anything."""
    lines: list[str] = []
    for name in LIBRARY_FUNCTIONS:
        for kind, end in (("double", ""), ("float", "f")):
            arguments = f"{kind} x, {kind} y" if name in PAIR_FUNCTIONS else f"{kind} x"
            used = "(void)x; (void)y;" if name in PAIR_FUNCTIONS else "(void)x;"
            lines.append(f"{kind} {name}{end}({arguments}) {{ {used} return any_{kind}; }}")
    return lines


def _asserted(conditions: list[str]) -> list[str]:
    return [f"    /*@ assert {each}; */" for each in conditions]


def _within(member: str, ends: tuple[int, int] | None, more: int) -> str:
    low, high = (-COUNTED - more, COUNTED + more) if ends is None else ends
    if more and member.endswith(_DOUBLED):
        high *= 2
    elif more and high == COUNTED:
        high += more
    return f"{low} <= state.{member} && state.{member} <= {high}"


def _whole(struct: Struct, half: str, path: str) -> Iterator[str]:
    """Iterate over the members of a record that are whole numbers."""
    for name in struct.used(half):
        kind = struct.fields[name][1]
        inner = kind.item if isinstance(kind, Array) else kind
        dims = kind.dims if isinstance(kind, Array) else ()
        for index in itertools.product(*map(range, dims)):
            member = f"{path}.{c_name(name)}" + "".join(f"[{k}]" for k in index)
            if isinstance(inner, Record):
                yield from _whole(inner.struct, half, member)
            elif inner == INT:
                yield member
