"""``stickslip identify``: from a log to friction parameters that say what they are worth."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Group, Parameter

from stickslip.cli.tables import print_identification
from stickslip.cli.terminal import console_on, reader_may_leave, working

if TYPE_CHECKING:
    from stickslip.records import Identification

__all__ = ["EXAMPLES", "identify"]

EXAMPLES = """Examples:
  stickslip identify stage.csv --report stage.html
  stickslip identify DATA_EMPS.mat --schema examples/emps.toml --json -
  stickslip identify staubli_tx40 --schema examples/tx40.toml --axis 1
  stickslip identify log.csv --position "motor / 32" --effort "0.35 * amps"
  stickslip identify arm.csv --mass 1.2 --load-mass 0.8 --stiffness 450"""

_READING = Group("Reading the log", sort_key=1)
_KNOWN = Group("What is known", sort_key=2)
_WANTED = Group("What to estimate, and how", sort_key=3)
_OUTPUT = Group("Output", sort_key=4)

_Column = Annotated[str | None, Parameter(group=_READING, allow_leading_hyphen=True)]


def identify(
    log: Annotated[
        Path,
        Parameter(
            help="The log: CSV, TSV, Parquet, MATLAB .mat or NPZ; or a folder, with a schema that "
            "names its files."
        ),
    ],
    /,
    *,
    schema: Annotated[
        Path | None,
        Parameter(group=_READING, help="TOML file that says which column is what, in which unit."),
    ] = None,
    axis: Annotated[
        str | None, Parameter(group=_READING, help="Which axis, if the schema has several.")
    ] = None,
    kind: Annotated[
        Literal["linear", "rotary"] | None,
        Parameter(group=_READING, help="Linear (m, N, kg) or rotary (rad, N m, kg m²) axis."),
    ] = None,
    time: Annotated[
        _Column, Parameter(help='Column of the time stamps, or an expression such as "us / 1e6".')
    ] = None,
    position: Annotated[_Column, Parameter(help="Column or expression of the position.")] = None,
    velocity: Annotated[
        _Column, Parameter(help="Column or expression of the velocity, if it was measured.")
    ] = None,
    effort: Annotated[
        _Column,
        Parameter(help='Column or expression of the force or torque, such as "35.15 * vir".'),
    ] = None,
    load_position: Annotated[
        _Column, Parameter(help="Position of the second mass of a flexible arm.")
    ] = None,
    load_velocity: Annotated[
        _Column, Parameter(help="Velocity of the second mass of a flexible arm.")
    ] = None,
    sampling_time: Annotated[
        float | None,
        Parameter(group=_READING, help="Sampling time in s, of a log without time stamps."),
    ] = None,
    unit: Annotated[
        list[str] | None,
        Parameter(
            group=_READING,
            negative="",
            help="Unit of a channel, as in --unit position=mm; may be repeated.",
        ),
    ] = None,
    inertia: Annotated[
        float | None,
        Parameter(
            name=("--inertia", "--mass"),
            group=_KNOWN,
            help="Moving inertia in kg m² or mass in kg, of a flexible arm that of the driven "
            "side; estimated if not given.",
        ),
    ] = None,
    load_inertia: Annotated[
        float | None,
        Parameter(
            name=("--load-inertia", "--load-mass"),
            group=_KNOWN,
            help="Inertia in kg m² or mass in kg of a flexible arm's load side; not given: a rigid "
            "axis.",
        ),
    ] = None,
    stiffness: Annotated[
        float | None,
        Parameter(
            group=_KNOWN,
            help="Stiffness of a flexible arm's spring in N/m or N m/rad, with --load-inertia.",
        ),
    ] = None,
    estimator: Annotated[
        Literal["energy", "idim-ls"],
        Parameter(
            group=_WANTED,
            help="energy: balance of energies; idim-ls: inverse dynamics by least squares.",
        ),
    ] = "energy",
    per_direction: Annotated[
        bool,
        Parameter(
            group=_WANTED, negative="", help="Estimate friction for each direction of motion apart."
        ),
    ] = False,
    offset: Annotated[
        bool | None,
        Parameter(
            group=_WANTED,
            help="Whether to estimate a constant force beside friction; not said: yes, unless "
            "--per-direction.",
        ),
    ] = None,
    cutoff: Annotated[
        float | None,
        Parameter(
            group=_WANTED,
            help="Cutoff of the low-pass that smooths noise, in Hz; not said: a tenth of the "
            "sampling rate, at most 100 Hz.",
        ),
    ] = None,
    variant: Annotated[
        Literal["held-effort", "report"],
        Parameter(
            group=_WANTED,
            help="Of energy. held-effort: exact while the effort is held over each sample; report: "
            "sums and recursion as the report prints them, for a known mass, without an offset.",
        ),
    ] = "held-effort",
    forgetting_factor: Annotated[
        float | None,
        Parameter(group=_WANTED, help="Of variant report, in (0, 1]; not said: 1, forget nothing."),
    ] = None,
    initial_variance: Annotated[
        float | None,
        Parameter(group=_WANTED, help="Of variant report, diagonal of P(0); not said: 1000."),
    ] = None,
    json: Annotated[
        str | None,
        Parameter(
            group=_OUTPUT,
            allow_leading_hyphen=True,
            help="Write the result as JSON to this file; - is standard output.",
        ),
    ] = None,
    report: Annotated[
        Path | None,
        Parameter(group=_OUTPUT, help="Write the report, one HTML page that works offline."),
    ] = None,
) -> int:
    """Identify the friction of an axis from its log.

    Prints each parameter with its 95 % interval and whether the log determines it at all. The
    interval allows for residuals that are correlated. Without a schema obvious columns are found,
    and what was assumed is printed.
    """
    from stickslip.outputs import check_output
    from stickslip.records import InputError

    inputs = [log, *([] if schema is None else [schema])]
    if log.is_dir():
        inputs += log.iterdir()
    json_file = None if json in {None, "-"} else Path(str(json))
    if json_file is not None and report is not None and json_file.resolve() == report.resolve():
        raise InputError(
            "--json and --report name the same file", where=str(report), remedy="name two files"
        )
    if json_file is not None:
        check_output(json_file, inputs=inputs, what="--json")
    if report is not None:
        check_output(report, inputs=inputs, what="--report")
    units = _units(unit or [])
    with working(f"identifying {log.name}"):
        from stickslip.jobs import AxisSchema, identify, write_json, write_report

        found = identify(
            log,
            schema=schema,
            axis=axis,
            columns=AxisSchema(
                kind=kind,
                time=time,
                position=position,
                velocity=velocity,
                effort=effort,
                load_position=load_position,
                load_velocity=load_velocity,
                sampling_time=sampling_time,
                units=units,
            ),
            estimator=estimator,
            inertia=inertia,
            load_inertia=load_inertia,
            stiffness=stiffness,
            per_direction=per_direction,
            offset=offset,
            cutoff=cutoff,
            variant="report" if variant == "report" else "held_effort",
            forgetting_factor=forgetting_factor,
            initial_variance=initial_variance,
        )
        if report is not None:
            write_report(found, report)
        if json_file is not None:
            write_json(found.estimate.to_dict(), json_file)
    _print(found, to_stdout=json == "-", files=[("JSON", json_file), ("Report", report)])
    return 0 if found.estimate.status.trusted else 1


def _units(stated: list[str]) -> dict[str, str]:
    """Return units by channel from ``channel=unit`` words."""
    from stickslip.records import InputError

    units: dict[str, str] = {}
    for word in stated:
        channel, sign, unit = word.partition("=")
        if not (channel and sign and unit):
            raise InputError(
                f"--unit {word} is not understood",
                remedy="write channel=unit, as in --unit position=mm",
            )
        units[channel.strip().replace("-", "_")] = unit.strip()
    return units


def _print(
    found: "Identification", *, to_stdout: bool, files: list[tuple[str, Path | None]]
) -> None:
    """Print the words, and the JSON alone on standard output if it was asked for there."""
    if to_stdout:
        from stickslip.jobs import json_text

        with reader_may_leave():
            sys.stdout.write(json_text(found.estimate.to_dict()))
    console = console_on("error" if to_stdout else "output")
    with reader_may_leave():
        print_identification(console, found)
        for what, path in files:
            if path is not None:
                console.print(f"{what}: {path}", soft_wrap=True)
