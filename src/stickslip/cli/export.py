"""``stickslip export``: identified friction as a file for a simulator, a drive, or a compiler."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from stickslip.cli.arguments import Flag, group, whole_number
from stickslip.cli.terminal import console_on, reader_may_leave, say, working

EXAMPLES = """Examples:
  stickslip export urdf elbow.json --into robot.urdf --joint elbow --out robot-friction.urdf
  stickslip export --list"""

_WHAT = group("What to export", 1)


@Parameter(name="*", group=_WHAT)
@dataclass(frozen=True, kw_only=True)
class Written:
    """Files of an export, and the joint that it is of."""

    out: Path | None = None
    """File to write, or folder of a target of several files; may be that of --into."""
    into: Path | None = None
    """File to edit, such as a robot description."""
    joint: str | None = None
    """Joint of the file that the axis is. [default: name of the axis]"""
    axis: str | None = None
    """Axis of an estimate of a robot. [default: all]"""
    overwrite: Flag = False
    """Replace values that the edited file already has."""
    force: Flag = False
    """Also write values that were not identified or are not to be used, with a warning in the
    file."""
    targets: Annotated[bool, Parameter(name="--list", negative="")] = False
    """List the targets and end."""


@Parameter(name="*", group=group("Side and units of the estimate", 2))
@dataclass(frozen=True, kw_only=True)
class EstimateSide:
    """How the values of an estimate are meant."""

    side: Literal["motor", "joint"] = "joint"
    """Side of the gear that the log was of."""
    gear_ratio: float | None = None
    """Turns of the motor per turn of the joint."""
    lead: float | None = None
    """Travel of a linear joint per turn of its rotary motor, in m."""
    torque_constant: float | None = None
    """Torque or force per current, in N m/A or N/A (or per %, for an effort in percent)."""


@Parameter(name="*", group=group("Options of targets", 3))
@dataclass(frozen=True, kw_only=True)
class TargetOptions:
    """Settings that some targets use."""

    points: Annotated[int | None, Parameter(converter=whole_number)] = None
    """Number of points of a table."""
    top_speed: float | None = None
    """Largest speed of a table, in rad/s or m/s of its side."""
    rated_current: float | None = None
    """Of the motor, in A."""
    link_inertia: float | None = None
    """Part of the identified inertia that the model already has, in kg m² or kg; the rest is
    written as armature. [default: no armature]"""
    sampling_time: float | None = None
    """Of the model or code, in s."""
    precision: Literal["single", "double"] | None = None
    """Arithmetic of generated code."""
    fmi_version: Literal["2.0", "3.0"] | None = None
    """Version of a functional mock-up unit."""
    binaries: Literal["all", "host", "none"] | None = None
    """Platforms that a functional mock-up unit has binaries for."""
    load_inertia: float | None = None
    """Part of the identified inertia that moves behind a spring, in kg m² or kg."""
    stiffness: float | None = None
    """Stiffness of that spring, in N m/rad or N/m."""


def export(
    target: Annotated[
        str | None,
        Parameter(group=_WHAT, help="Name of the target; see --list.", show_default=False),
    ] = None,
    estimate: Annotated[
        Path | None,
        Parameter(
            group=_WHAT,
            help="File that stickslip identify --json wrote, of one axis or of a robot.",
            show_default=False,
        ),
    ] = None,
    /,
    *,
    written: Written | None = None,
    values: EstimateSide | None = None,
    options: TargetOptions | None = None,
) -> int:
    """Export the friction of an estimate to a simulator, a drive, or a compiler.

    Only identified parameters are written. A file to edit is edited as text: comments, order and
    all other bytes remain. What the target cannot represent is stated in the file and printed.

    Exit code 0: everything that the target holds was written; 1: the estimate is not to be trusted,
    or a parameter was withheld or written by force; the reason is printed.
    """
    from stickslip.errors import InputError
    from stickslip.export import targets

    written, values = written or Written(), values or EstimateSide()
    if written.targets:
        console = console_on("output")
        with reader_may_leave():
            for name, title in targets().items():
                console.print(f"{name:20} {title}", soft_wrap=True)
        return 0
    out = written.out
    if target is None or estimate is None or out is None:
        given = {"a target": target, "an estimate": estimate, "--out": out}
        raise InputError(
            "export_arguments", what=next(name for name, value in given.items() if value is None)
        )
    from stickslip.export import EstimateReading, ExportSettings, Transmission, write

    with working(f"exporting {out.name}"):
        result = write(
            estimate,
            target,
            out,
            into=written.into,
            joint=written.joint,
            reading=EstimateReading(
                axis=written.axis,
                transmission=Transmission(
                    side=values.side, gear_ratio=values.gear_ratio, lead=values.lead
                ),
                torque_constant=values.torque_constant,
                force=written.force,
            ),
            settings=ExportSettings(
                overwrite=written.overwrite,
                torque_constant=values.torque_constant,
                **vars(options or TargetOptions()),
            ),
        )
    for sentence in result.warnings:
        say(sentence)
    console = console_on("output")
    with reader_may_leave():
        for sentence in result.rendered.notes:
            console.print(sentence, soft_wrap=True)
        console.print(f"Written: {out}", soft_wrap=True)
    return 0 if result.complete else 1
