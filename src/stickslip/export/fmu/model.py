"""The models of functional mock-up units: their variables, and their C sources."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from stickslip.export.c.content import CodeContent
from stickslip.export.c.folder import LIBRARY, PAIR_FUNCTIONS, REAL_FUNCTIONS, sources, template
from stickslip.export.c.memory import members
from stickslip.export.c.modules import Module, arm_module, axis_module
from stickslip.export.c.translator.types import REAL, Tuple
from stickslip.export.c.translator.unit import struct_name
from stickslip.export.template_exporter import identifier
from stickslip.export.templates import filled_in
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.records import AxisKind, mass_name, parameter_label, unit_of
from stickslip.simulation.plant_kernels import kernel_model

_ANY = 1_000_000_000  # samples of a communication step
_COUNTS = ("missing_samples", "position_glitches", "effort_glitches", "resets")
_Causality = Literal["independent", "input", "output", "parameter", "local"]


@dataclass(frozen=True)
class Variable:
    """A variable of a unit; its place in the list is its value reference."""

    name: str  #: As in the model description.
    causality: _Causality  #: As in the model description; a local variable is a constant.
    description: str  #: As in the model description.
    unit: str  #: As in the model description.
    start: float | None = None  #: Value before the first step; None for what is calculated.

    @property
    def variability(self) -> str:
        """How it changes, in the words of the standard."""
        of = {"independent": "continuous", "parameter": "fixed", "local": "constant"}
        return of.get(self.causality, "discrete")

    @property
    def initial(self) -> str:
        """How its first value is made, in the words of the standard; empty for the default."""
        return {"output": "calculated", "parameter": "exact", "local": "exact"}.get(
            self.causality, ""
        )


@dataclass(frozen=True, kw_only=True)
class FmuModel:
    """A model of a unit."""

    title: str  #: Its name.
    identifier: str  #: Its name in C and of its binaries.
    sampling_time: float  #: Of the model [s].
    variables: tuple[Variable, ...]  #: The time first.
    #: Files in C by name; the unit's own file includes ``model.c``.
    sources: Mapping[str, str] = field(repr=False)
    most_samples: int = _ANY  #: Samples that a communication step may have.


def _variables(
    T: float, kind: AxisKind, constants: Mapping[str, float], *rows: Variable
) -> tuple[Variable, ...]:
    """Return the time, the rows, the sampling time and the constants by name."""
    return (
        Variable("time", "independent", "Time", "s"),
        *rows,
        *(
            Variable(name, "local", parameter_label(name, kind), unit_of(name, kind), value)
            for name, value in {"sampling_time": T, **constants}.items()
        ),
    )


def plant_model(
    axis: str,
    plant: SingleMass[CoulombViscousFriction] | FlexibleArm[CoulombViscousFriction],
    sampling_time: float,
    banner: str,
) -> FmuModel:
    """Return the exact motion of a plant with affine friction, its effort held over a sample [s].

    A sampling time that is too long for the plant is refused.
    """
    kind, flexible = plant.kind, plant.flexible
    what = "arm" if flexible else "axis"
    law = plant.friction
    inertia = mass_name(kind)
    if isinstance(plant, FlexibleArm):
        constants = {
            inertia: plant.mass_1,
            f"load_{inertia}": plant.mass_2,
            "stiffness": plant.stiffness,
        }
    else:
        constants = {inertia: plant.mass}
    constants |= {
        name: getattr(law, name)
        for quantity in ("coulomb_friction", "static_friction", "viscous_friction")
        for name in (f"{quantity}_positive", f"{quantity}_negative")
    } | {"offset": law.offset}
    names = plant.state_names
    held = "Effort, held over a communication step"
    effort = Variable("effort", "input", held, unit_of("effort", kind), 0.0)
    words = {name: name.replace("_", " ") for name in names}
    units = [unit_of(name.removeprefix("load_"), kind) for name in names]
    outputs = [
        Variable(name, "output", words[name].capitalize(), unit)
        for name, unit in zip(names, units, strict=True)
    ]
    first = [
        Variable(f"initial_{name}", "parameter", f"Initial {words[name]}", unit, 0.0)
        for name, unit in zip(names, units, strict=True)
    ]
    title = f"{axis}: " + ("flexible arm" if flexible else "rigid axis") + " with friction"
    module = arm_module() if flexible else axis_module()
    model = kernel_model(plant, sampling_time).copy()
    return FmuModel(
        title=title,
        identifier=f"{identifier(axis)}_{what}",
        sampling_time=sampling_time,
        variables=_variables(sampling_time, kind, constants, effort, *outputs, *first),
        sources={
            "model.c": _plant_source(module, model, len(names), title, banner),
            "stickslip_types.h": template("types.h", banner=banner, arithmetic="DOUBLE"),
            "stickslip_math.h": template(
                "math.h",
                banner=banner,
                functions=(*REAL_FUNCTIONS, "floor", "sin"),
                pairs=(*PAIR_FUNCTIONS, "fmod", "atan2", "hypot"),
                library=LIBRARY,
            ),
        },
    )


def _plant_source(module: Module, model: Any, outputs: int, title: str, banner: str) -> str:
    unit, record = module.unit, module.record
    (step,) = (each for each in unit.all_functions() if each.name == module.entries["step"])
    assert record is not None  # noqa: S101 - a plant has a record
    assert isinstance(step.result, Tuple)  # noqa: S101 - state and output
    state = step.result.items[0]
    assert isinstance(state, Tuple)  # noqa: S101 - numbers
    assert step.result.items[1] == Tuple((REAL,) * outputs)  # noqa: S101 - as the template has it
    return filled_in(
        "stickslip.export.fmu",
        "plant.c.j2",
        banner=banner,
        title=title,
        structures=unit.structures(),
        tuples=unit.tuples(),
        functions=unit.functions(),
        config_type=struct_name(record, "config"),
        config=members(record, model),
        state_type=unit.type_name(state),
        result_type=unit.type_name(step.result),
        step=step.name,
        mode=len(state.items) - 1,
        outputs=outputs,
        effort=1,
        first_output=2,
        first_parameter=2 + outputs,
    )


def observer_model(content: CodeContent, banner: str) -> FmuModel:
    """Return the online energy estimator of a content that holds one."""
    estimator, kind = content.energy, content.kind
    assert estimator is not None  # noqa: S101 - see above
    names = estimator.parameter_names(kind)
    measured = "Measured {} at the start of the communication step; NaN if missing"
    rows = [
        Variable(name, "input", measured.format(name), unit_of(name, kind), 0.0)
        for name in ("effort", "position")
    ]
    first_output = 1 + len(rows)
    for name in names:
        label, unit = parameter_label(name, kind), unit_of(name, kind)
        deviation = f"{label}: standard deviation by the model"
        rows += [
            Variable(name, "output", label, unit),
            Variable(f"{name}_deviation", "output", deviation, unit),
        ]
    rows += [Variable(name, "output", name.replace("_", " ").capitalize(), "1") for name in _COUNTS]
    title = f"{content.axis}: online estimator of friction"
    own = f"{identifier(content.axis)}_observer"
    needed = replace(content, controller=None, kalman=None, banner=banner)
    files = {name: text for name, text in sources(needed).items() if "law" not in name}
    files["model.c"] = filled_in(
        "stickslip.export.fmu",
        "observer.c.j2",
        banner=banner,
        title=title,
        identifier=own,
        names=names,
        counts=_COUNTS,
        effort=1,
        first_output=first_output,
    )
    constants = {mass_name(kind): content.inertia}
    return FmuModel(
        title=title,
        identifier=own,
        sampling_time=content.sampling_time,
        variables=_variables(content.sampling_time, kind, constants, *rows),
        sources=files,
        most_samples=1,
    )
