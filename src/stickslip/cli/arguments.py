"""Options that commands share, and conversions of their values."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Group, Parameter, Token

if TYPE_CHECKING:
    from cyclopts.help import HelpPanel
    from rich.console import Console, ConsoleOptions

    from stickslip import AxisSchema


def group(title: str, place: int) -> Group:
    """Return a group of options, whose help is in the docstrings of fields.

    The lines of a docstring are joined, as the terminal wraps them.
    """

    def printed(console: "Console", options: "ConsoleOptions", panel: "HelpPanel") -> None:
        from cyclopts.help import DefaultFormatter
        from rich.text import Text

        for entry in panel.entries:
            text = entry.description.primary_renderable
            if isinstance(text, Text):
                text.plain = " ".join(text.plain.split())
        DefaultFormatter()(console, options, panel)

    return Group(title, sort_key=place, help_formatter=printed)


_KNOWN = group("Known parameters", 2)
WANTED = group("What to estimate, and how", 3)
wanted = partial(Parameter, group=WANTED)

Column = Annotated[str | None, Parameter(allow_leading_hyphen=True)]
Flag = Annotated[bool, Parameter(negative="")]
Words = Annotated[list[str] | None, Parameter(negative="")]


@Parameter(name="*", group=group("Reading the log", 1))
@dataclass(frozen=True, kw_only=True)
class LogReading:
    """Options of reading a log."""

    schema: Path | None = None
    """TOML file that states columns and units. [default: columns found by their names]"""
    axis: str | None = None
    """Axis of a log that has several."""
    kind: Literal["linear", "rotary"] | None = None
    """Linear (m, N, kg) or rotary (rad, N m, kg m²) axis. [default: by the units]"""
    time: Column = None
    """Column of the time stamps, or an expression such as "us / 1e6". [default: found by its
    name]"""
    position: Column = None
    """Column or expression of the position. [default: found by its name]"""
    velocity: Column = None
    """Column or expression of a measured velocity. [default: found by its name]"""
    effort: Column = None
    """Column or expression of the force or torque, such as "35.15 * vir". [default: found by its
    name]"""
    load_position: Column = None
    """Position of the second mass of a flexible arm. [default: found by its name]"""
    load_velocity: Column = None
    """Velocity of the second mass of a flexible arm. [default: found by its name]"""
    sampling_time: float | None = None
    """Sampling time in s, of a log without time stamps."""
    preset: str | None = None
    """Schema that comes with stickslip, such as moteus, odrive, ur-rtde, twincat, plotjuggler, ros,
    lerobot, kollmorgen or siemens; none for none. [default: recognised by the columns]"""
    torque_constant: float | None = None
    """Torque per ampere in N m/A (force in N/A), for an effort that is a current."""
    gear_ratio: Annotated[float | None, Parameter(allow_leading_hyphen=True)] = None
    """Turns of the motor per turn of the joint, for an effort of the motor beside the position of
    the joint."""
    effort_side: Literal["motor", "joint"] | None = None
    """Side of the gear on which the effort acts. [default: motor with --torque-constant and
    --gear-ratio]"""
    start_time: Annotated[float | None, Parameter(name="--from")] = None
    """Time from which on the log is read, in s from its beginning. [default: 0]"""
    end_time: Annotated[float | None, Parameter(name="--to")] = None
    """Time up to which the log is read, in s from its beginning. [default: its end]"""
    unit: Words = None
    """Unit of a channel, as in --unit position=mm; may be repeated. [default: that of the header,
    or the SI unit]"""

    def inputs(self, log: Path) -> list[Path]:
        """Return the files that are read, which must not be overwritten.

        An absent log is an error here, before the readers load.
        """
        from stickslip.input_files import check_exists

        if ":" not in str(log):  # else it may be a URL
            check_exists(log, "file or folder")
        inside = list(log.iterdir()) if log.is_dir() else []
        return [log, *([] if self.schema is None else [self.schema]), *inside]

    def columns(self) -> "AxisSchema":
        """Return the schema that the options make."""
        from stickslip import AxisSchema

        others = [each.name for each in fields(self) if each.name not in ("schema", "axis", "unit")]
        return AxisSchema(**{name: getattr(self, name) for name in others}, units=self.units())

    def units(self) -> dict[str, str]:
        """Return units by channel from ``channel=unit`` words."""
        from stickslip.errors import InputError

        units: dict[str, str] = {}
        for word in self.unit or []:
            channel, sign, unit = word.partition("=")
            if not (channel and sign and unit):
                raise InputError("unit_not_understood", word=word)
            units[channel.strip().replace("-", "_")] = unit.strip()
        return units


@Parameter(name="*", group=_KNOWN)
@dataclass(frozen=True, kw_only=True)
class KnownAxis:
    """Known parameters of an axis."""

    inertia: Annotated[float | None, Parameter(name=("--inertia", "--mass"))] = None
    """Moving inertia in kg m² or mass in kg; of a flexible arm that of the driven side. [default:
    estimated]"""
    load_inertia: Annotated[float | None, Parameter(name=("--load-inertia", "--load-mass"))] = None
    """Inertia in kg m² or mass in kg of a flexible arm's load side. [default: a rigid axis]"""
    stiffness: float | None = None
    """Stiffness of a flexible arm's spring in N/m or N m/rad, with --load-inertia."""


@Parameter(name="*", group=_KNOWN)
@dataclass(frozen=True, kw_only=True)
class KnownLoad:
    """Known weight on the axis."""

    known_load: str | None = None
    """Weight on a lever that turns about a horizontal axis, as MASS@RADIUS in kg and m (2.5@0.3):
    its gravity gives the torque constant of an effort in ampere. All else must be balanced."""

    def load(self) -> tuple[float, float] | None:
        """Return mass [kg] and radius [m] of a known load."""
        from stickslip.errors import InputError

        if self.known_load is None:
            return None
        mass, _, radius = self.known_load.partition("@")
        try:
            return float(mass), float(radius)
        except ValueError:
            raise InputError("known_load_not_understood", word=self.known_load) from None


@Parameter(name="*", group=_KNOWN)
@dataclass(frozen=True, kw_only=True)
class RobotJoints:
    """Model of a robot whose joints the axes of a log are."""

    urdf: Path | None = None
    """URDF file of the robot whose joints the log holds: gravity, the other joints and the changes
    of inertia act as its links have them. Needs the extra robot."""
    joint: Words = None
    """Joint of the URDF, or AXIS=JOINT for the joint that an axis of the log is; repeat the option
    for several. [default: all, by their names]"""

    @property
    def inputs(self) -> list[Path]:
        """Return the files that are read; an error if joints are named without a model."""
        from stickslip.errors import InputError

        if self.joint and self.urdf is None:
            raise InputError("joint_without_urdf")
        return [] if self.urdf is None else [self.urdf]


@Parameter(name="*", group=WANTED)
@dataclass(frozen=True, kw_only=True)
class EstimatedFriction:
    """Friction parameters to estimate."""

    per_direction: Flag = False
    """Estimate the friction of each direction of motion."""
    offset: bool | None = None
    """Whether to estimate a constant offset. [default: yes; no with --per-direction]"""


def folder(_type: object, tokens: Sequence[Token]) -> Path:
    """Return a folder; an empty path, which would be the current folder, is an error."""
    if not tokens[0].value:
        raise ValueError("it is empty; name a folder, or give . for the current one")
    return Path(tokens[0].value)


def whole_number(_type: object, tokens: Sequence[Token]) -> int:
    """Return a whole number; the conversion of the command line would truncate 2.5 to 2."""
    try:
        return int(tokens[0].value)
    except ValueError:
        raise ValueError(f'"{tokens[0].value}" is not a whole number') from None
