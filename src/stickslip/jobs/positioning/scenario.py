"""A positioning task as a TOML file describes it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, ClassVar

from stickslip.jobs.positioning.axis_file import read_axis_file
from stickslip.jobs.positioning.axis_table import AxisTable
from stickslip.jobs.positioning.control_table import OF_ARMS, ControllerTable
from stickslip.jobs.positioning.tables import GuessTable, SensorsTable, TaskTable
from stickslip.records import AxisKind, InputError, ScenarioTables, unit_of

__all__ = ["Scenario", "ScenarioFile", "read_scenario"]

_STILL = 0.01
"""Share of the tolerance: an axis on bristles that moves no farther rests."""

_TABLES = ("axis", "task", "sensors", "controller", "guess")

# Of what is no quantity that records know
_UNITS: Mapping[str, tuple[str, str]] = {
    "integral_gain": ("N/(m s)", "N m/(rad s)"),
    "bandwidth": ("Hz", "Hz"),
    "dither_frequency": ("Hz", "Hz"),
}


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """A positioning task on a simulated axis.

    Attributes
    ----------
    name
        What to call it; None for the file's name.
    axis, task, sensors, controller, guess
        Its tables.

    Raises
    ------
    InputError
        If the tables contradict each other, or the axis cannot do the task.
    """

    name: str | None = None
    axis: AxisTable
    task: TaskTable
    sensors: SensorsTable = field(default_factory=SensorsTable)
    controller: ControllerTable
    guess: GuessTable = field(default_factory=GuessTable)

    __pydantic_config__: ClassVar[Any] = {"extra": "forbid"}

    def __post_init__(self) -> None:
        self._check_method()
        self._check_effort()
        step, tolerance = self.sensors.encoder_step, self.task.tolerance
        position = unit_of("position", self.axis.kind)
        if tolerance < step:
            raise InputError(
                f"tolerance is {tolerance:g} {position}, below one step of the encoder, "
                f"{step:g} {position}, which shows no such error",
                where="[task]",
                remedy="widen the tolerance, or take a finer encoder",
            )
        longest = self.controller.longest_width
        if longest is not None and longest >= self.task.duration:
            raise InputError(
                f"longest_width is {longest:g} s, and a move ends after {self.task.duration:g} s",
                where="[controller]",
                remedy="allow shorter pulses only, or lengthen the duration",
            )

    def _check_method(self) -> None:
        """Refuse a controller of the other kind of axis, or one whose sensors are not there."""
        method, flexible = self.controller.method, self.axis.flexible
        if flexible and method not in OF_ARMS:
            raise InputError(
                f"method {method} moves a rigid axis, and this one is a flexible arm",
                where="[controller]",
                remedy=f"use method {' or '.join(OF_ARMS)}, or leave load and stiffness out of "
                "[axis]",
            )
        if flexible and self.axis.bristles:
            raise InputError(
                f"law {self.axis.law!r} is given for a flexible arm: on bristles its driven mass "
                "follows the swing of the load, and neither lands nor rests",
                where="[axis]",
                remedy="use law 'stribeck' or 'coulomb', or leave load and stiffness out",
            )
        if method == "feedback" and not flexible:
            load = "load_mass" if self.axis.kind == "linear" else "load_inertia"
            raise InputError(
                "method feedback is given, which moves a flexible arm, and this axis is rigid",
                where="[controller]",
                remedy="use another method, such as landing or pd, or give "
                f"{load} and stiffness in [axis]",
            )
        self.controller.check_axis(flexible=flexible)
        if method == "landing" and not flexible and self.sensors.velocity == "none":
            raise InputError(
                "velocity is none, and the feedback of method landing needs it",
                where="[sensors]",
                remedy="measure the velocity, or use method exact",
            )
        if flexible and self.sensors.velocity == "none":
            raise InputError(
                "velocity is none, and an arm is moved by the velocities of both its masses",
                where="[sensors]",
                remedy="measure the velocity",
            )

    def _check_effort(self) -> None:
        """Refuse a limit under which the axis cannot move both ways, or a rest that cannot be."""
        law, unit = self.axis.friction(), unit_of("effort", self.axis.kind)
        offset, limit = law.offset, self.controller.effort_limit
        forward, backward = law.breakaway()
        for way, static, needed in (
            ("positive", forward, forward + offset),
            ("negative", backward, backward - offset),
        ):
            if limit <= needed:
                lost = f" and offset {offset:g} {unit}" if offset else ""
                raise InputError(
                    f"effort_limit is {limit:g} {unit}, and the axis breaks away in the {way} "
                    f"direction above {needed:g} {unit} (static friction {static:g} {unit}{lost})",
                    where="[controller]",
                    remedy=f"allow more than {needed:g} {unit}",
                )
            if needed <= 0 and self.waits:
                raise InputError(
                    f"the offset is {offset:g} {unit}, more than the static friction {static:g} "
                    f"{unit} holds: without effort the axis slides away, and pulses need a rest",
                    where="[axis]",
                    remedy="balance the offset" + self._other_method(),
                )
        for way, coulomb, slowing in (
            ("positive", law.coulomb_friction_positive, law.coulomb_friction_positive + offset),
            ("negative", law.coulomb_friction_negative, law.coulomb_friction_negative - offset),
        ):
            if slowing <= 0 and self.waits:
                lost = f", and the offset {offset:g} {unit}" if offset else ""
                raise InputError(
                    f"the Coulomb friction is {coulomb:g} {unit} in the {way} direction{lost}: "
                    "once it moves that way the axis does not stop by itself, and pulses need a "
                    "rest",
                    where="[axis]",
                    remedy=("balance the offset" if offset else "give the friction that there is")
                    + self._other_method(),
                )

    def _other_method(self) -> str:
        return "" if self.axis.flexible else ", or use method pid"

    @property
    def pulsed(self) -> bool:
        """Whether the controller moves the axis by pulses."""
        return self.controller.method in {"exact", "papwc", "pwc"}

    @property
    def waits(self) -> bool:
        """Whether the controller waits for the axis to rest, and learns."""
        return self.pulsed or self.controller.method == "landing"

    @property
    def still(self) -> float:
        """How far an axis that rests may move [m or rad]: on bristles nothing rests quite."""
        return _STILL * self.task.tolerance if self.axis.bristles else 0.0

    def tables(self) -> ScenarioTables:
        """Return what the scenario says, with units; what is not said is left out."""
        return {
            name: _values(getattr(self, name), self.axis.kind)
            for name in _TABLES
            if _values(getattr(self, name), self.axis.kind)
        }


def _values(table: Any, kind: AxisKind) -> dict[str, tuple[Any, str]]:
    values: dict[str, tuple[Any, str]] = {}
    for each in sorted(fields(table), key=lambda each: each.name != "kind"):  # which rules units
        value = getattr(table, each.name)
        if value is None:
            continue
        quantity = each.metadata.get("quantity")
        if quantity is not None:
            unit = quantity.unit(kind)
        else:
            unit = _UNITS.get(each.name, ("", ""))[kind == "rotary"]
        values[each.name] = (list(value) if isinstance(value, tuple) else value, unit)
    return values


@dataclass(frozen=True, kw_only=True)
class ScenarioFile:
    """A scenario with where it was read.

    Attributes
    ----------
    scenario
        What the file says.
    path
        The file; other files that it names are beside it.
    sha256
        Of its bytes.
    """

    scenario: Scenario
    path: Path
    sha256: str

    @property
    def name(self) -> str:
        """What to call the task."""
        return self.scenario.name or self.path.stem.replace("_", " ").replace("-", " ")

    @property
    def learns(self) -> bool:
        """Whether the controller learns something that can be saved."""
        return self.scenario.waits

    @property
    def estimate(self) -> Path | None:
        """The file of an estimate that the first guess is taken from."""
        named = self.scenario.guess.estimate
        return None if named is None else self.path.parent / named

    @property
    def learnt(self) -> Path | None:
        """The file of what an earlier run has learnt."""
        named = self.scenario.guess.learnt
        return None if named is None else self.path.parent / named

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The files that the scenario names."""
        return tuple(each for each in (self.estimate, self.learnt) if each is not None)


def read_scenario(path: Path | str) -> ScenarioFile:
    """Read a scenario from a TOML file.

    Parameters
    ----------
    path
        The file.

    Raises
    ------
    InputError
        If it is missing, is not TOML, has an unknown key (near names are suggested) or a value
        that cannot be.
    """
    path = Path(path)
    scenario, sha256 = read_axis_file(
        path, Scenario, remedy="see examples/scenarios and the guide on positioning"
    )
    return ScenarioFile(scenario=scenario, path=path, sha256=sha256)
