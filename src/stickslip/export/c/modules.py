"""The modules of exported C code: which kernels each contains, and the layout of its state."""

import functools
import inspect
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from stickslip.control import equal_positions
from stickslip.control.pulses import exact, exact_state, kernel
from stickslip.estimation.energy.known_inertia.online import recursion as energy_recursion
from stickslip.estimation.energy.known_inertia.online import state as energy_state
from stickslip.estimation.online import recursion
from stickslip.estimation.online.faults import admission, guard
from stickslip.estimation.online.intervals import batches, contrasts
from stickslip.estimation.online.kalman import state as kalman
from stickslip.estimation.online.kalman.kernels import ekf_step
from stickslip.export.c.guard import GuardOverrides
from stickslip.export.c.kernels import deviations, friction
from stickslip.export.c.translator.types import (
    INT,
    REAL,
    Flat,
    Layout,
    Record,
    Struct,
    Structs,
    Tuple,
    Vector,
    field_comments,
    given_struct,
)
from stickslip.export.c.translator.unit import Unit
from stickslip.export.c.translator.values import Value, python_of
from stickslip.numerics.named_fields import places
from stickslip.records import SensorSample
from stickslip.simulation.kernels import arm, single_mass

_SAMPLE_UNITS = {
    "time": "[s]; only copied to records of pulses",
    "measured_position": "[m or rad]",
    "measured_velocity": "[m/s or rad/s]",
    "measured_load_position": "not read [m or rad]",
    "measured_load_velocity": "not read [m/s or rad/s]",
}


@dataclass(frozen=True, kw_only=True)
class Module:
    """A module of C code: translated kernels, and the layout of its configuration and state."""

    name: str  #: Ends the names of its files, ``stickslip_NAME.c``.
    unit: Unit  #: The translated kernels.
    entries: Mapping[str, str]  #: Names in C of the kernels that its functions call.
    layout: Layout | None = None  #: Of the state; None for the law, which has none.
    #: Fields of the state that `init` sets, as ``member.field``.
    first: tuple[str, ...] = ()
    copied: str = ""  #: A part of the state that begins as a copy of others.
    copies: tuple[str, ...] = ()  #: The statements for that.
    #: The structure of a sample; None where a sample is plain arguments.
    sample: Struct | None = None
    record: Struct | None = None  # of the law or a plant


def _structs(prefix: str, names: Mapping[str, tuple[Any, Any, str]]) -> Structs:
    """Return structures by name: the dtype of each, and where it is defined.

    That is a function, or a module with the name of a variable in it.
    """
    dtypes: dict[Any, str] = {}
    comments: dict[str, dict[str, str]] = {}
    for name, (dtype, place, variable) in names.items():
        dtypes[dtype] = f"{prefix}_{name}"
        source = inspect.getsource(place)
        if variable:
            form = rf"^{variable} = np\.dtype\(.*?^\)"
            found = re.search(form, source, re.MULTILINE | re.DOTALL)
            source = found[0] if found else ""
        comments[f"{prefix}_{name}"] = field_comments(source)
    return Structs(dtypes, comments)


def _variable(module: Any, name: str) -> tuple[Any, Any, str]:
    """Return the definition of fields by a variable of a module."""
    return getattr(module, name), module, name


def _online_structs(parameters: int) -> dict[str, tuple[Any, Any, str]]:
    """Return the definitions that both online estimators share."""
    kept = batches.batches_dtype(parameters)
    groups = contrasts.contrasts_dtype(parameters)
    return {
        "errors": _variable(admission, "_ERRORS"),
        "mass": _variable(admission, "_MASS"),
        "admitted": _variable(admission, "_SAMPLE"),
        "admission": _variable(admission, "ADMISSION_DTYPE"),
        "information": (kept["snapshots"].base, batches.batches_dtype, ""),
        "batches": (kept, batches.batches_dtype, ""),
        "contrasts": (groups, contrasts.contrasts_dtype, ""),
    }


def _translated(unit: Unit, entries: Mapping[str, tuple[Any, list[Value]]]) -> dict[str, str]:
    """Translate kernels with arguments; return their names in C."""

    def entry(each: Unit) -> None:
        for dispatcher, arguments in entries.values():
            each.function(python_of(dispatcher), arguments)

    unit.translate(entry)
    return {name: unit.name_of(python_of(dispatcher)) for name, (dispatcher, _) in entries.items()}


def _state(layout: Layout) -> Value:
    return Value(Vector(layout), "state", config="config")


def _reals(*names: str) -> list[Value]:
    return [Value(REAL, name) for name in names]


def _online(unit: Unit, layout: Layout, step: Any, deviation: Any) -> dict[str, str]:
    """Translate the kernels of an online estimator."""
    state = _state(layout)
    return _translated(
        unit,
        {
            "step": (step, [state, *_reals("u", "x", "v", "x2", "v2")]),
            "deviation": (deviation, [state, Value(INT, "i")]),
        },
    )


@functools.cache
def law_module() -> Module:
    """Return the friction law and the feedforward."""
    structs = _structs("stickslip", {"law": _variable(friction, "LAW")})
    struct = structs.of(friction.LAW)
    law = Value(Record(struct), "law", config="law")
    unit = Unit(structs, prefix="law")
    entries = _translated(
        unit,
        {
            "friction": (friction.friction_force, [law, *_reals("v")]),
            "feedforward": (friction.feedforward, [law, *_reals("v", "a")]),
        },
    )
    return Module(name="law", unit=unit, entries=entries, record=struct)


@functools.cache
def pulses_module(window: int) -> Module:
    """Return the exact pulse controller with a window of so many samples."""
    name = "stickslip_pulses"
    structs = _structs(
        name,
        {
            "motion": _variable(kernel, "HEAD"),
            "pulse": _variable(kernel, "PULSE"),
            "sensor": _variable(equal_positions, "SENSOR"),
            "learned": _variable(exact_state, "OWN_DTYPE"),
        },
    )
    own = kernel.OWN + places(exact_state.OWN_DTYPE)
    layout = Layout(
        name,
        own + window,
        (Flat("window", own, window, "positions in which rest is looked for"),),
        (
            ("motion", 0, structs.of(kernel.HEAD)),
            ("learned", kernel.OWN, structs.of(exact_state.OWN_DTYPE)),
        ),
    )
    sample = given_struct("stickslip_sample", SensorSample._fields, _SAMPLE_UNITS)
    structs.of(kernel.HEAD).written.add("target")  # by the function that sets another one
    unit = Unit(structs, layout, prefix="pulses", in_place=("_step",), preconditions=("readable",))
    step = exact._step  # pyright: ignore[reportPrivateUsage]
    arguments = [_state(layout), Value(Record(sample), "sample", config="sample")]
    return Module(
        name="pulses",
        unit=unit,
        entries=_translated(unit, {"step": (step, arguments)}),
        layout=layout,
        sample=sample,
        first=(
            "motion.target",
            "motion.rest",
            "motion.error",
            *(
                f"learned.{each}"
                for each in (
                    *("walk", "breakaway", "held", "moved_at", "share"),
                    *("best", "half_error", "allowed"),
                    *("values", "covariance"),
                )
            ),
        ),
    )


@functools.cache
def kalman_module(memory: int) -> Module:
    """Return the extended Kalman filter that keeps so many of its first samples."""
    name = "stickslip_kalman"
    structs = _structs(
        name,
        {
            **_online_structs(kalman.FRICTION),
            "filter": _variable(kalman, "_FILTER"),
            "own": _variable(kalman, "STATE"),
        },
    )
    kept = 3 * memory
    layout = Layout(
        name,
        kalman.MEMORY + kept,
        (Flat("memory", kalman.MEMORY, kept, "effort, position and velocity of first samples"),),
        (("own", 0, structs.of(kalman.STATE)),),
    )
    unit = Unit(structs, layout, prefix="kalman")
    entries = _online(unit, layout, ekf_step, deviations.kalman_deviation)
    filters = ("z", "P", "response")
    return Module(
        name="kalman",
        unit=unit,
        entries=entries,
        layout=layout,
        first=(
            *(f"own.{each}" for each in ("values", "force_variance", "stage", "gate_scale")),
            *("own.adapted", "own.replayed", "own.good", "own.good_covariance"),
            *(f"own.careful.{each}" for each in (*filters, "walk")),
            *(f"own.sharp.{each}" for each in filters),
            *("own.batches.length", "own.sharp_batches.length"),
        ),
    )


@functools.cache
def energy_module(parameters: int) -> Module:
    """Return the online energy estimator with a known inertia, of so many parameters."""
    name = "stickslip_energy"
    fields = energy_state._FIELDS  # pyright: ignore[reportPrivateUsage]
    structs = _structs(
        name,
        {
            **_online_structs(energy_state.MOST),
            "recursion": _variable(recursion, "RECURSION"),
            "guard": (fields["guard"], guard.guard_dtype, ""),
            "sample": _variable(energy_state, "_SAMPLE"),
            "disagreement": _variable(energy_state, "_DISAGREEMENT"),
            "own": _variable(energy_state, "_FIELDS"),
        },
    )
    structs.of(recursion.RECURSION).pins["parameters"] = parameters
    layout = Layout(name, energy_state.STATE_SIZE, (), (("own", 0, structs.of(fields)),))
    kept = GuardOverrides(layout, structs.of(fields["guard"]))
    unit = Unit(structs, layout, prefix="energy", overrides=kept.kernels())
    entries = _online(unit, layout, energy_recursion.work_step, deviations.energy_deviation)
    learned = ("typical_rows", "first_spread", "spread", "values")
    return Module(
        name="energy",
        unit=unit,
        entries=entries,
        layout=layout,
        first=(
            *(f"own.recursion.{each}" for each in learned),
            *("own.eta", "own.information", "own.batches.length"),
            *(f"own.{each}" for each in ("disturbance", "adaptations", "gate_scale")),
        ),
        copied="own.guard.kept",
        copies=tuple(kept.first_copy()),
    )


def _plant(name: str, kernels: Any, variable: str, step: Any, numbers: int) -> Module:
    """Return the exact motion of a plant over a sample; its state is a tuple of numbers."""
    structs = _structs(f"stickslip_{name}", {"model": _variable(kernels, variable)})
    struct = structs.of(getattr(kernels, variable))
    model = Value(Record(struct), "model", config="model")
    state = Value(Tuple((REAL,) * numbers), "state")
    unit = Unit(structs, prefix=name, open_loops=True)
    entries = _translated(unit, {"step": (step, [model, state, *_reals("u")])})
    return Module(name=name, unit=unit, entries=entries, record=struct)


@functools.cache
def axis_module() -> Module:
    """Return the exact motion of a single mass with affine friction."""
    return _plant("axis", single_mass, "MASS_MODEL", single_mass.mass_step, 5)


@functools.cache
def arm_module() -> Module:
    """Return the exact motion of a flexible arm with affine friction."""
    return _plant("arm", arm, "ARM_MODEL", arm.arm_step, 11)
