"""``stickslip compare``: every estimator side by side, on a log or over runs of a scenario."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from stickslip.cli.arguments import whole_number
from stickslip.cli.log_arguments import KnownAxis, LogReading
from stickslip.cli.terminal import console_on, progress_bar, reader_may_leave

if TYPE_CHECKING:
    from stickslip.records import EstimatorComparison, EstimatorStudy

__all__ = ["EXAMPLES", "compare"]

EXAMPLES = """Examples:
  stickslip compare stage.csv --report compare.html
  stickslip compare DATA_EMPS.mat --schema examples/emps.toml --json -
  stickslip compare stage.csv --mass 3.0 --only energy --only ekf
  stickslip compare examples/comparisons/velocity_noise.toml --runs 40"""

_WANTED = Group("What to estimate, and how", sort_key=3)
_OUTPUT = Group("Output", sort_key=4)


def compare(
    source: Annotated[
        Path,
        Parameter(
            help="A log (CSV, TSV, Parquet, MATLAB .mat, NPZ, or a folder with a schema), or a "
            "scenario (.toml) that is simulated; see examples/comparisons for some."
        ),
    ],
    /,
    *,
    reading: LogReading | None = None,
    known: KnownAxis | None = None,
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
    only: Annotated[
        list[str] | None,
        Parameter(
            group=_WANTED,
            negative="",
            help="Compare this estimator only; may be repeated. Not said: every one.",
        ),
    ] = None,
    largest_delay: Annotated[
        int,
        Parameter(
            group=_WANTED,
            converter=whole_number,
            help="Let maximum-likelihood find by how many samples the effort acts late, from 0 to "
            "so many.",
        ),
    ] = 0,
    runs: Annotated[
        int | None,
        Parameter(
            group=_WANTED,
            converter=whole_number,
            help="Of a scenario: how many runs; not said: as many as it says.",
        ),
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
    """Compare every estimator on a log, or over many runs of a simulated scenario.

    Of a log: what each finds with its 95 % interval, what it leaves of the effort, and its time a
    sample. Of a scenario, whose truth is known: bias, root mean square error, that over the
    Cramer-Rao bound, and how often the intervals hold the truth. An estimator that does not apply
    says why. One that estimates no mass gets that of the energy estimator unless --mass is given.
    Exit code 1: none of them can be trusted.
    """
    from stickslip.outputs import check_output
    from stickslip.records import InputError

    asked, reading, known = reading, reading or LogReading(), known or KnownAxis()
    scenario = source.suffix.lower() == ".toml"
    json_file = None if json in {None, "-"} else Path(str(json))
    if json_file is not None and report is not None and json_file.resolve() == report.resolve():
        raise InputError(
            "--json and --report name the same file", where=str(report), remedy="name two files"
        )
    if scenario and asked not in (None, LogReading()):
        raise InputError(
            "an option on how to read a log is given, and a scenario is simulated",
            where=str(source),
            remedy="leave it out",
        )
    if not scenario and runs is not None:
        raise InputError(
            f"--runs {runs} is given, and a log is compared once",
            where=str(source),
            remedy="leave it out, or give a scenario (.toml)",
        )
    for what, path in (("--json", json_file), ("--report", report)):
        if path is not None:
            check_output(path, inputs=reading.inputs(source), what=what)
    reading.units()  # refused before anything is loaded
    with progress_bar(f"comparing, {source.name}") as progress:
        from stickslip.jobs import (
            Wanted,
            compare_log,
            compare_scenario,
            write_comparison_page,
            write_json,
        )

        wanted = Wanted(
            inertia=known.inertia,
            load_inertia=known.load_inertia,
            stiffness=known.stiffness,
            per_direction=per_direction,
            offset=offset,
            largest_delay=largest_delay,
            only=tuple(only or ()),
        )
        found: EstimatorComparison | EstimatorStudy
        if scenario:
            found = compare_scenario(source, runs=runs, wanted=wanted, progress=progress)
        else:
            found = compare_log(
                source,
                schema=reading.schema,
                axis=reading.axis,
                columns=reading.columns(),
                wanted=wanted,
                progress=progress,
            )
        if report is not None:
            write_comparison_page(found, report)
        if json_file is not None:
            write_json(found.to_dict(), json_file)
    _print(found, to_stdout=json == "-", files=[("JSON", json_file), ("Report", report)])
    return 0 if found.trusted else 1


def _print(
    found: "EstimatorComparison | EstimatorStudy",
    *,
    to_stdout: bool,
    files: list[tuple[str, Path | None]],
) -> None:
    """Print the words, and the JSON alone on standard output if it was asked for there."""
    from stickslip.cli.compare_tables import print_comparison

    if to_stdout:
        from stickslip.jobs import json_text

        with reader_may_leave():
            sys.stdout.write(json_text(found.to_dict()))
    console = console_on("error" if to_stdout else "output")
    with reader_may_leave():
        print_comparison(console, found)
        for what, path in files:
            if path is not None:
                console.print(f"{what}: {path}", soft_wrap=True)
