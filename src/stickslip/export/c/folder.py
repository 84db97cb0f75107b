"""The C sources of exported code, from templates and translated kernels."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.control import ExactPulseController
from stickslip.control.pulses import exact, exact_state, kernel
from stickslip.estimation import EnergyEstimator
from stickslip.estimation.online.kalman import state as kalman
from stickslip.estimation.online.kalman.extended_kalman import ExtendedKalmanFilter
from stickslip.export.base import axis_in_words
from stickslip.export.c import memory, modules
from stickslip.export.c.content import CodeContent
from stickslip.export.c.modules import Module
from stickslip.export.c.translator.types import Struct
from stickslip.export.c.translator.unit import declaration, looped
from stickslip.export.templates import filled_in
from stickslip.records import PositioningOutcome, mass_name, unit_of

REAL_FUNCTIONS = ("sqrt", "exp", "expm1", "log", "log1p", "ceil", "abs")
PAIR_FUNCTIONS = ("pow",)
LIBRARY = {"abs": "fabs"}
LIBRARY_FUNCTIONS = tuple(
    sorted({*(LIBRARY.get(name, name) for name in REAL_FUNCTIONS), *PAIR_FUNCTIONS})
)
"""Functions of the mathematical library that the code calls."""


FLOAT_BOUNDS = {"law": 2e-7, "kalman": 1e-3}
"""Largest error of a module in float, relative to the largest value of the same unit [-].

The law rounds a force about three times; errors of the Kalman filter are up to 2.2e-4. The energy
estimator computes in double, and corrections of the pulse controller are not comparable.
"""


@dataclass(frozen=True, kw_only=True)
class Part:
    """A module with its configuration: the first state, and what its templates need besides."""

    module: Module
    vector: Float[np.ndarray, " s"]
    template: str
    names: Mapping[str, Any]


def parts_of(content: CodeContent) -> tuple[Part, ...]:
    """Return the modules of the content, the law first."""
    found = [
        Part(
            module=modules.law_module(),
            vector=content.law.numbers(content.inertia, content.dead_band),
            template="law",
            names={},
        )
    ]
    if content.controller is not None:
        found.append(_pulses(content.controller))
    if content.kalman is not None:
        module = modules.kalman_module(content.kalman.memory)
        found.append(_estimator(module, content.kalman, content, _KALMAN))
    if content.energy is not None:
        module = modules.energy_module(len(content.energy.parameter_names(content.kind)))
        found.append(_estimator(module, content.energy, content, _ENERGY))
    return tuple(found)


def _pulses(controller: ExactPulseController) -> Part:
    reasons = exact._WHY  # pyright: ignore[reportPrivateUsage]
    words = {
        value: name
        for name in ("NO_BETTER", "EXHAUSTED", "HELD_FAST")
        for value in [getattr(exact_state, name)]
    }
    outcomes = [
        (PositioningOutcome.MOVING.value, kernel.MOVING),
        (PositioningOutcome.REACHED.value, kernel.REACHED),
        (PositioningOutcome.STOPPED.value, kernel.STOPPED),
    ]
    return Part(
        module=modules.pulses_module(controller.rest.samples),
        vector=controller.init(),
        template="pulses",
        names={
            "outcomes": outcomes,
            "reasons": [(words[value], value, text) for value, text in reasons.items()],
            "waiting": kernel.WAITING,
            "resting": kernel.RESTING,
            "coulomb": exact_state.COULOMB,
            "viscous": exact_state.VISCOUS,
        },
    )


_KALMAN = {
    "title": "Extended Kalman filter: friction of a rigid axis among its states.",
    "stages": [
        (name, getattr(kalman, name)) for name in ("LEARNING", "REPLAYING", "TRUSTED", "LEFT")
    ],
    "estimates": "state->own.values",
    "resets": "state->own.resets",
}
_ENERGY = {
    "title": "Online energy estimator of friction, the inertia being known, in double.",
    "real": "double",
    "stages": [],
    "estimates": "state->own.recursion.values",
    "resets": "state->own.guard.resets",
}


def _estimator(
    module: Module,
    chosen: ExtendedKalmanFilter | EnergyEstimator,
    content: CodeContent,
    names: Mapping[str, Any],
) -> Part:
    """Return an online estimator, with what only its own templates need."""
    velocity, kind = content.velocity_measured, content.kind
    return Part(
        module=module,
        vector=chosen.init(sampling_time=content.sampling_time, velocity_measured=velocity),
        template="estimator",
        names={
            **names,
            "parameters": [(name, unit_of(name, kind)) for name in chosen.parameter_names(kind)],
            "velocity": velocity,
        },
    )


# --- rendering ---


def template(name: str, **context: Any) -> str:
    """Return a template of the folder, filled in."""
    return filled_in("stickslip.export.c", f"{name}.j2", **context)


def hexadecimal(value: float) -> str:
    """Return a double exactly, as C writes it."""
    if math.isnan(value):
        return "(double)NAN"
    if math.isinf(value):
        return "(double)INFINITY" if value > 0.0 else "-(double)INFINITY"
    return float(value).hex()


def _public(text: str, real: str = "stickslip_real") -> str:
    """Return declarations with the public name of the type of numbers."""
    return re.sub(r"\breal\b", real, text)


def _doubles(text: str) -> str:
    """Return initialisers without casts to the type of the other modules."""
    return re.sub(r"STICKSLIP_REAL\((.*?)\)", r"\1", text).replace(
        "STICKSLIP_INFINITY", "(double)INFINITY"
    )


def context(part: Part, content: CodeContent) -> dict[str, Any]:
    """Return what the templates of a module are filled with."""
    module, kind = part.module, content.kind
    units = {
        "position": unit_of("position", kind),
        "velocity": unit_of("velocity", kind),
        "acceleration": unit_of("velocity", kind) + "^2",
        "effort": unit_of("effort", kind),
        "mass": unit_of(mass_name(kind), kind),
        "viscous": unit_of("viscous_friction", kind),
    }
    real = part.names.get("real", "stickslip_real")
    made: dict[str, Any] = {
        "name": module.name,
        "banner": content.banner,
        "axis": axis_in_words(content.axis),
        "real": real,
        "float_bound": FLOAT_BOUNDS.get(module.name),
        "structures": _public(module.unit.structures(), real),
        "tuples": module.unit.tuples(),
        "functions": module.unit.functions(),
        **{f"unit_{name}": unit for name, unit in units.items()},
        **module.entries,
        **part.names,
    }
    if module.layout is None:
        assert module.record is not None  # noqa: S101 - the law has a record
        return made | {"config_values": memory.members(module.record, part.vector)}
    return made | _memory(module, part.vector, real)


def _memory(module: Module, vector: Float[np.ndarray, " s"], real: str) -> dict[str, Any]:
    """Return declarations and values of a module's configuration and state."""
    layout = module.layout
    assert layout is not None  # noqa: S101 - the caller has looked
    memory.check_first(module, vector)
    firsts = memory.first_values(module)
    written = _doubles if real == "double" else str
    state = [f"{struct}_state_t {member};" for member, struct in _members(layout.records, "state")]
    state += [f"{real} {flat.name}[{flat.size}]; /* {flat.comment} */" for flat in layout.flats]
    return {
        "firsts": [_public(declaration(first.kind, first.name), real) for first in firsts],
        "config_members": [
            f"{struct}_config_t {member}" for member, struct in _members(layout.records, "config")
        ],
        "state_members": state,
        "init_lines": [
            *(line for first in firsts for line in _init_lines(first)),
            *module.copies,
        ],
        "config_records": [
            (
                member,
                [(name, written(text)) for name, text in memory.members(struct, vector[start:])],
            )
            for member, start, struct in layout.records
            if "config" in struct.halves
        ],
        "first_values": [
            (first.name, written(memory.initialiser(first.kind, vector[first.places])))
            for first in firsts
        ],
        "sample_structure": "" if module.sample is None else _public(_given(module.sample)),
    }


def _members(records: Any, half: str) -> list[tuple[str, str]]:
    return [(member, struct.name) for member, _, struct in records if half in struct.halves]


def _given(struct: Struct) -> str:
    lines = [f"    real {name}; /* {struct.comments[name]} */" for name in struct.fields]
    return "\n".join(["typedef struct {", *lines, f"}} {struct.name}_t;"])


def _init_lines(first: memory.FirstValue) -> list[str]:
    """Return the statements that set a part of the state from the first values."""
    dims = getattr(first.kind, "dims", ())
    place = "".join(f"[k{k}]" for k in range(len(dims)))
    return looped(dims, [f"state->{first.member}{place} = config->first.{first.name}{place};"])


def sources(content: CodeContent) -> dict[str, str]:
    """Return the C sources and headers, by name."""
    common = {
        "banner": content.banner,
        "arithmetic": "FLOAT" if content.precision == "single" else "DOUBLE",
        "functions": REAL_FUNCTIONS,
        "pairs": PAIR_FUNCTIONS,
        "library": LIBRARY,
    }
    files = {f"stickslip_{name}.h": template(f"{name}.h", **common) for name in ("types", "math")}
    for part in parts_of(content):
        filled = context(part, content)
        name = part.module.name
        config = "law_config.c" if name == "law" else "config.c"
        files[f"stickslip_{name}.h"] = template(f"{part.template}.h", m=filled)
        files[f"stickslip_{name}.c"] = template(f"{part.template}.c", m=filled)
        files[f"stickslip_{name}_config.c"] = template(config, m=filled)
    return files
