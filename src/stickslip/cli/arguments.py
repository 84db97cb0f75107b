"""Options that commands share, and conversions of their values."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Group, Parameter, Token

if TYPE_CHECKING:
    from stickslip import AxisSchema

__all__ = ["WANTED", "KnownAxis", "LogReading", "SoughtFriction", "folder", "whole_number"]

_READING = Group("Reading the log", sort_key=1)
_KNOWN = Group("Known parameters", sort_key=2)
WANTED = Group("What to estimate, and how", sort_key=3)

_Column = Annotated[str | None, Parameter(group=_READING, allow_leading_hyphen=True)]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class LogReading:
    """How a log is read."""

    schema: Annotated[
        Path | None,
        Parameter(group=_READING, help="TOML file that says which column is what, in which unit."),
    ] = None
    axis: Annotated[
        str | None, Parameter(group=_READING, help="Which axis, if the schema has several.")
    ] = None
    kind: Annotated[
        Literal["linear", "rotary"] | None,
        Parameter(group=_READING, help="Linear (m, N, kg) or rotary (rad, N m, kg m²) axis."),
    ] = None
    time: Annotated[
        _Column, Parameter(help='Column of the time stamps, or an expression such as "us / 1e6".')
    ] = None
    position: Annotated[_Column, Parameter(help="Column or expression of the position.")] = None
    velocity: Annotated[
        _Column, Parameter(help="Column or expression of the velocity, if it was measured.")
    ] = None
    effort: Annotated[
        _Column,
        Parameter(help='Column or expression of the force or torque, such as "35.15 * vir".'),
    ] = None
    load_position: Annotated[
        _Column, Parameter(help="Position of the second mass of a flexible arm.")
    ] = None
    load_velocity: Annotated[
        _Column, Parameter(help="Velocity of the second mass of a flexible arm.")
    ] = None
    sampling_time: Annotated[
        float | None,
        Parameter(group=_READING, help="Sampling time in s, of a log without time stamps."),
    ] = None
    unit: Annotated[
        list[str] | None,
        Parameter(
            group=_READING,
            negative="",
            help="Unit of a channel, as in --unit position=mm; may be repeated.",
        ),
    ] = None

    def inputs(self, log: Path) -> list[Path]:
        """Return the files that must not be overwritten, as they are read."""
        inside = list(log.iterdir()) if log.is_dir() else []
        return [log, *([] if self.schema is None else [self.schema]), *inside]

    def columns(self) -> "AxisSchema":
        """Return what single columns are."""
        from stickslip import AxisSchema

        return AxisSchema(
            kind=self.kind,
            time=self.time,
            position=self.position,
            velocity=self.velocity,
            effort=self.effort,
            load_position=self.load_position,
            load_velocity=self.load_velocity,
            sampling_time=self.sampling_time,
            units=self.units(),
        )

    def units(self) -> dict[str, str]:
        """Return units by channel from ``channel=unit`` words.

        Raises
        ------
        InputError
            If a word is not one.
        """
        from stickslip.records import InputError

        units: dict[str, str] = {}
        for word in self.unit or []:
            channel, sign, unit = word.partition("=")
            if not (channel and sign and unit):
                raise InputError(
                    f"--unit {word} is not understood",
                    remedy="write channel=unit, as in --unit position=mm",
                )
            units[channel.strip().replace("-", "_")] = unit.strip()
        return units


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class KnownAxis:
    """Known parameters of an axis."""

    inertia: Annotated[
        float | None,
        Parameter(
            name=("--inertia", "--mass"),
            group=_KNOWN,
            help="Moving inertia in kg m² or mass in kg; of a flexible arm that of the driven "
            "side. [default: estimated]",
        ),
    ] = None
    load_inertia: Annotated[
        float | None,
        Parameter(
            name=("--load-inertia", "--load-mass"),
            group=_KNOWN,
            help="Inertia in kg m² or mass in kg of a flexible arm's load side. [default: a rigid "
            "axis]",
        ),
    ] = None
    stiffness: Annotated[
        float | None,
        Parameter(
            group=_KNOWN,
            help="Stiffness of a flexible arm's spring in N/m or N m/rad, with --load-inertia.",
        ),
    ] = None


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class SoughtFriction:
    """Which friction is estimated."""

    per_direction: Annotated[
        bool,
        Parameter(
            group=WANTED, negative="", help="Estimate the friction of each direction of motion."
        ),
    ] = False
    offset: Annotated[
        bool | None,
        Parameter(
            group=WANTED,
            help="Whether to estimate a constant offset. [default: yes; no with --per-direction]",
        ),
    ] = None


def folder(_type: object, tokens: Sequence[Token]) -> Path:
    """Return a folder; an empty path would be the current one, which nobody named."""
    if not tokens[0].value:
        raise ValueError("it is empty; name a folder, or give . for the current one")
    return Path(tokens[0].value)


def whole_number(_type: object, tokens: Sequence[Token]) -> int:
    """Return a whole number; the command line's own conversion would cut 2.5 down to 2."""
    try:
        return int(tokens[0].value)
    except ValueError:
        raise ValueError(f'"{tokens[0].value}" is not a whole number') from None
