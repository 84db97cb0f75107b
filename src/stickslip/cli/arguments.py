"""Options that commands share, and conversions of their values."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Group, Parameter, Token

if TYPE_CHECKING:
    from stickslip import AxisSchema

_reading = partial(Parameter, group=Group("Reading the log", sort_key=1))
_column = partial(_reading, allow_leading_hyphen=True)
_known = partial(Parameter, group=Group("Known parameters", sort_key=2))
wanted = partial(Parameter, group=Group("What to estimate, and how", sort_key=3))


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class LogReading:
    """Options of reading a log."""

    schema: Annotated[
        Path | None,
        _reading(
            help="TOML file that states columns and units. [default: columns found by their names]"
        ),
    ] = None
    axis: Annotated[str | None, _reading(help="Axis of a log that has several.")] = None
    kind: Annotated[
        Literal["linear", "rotary"] | None,
        _reading(
            help="Linear (m, N, kg) or rotary (rad, N m, kg m²) axis. [default: by the units]"
        ),
    ] = None
    time: Annotated[
        str | None,
        _column(
            help='Column of the time stamps, or an expression such as "us / 1e6". [default: found '
            "by its name]"
        ),
    ] = None
    position: Annotated[
        str | None,
        _column(help="Column or expression of the position. [default: found by its name]"),
    ] = None
    velocity: Annotated[
        str | None,
        _column(help="Column or expression of a measured velocity. [default: found by its name]"),
    ] = None
    effort: Annotated[
        str | None,
        _column(
            help='Column or expression of the force or torque, such as "35.15 * vir". [default: '
            "found by its name]"
        ),
    ] = None
    load_position: Annotated[
        str | None,
        _column(help="Position of the second mass of a flexible arm. [default: found by its name]"),
    ] = None
    load_velocity: Annotated[
        str | None,
        _column(help="Velocity of the second mass of a flexible arm. [default: found by its name]"),
    ] = None
    sampling_time: Annotated[
        float | None, _reading(help="Sampling time in s, of a log without time stamps.")
    ] = None
    preset: Annotated[
        str | None,
        _reading(
            help="Schema that comes with stickslip, such as moteus, odrive, ur-rtde, twincat, "
            "plotjuggler, ros, lerobot, kollmorgen or siemens; none for none. [default: recognised "
            "by the columns]"
        ),
    ] = None
    torque_constant: Annotated[
        float | None,
        _reading(
            help="Torque per ampere in N m/A (force in N/A), for an effort that is a current."
        ),
    ] = None
    gear_ratio: Annotated[
        float | None,
        _column(
            help="Turns of the motor per turn of the joint, for an effort of the motor beside the "
            "position of the joint."
        ),
    ] = None
    effort_side: Annotated[
        Literal["motor", "joint"] | None,
        _reading(
            help="Side of the gear on which the effort acts. [default: motor with "
            "--torque-constant and --gear-ratio]"
        ),
    ] = None
    start_time: Annotated[
        float | None,
        _reading(
            name="--from",
            help="Time from which on the log is read, in s from its beginning. [default: 0]",
        ),
    ] = None
    end_time: Annotated[
        float | None,
        _reading(
            name="--to",
            help="Time up to which the log is read, in s from its beginning. [default: its end]",
        ),
    ] = None
    unit: Annotated[
        list[str] | None,
        _reading(
            negative="",
            help="Unit of a channel, as in --unit position=mm; may be repeated. [default: that of "
            "the header, or the SI unit]",
        ),
    ] = None

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


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class KnownAxis:
    """Known parameters of an axis."""

    inertia: Annotated[
        float | None,
        _known(
            name=("--inertia", "--mass"),
            help="Moving inertia in kg m² or mass in kg; of a flexible arm that of the driven "
            "side. [default: estimated]",
        ),
    ] = None
    load_inertia: Annotated[
        float | None,
        _known(
            name=("--load-inertia", "--load-mass"),
            help="Inertia in kg m² or mass in kg of a flexible arm's load side. [default: a rigid "
            "axis]",
        ),
    ] = None
    stiffness: Annotated[
        float | None,
        _known(help="Stiffness of a flexible arm's spring in N/m or N m/rad, with --load-inertia."),
    ] = None


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class KnownLoad:
    """Known weight on the axis."""

    known_load: Annotated[
        str | None,
        _known(
            help="Weight on a lever that turns about a horizontal axis, as MASS@RADIUS in kg and m "
            "(2.5@0.3): its gravity gives the torque constant of an effort in ampere. All else "
            "must be balanced."
        ),
    ] = None

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


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class RobotJoints:
    """Model of a robot whose joints the axes of a log are."""

    urdf: Annotated[
        Path | None,
        _known(
            help="URDF file of the robot whose joints the log holds: gravity, the other joints and "
            "the changes of inertia act as its links have them. Needs the extra robot."
        ),
    ] = None
    joint: Annotated[
        list[str] | None,
        _known(
            negative="",
            help="Joint of the URDF, or AXIS=JOINT for the joint that an axis of the "
            "log is; repeat the option for several. [default: all, by their names]",
        ),
    ] = None

    @property
    def inputs(self) -> list[Path]:
        """Return the files that are read; an error if joints are named without a model."""
        from stickslip.errors import InputError

        if self.joint and self.urdf is None:
            raise InputError("joint_without_urdf")
        return [] if self.urdf is None else [self.urdf]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class EstimatedFriction:
    """Friction parameters to estimate."""

    per_direction: Annotated[
        bool, wanted(negative="", help="Estimate the friction of each direction of motion.")
    ] = False
    offset: Annotated[
        bool | None,
        wanted(
            help="Whether to estimate a constant offset. [default: yes; no with --per-direction]"
        ),
    ] = None


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
