"""``stickslip identify``: from a log to friction parameters that say what they are worth."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Group, Parameter

from stickslip.cli.log_arguments import KnownAxis, LogReading
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

_WANTED = Group("What to estimate, and how", sort_key=3)
_OUTPUT = Group("Output", sort_key=4)


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
    reading: LogReading | None = None,
    known: KnownAxis | None = None,
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
    stribeck: Annotated[
        bool,
        Parameter(
            group=_WANTED,
            negative="",
            help="Estimate static friction and Stribeck velocity too: how friction falls as motion "
            "sets in.",
        ),
    ] = False,
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

    reading, known = reading or LogReading(), known or KnownAxis()
    inputs = reading.inputs(log)
    json_file = None if json in {None, "-"} else Path(str(json))
    if json_file is not None and report is not None and json_file.resolve() == report.resolve():
        raise InputError(
            "--json and --report name the same file", where=str(report), remedy="name two files"
        )
    if json_file is not None:
        check_output(json_file, inputs=inputs, what="--json")
    if report is not None:
        check_output(report, inputs=inputs, what="--report")
    reading.units()  # refused before anything is loaded
    with working(f"identifying {log.name}"):
        from stickslip.jobs import identify, write_json, write_report

        found = identify(
            log,
            schema=reading.schema,
            axis=reading.axis,
            columns=reading.columns(),
            estimator=estimator,
            inertia=known.inertia,
            load_inertia=known.load_inertia,
            stiffness=known.stiffness,
            per_direction=per_direction,
            offset=offset,
            stribeck=stribeck,
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
