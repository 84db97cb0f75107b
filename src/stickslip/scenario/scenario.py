"""A positioning task: its tables, checked against each other, and the controller built of them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stickslip.control import GuardedController, PositionController
from stickslip.records import InputError, LearnedPulses, ScenarioTables, mass_name, unit_of
from stickslip.scenario.axis import AXES
from stickslip.scenario.controllers import ARM_CONTROLLERS, AXIS_CONTROLLERS
from stickslip.scenario.controllers.base import Controller, Setup
from stickslip.scenario.guess import GuessTable
from stickslip.scenario.table import Document, Read, ScenarioError, Table, key
from stickslip.scenario.task import SensorsTable, TaskTable

_TABLES = ("axis", "task", "sensors", "controller", "guess")


@dataclass(frozen=True, kw_only=True)
class BuiltController:
    """A controller, set to the first target, with notes for the user."""

    controller: PositionController[Any]
    guarded: GuardedController  # the same within the limits of the task
    sources: dict[str, str]  # of each first guess, by name
    notes: tuple[str, ...]  # one sentence each


@dataclass(frozen=True, kw_only=True)
class Scenario(Setup):
    """A positioning task on a simulated axis.

    Tables that contradict each other, and a task that the axis cannot do, are errors.
    """

    controller: Controller

    def __post_init__(self) -> None:
        self.controller.check(self)
        self._check_effort()
        step, tolerance = self.sensors.encoder_step, self.task.tolerance
        if tolerance < step:
            raise ScenarioError(
                "tolerance_below_encoder",
                where="[task]",
                tolerance=tolerance,
                step=step,
                unit=unit_of("position", self.kind),
            )

    def _check_effort(self) -> None:
        """Check that the effort limit moves the axis both ways, and that the axis can rest."""
        law, unit = self.axis.friction(), unit_of("effort", self.kind)
        offset, limit = law.offset, self.controller.effort_limit
        rigid = not self.axis.flexible
        # The offset opposes a motion in one direction, and helps it in the other
        sides = (("positive", offset), ("negative", -offset))
        for (direction, lost), static in zip(sides, law.breakaway(), strict=True):
            needed = static + lost
            if limit <= needed:
                raise ScenarioError(
                    "limit_below_breakaway",
                    where="[controller]",
                    limit=limit,
                    direction=direction,
                    needed=needed,
                    static=static,
                    offset=offset,
                    unit=unit,
                )
            if needed <= 0 and self.controller.learns:
                raise ScenarioError(
                    "offset_above_static_friction",
                    where="[axis]",
                    offset=offset,
                    static=static,
                    unit=unit,
                    rigid=rigid,
                )
        for direction, lost in sides:
            coulomb = float(getattr(law, f"coulomb_friction_{direction}"))
            if coulomb + lost <= 0 and self.controller.learns:
                raise ScenarioError(
                    "axis_does_not_stop" if offset else "axis_without_coulomb_friction",
                    where="[axis]",
                    coulomb=coulomb,
                    direction=direction,
                    offset=offset,
                    unit=unit,
                    rigid=rigid,
                )

    def build(self, folder: Path, learned: LearnedPulses | None = None) -> BuiltController:
        """Return the controller, set to the first target."""
        table, file = self.controller, self.guess.learned
        try:
            if learned is None:
                first = table.begin(self, folder)
            else:
                first = table.guesses_of(learned, self.kind, "the run before")
            try:
                controller = table.build(self, first)
            except InputError as error:
                if first.learned is None or file is None or isinstance(error, ScenarioError):
                    raise
                raise error.at(f"[guess], learned, {folder / file}") from None
            return BuiltController(
                controller=controller,
                guarded=GuardedController(controller=controller, limits=table.limits(self, first)),
                sources=table.sources(self, first, controller),
                notes=table.notes(self, first, controller),
            )
        except InputError as error:
            plain = error.on(self.kind)
            raise (
                plain if plain.where else plain.at("[controller] and [guess]", keys=True)
            ) from None

    def tables(self) -> ScenarioTables:
        """Return the values of all tables, with units."""
        shown = {name: getattr(self, name).shown(self.kind) for name in _TABLES}
        return {name: values for name, values in shown.items() if values}


class _Head(Table):
    """The keys before the first table."""

    name: str | None = key("title of the task", says="the file's name")


@dataclass(frozen=True, kw_only=True)
class ScenarioFile(Read[Scenario]):
    """A scenario with its file, and the files that it names."""

    @property
    def learns(self) -> bool:
        """Whether the controller learns values that can be saved."""
        return self.scenario.controller.learns

    @property
    def learned(self) -> Path | None:
        """The file of an earlier run to resume from."""
        named = self.scenario.guess.learned
        return None if named is None else self.path.parent / named

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The files that the scenario names."""
        guess = self.scenario.guess
        return tuple(self.path.parent / each for each in (guess.estimate, guess.learned) if each)


def read_scenario(path: Path | str) -> ScenarioFile:
    """Read a scenario from a TOML file.

    Raises
    ------
    InputError
        If it is missing, is not TOML, has an unknown key (near names are suggested) or a value
        out of its range, or its tables contradict each other.
    """
    path = Path(path)
    document = Document(path, _Head, _TABLES)
    head, axis = document.table("", _Head), document.table("axis", AXES)
    task = document.table("task", TaskTable)
    sensors = document.table("sensors", SensorsTable, optional=True)
    method = document.raw("controller").get("method")
    own, others = AXIS_CONTROLLERS, ARM_CONTROLLERS
    if axis.flexible:
        own, others = others, own
    if isinstance(method, str) and method in others.models and method not in own.models:
        raise ScenarioError(
            "method_of_rigid_axis" if axis.flexible else "method_of_arm",
            where=f"{path}, [controller]",
            method=method,
            methods=tuple(own.models),
            load=f"load_{mass_name(axis.kind)}",
        )
    controller = document.table("controller", own)
    guess = document.table("guess", GuessTable, optional=True)
    try:
        scenario = Scenario(
            axis=axis, task=task, sensors=sensors, controller=controller, guess=guess
        )
    except InputError as error:
        raise error.at(str(path), keys=True) from None
    return ScenarioFile(scenario=scenario, title=head.name, path=path, sha256=document.sha256)
