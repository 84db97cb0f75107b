"""``stickslip export``: identified friction as a file for a simulator, a drive, or a compiler."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Group, Parameter

from stickslip.cli.arguments import whole_number
from stickslip.cli.terminal import console_on, reader_may_leave, say

EXAMPLES = """Examples:
  stickslip export urdf elbow.json --into robot.urdf --joint elbow --out robot-friction.urdf
  stickslip export --list"""

_what = partial(Parameter, group=Group("What to export", sort_key=1))
_side = partial(Parameter, group=Group("Side and units of the estimate", sort_key=2))
_target = partial(Parameter, group=Group("Options of targets", sort_key=3))


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class TargetOptions:
    """Settings that some targets use."""

    points: Annotated[
        int | None, _target(converter=whole_number, help="Number of points of a table.")
    ] = None
    top_speed: Annotated[
        float | None, _target(help="Largest speed of a table, in rad/s or m/s of its side.")
    ] = None
    rated_current: Annotated[float | None, _target(help="Of the motor, in A.")] = None
    link_inertia: Annotated[
        float | None,
        _target(
            help="Part of the identified inertia that the model already has, in kg m² or kg; the "
            "rest is written as armature. [default: no armature]"
        ),
    ] = None
    sampling_time: Annotated[float | None, _target(help="Of the model or code, in s.")] = None
    precision: Annotated[
        Literal["single", "double"] | None, _target(help="Arithmetic of generated code.")
    ] = None
    fmi_version: Annotated[
        Literal["2.0", "3.0"] | None, _target(help="Version of a functional mock-up unit.")
    ] = None
    binaries: Annotated[
        Literal["all", "host", "none"] | None,
        _target(help="Platforms that a functional mock-up unit has binaries for."),
    ] = None
    load_inertia: Annotated[
        float | None,
        _target(help="Part of the identified inertia that moves behind a spring, in kg m² or kg."),
    ] = None
    stiffness: Annotated[
        float | None, _target(help="Stiffness of that spring, in N m/rad or N/m.")
    ] = None


def export(
    target: Annotated[
        str | None, _what(help="Name of the target; see --list.", show_default=False)
    ] = None,
    estimate: Annotated[
        Path | None,
        _what(
            help="File that stickslip identify --json wrote, of one axis or of a robot.",
            show_default=False,
        ),
    ] = None,
    /,
    *,
    out: Annotated[
        Path | None,
        _what(help="File to write, or folder of a target of several files; may be that of --into."),
    ] = None,
    into: Annotated[Path | None, _what(help="File to edit, such as a robot description.")] = None,
    joint: Annotated[
        str | None, _what(help="Joint of the file that the axis is. [default: name of the axis]")
    ] = None,
    axis: Annotated[
        str | None, _what(help="Axis of an estimate of a robot. [default: all]")
    ] = None,
    overwrite: Annotated[
        bool, _what(negative="", help="Replace values that the edited file already has.")
    ] = False,
    force: Annotated[
        bool,
        _what(
            negative="",
            help="Also write values that were not identified or are not to be used, with a warning "
            "in the file.",
        ),
    ] = False,
    targets: Annotated[
        bool, _what(name="--list", negative="", help="List the targets and end.")
    ] = False,
    side: Annotated[
        Literal["motor", "joint"], _side(help="Side of the gear that the log was of.")
    ] = "joint",
    gear_ratio: Annotated[
        float | None, _side(help="Turns of the motor per turn of the joint.")
    ] = None,
    lead: Annotated[
        float | None, _side(help="Travel of a linear joint per turn of its rotary motor, in m.")
    ] = None,
    torque_constant: Annotated[
        float | None,
        _side(
            help="Torque or force per current, in N m/A or N/A (or per %, for an effort in "
            "percent)."
        ),
    ] = None,
    options: TargetOptions | None = None,
) -> int:
    """Export the friction of an estimate to a simulator, a drive, or a compiler.

    Only identified parameters are written. A file to edit is edited as text: comments, order and
    all other bytes remain. What the target cannot represent is stated in the file and printed.

    Exit code 0: everything that the target holds was written; 1: the estimate is not to be trusted,
    or a parameter was withheld or written by force; the reason is printed.
    """
    from stickslip.errors import InputError
    from stickslip.export import targets as all_targets

    if targets:
        console = console_on("output")
        with reader_may_leave():
            for name, title in all_targets().items():
                console.print(f"{name:20} {title}", soft_wrap=True)
        return 0
    if target is None or estimate is None or out is None:
        given = {"a target": target, "an estimate": estimate, "--out": out}
        raise InputError(
            "export_arguments", what=next(name for name, value in given.items() if value is None)
        )
    from stickslip.export import EstimateReading, ExportSettings, Transmission, write

    result = write(
        estimate,
        target,
        out,
        into=into,
        joint=joint,
        reading=EstimateReading(
            axis=axis,
            transmission=Transmission(side=side, gear_ratio=gear_ratio, lead=lead),
            torque_constant=torque_constant,
            force=force,
        ),
        settings=ExportSettings(
            overwrite=overwrite,
            torque_constant=torque_constant,
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
