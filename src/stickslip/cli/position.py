"""``stickslip position``: a positioning task on a simulated axis, from a scenario file."""

import textwrap
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from stickslip.cli.outputs import check_apart, json_file, print_result
from stickslip.cli.terminal import progress_bar

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from stickslip.records import Positioning, PositioningMove, PositioningRun

__all__ = ["EXAMPLES", "position"]

EXAMPLES = """Examples:
  stickslip position examples/scenarios/exact.toml --report exact.html
  stickslip position examples/scenarios/arm.toml --report arm.html
  stickslip position stage.toml --learnt learnt.json --json -"""

_FIRST, _LAST = 20, 10
"""Rows of a long table that are printed."""


def position(
    scenario: Annotated[
        Path, Parameter(help="The scenario, a TOML file; see examples/scenarios for some.")
    ],
    /,
    *,
    json: Annotated[
        str | None,
        Parameter(
            allow_leading_hyphen=True,
            help="Write everything as JSON to this file; - is standard output.",
        ),
    ] = None,
    report: Annotated[
        Path | None, Parameter(help="Write the report, one HTML page that works offline.")
    ] = None,
    learnt: Annotated[
        Path | None,
        Parameter(
            help="Save what the controller has learnt, for learnt = FILE in the [guess] of a "
            "scenario."
        ),
    ] = None,
) -> int:
    """Position a simulated axis or flexible arm with friction, as a scenario file tells.

    The scenario says which axis is simulated, where it is to go, what its sensors show, and which
    controller moves it with which first guess. Prints how each move ended. Exit code 0: every move
    of the last run ended within the tolerance; 1: one did not, and its ending says why.
    """
    from stickslip.jobs import read_scenario
    from stickslip.outputs import check_output
    from stickslip.records import InputError

    files = {"--json": json_file(json), "--report": report, "--learnt": learnt}
    read = read_scenario(scenario)
    if learnt is not None and not read.learns:
        raise InputError(
            "--learnt is given, and the method of the scenario learns nothing",
            where=str(scenario),
            remedy="leave it out, or use a method that learns, such as exact",
        )
    check_apart(files)
    for option, path in files.items():
        if path is None:
            continue
        # What was learnt may take the place of what it began with
        goes_on = option == "--learnt"
        inputs = [each for each in read.inputs if not (goes_on and each == read.learnt)]
        check_output(path, inputs=[scenario, *inputs], what=option)
    with progress_bar(f"positioning, {scenario.name}") as progress:
        from stickslip import write_positioning_page
        from stickslip.jobs import position, write_json

        result = position(read, progress=progress)
        saved = None if result.learnt is None else learnt
        if saved is not None and result.learnt is not None:
            write_json(result.learnt.to_dict(), saved)
        if (path := json_file(json)) is not None:
            write_json(result.to_dict(), path)
        if report is not None:
            write_positioning_page(result, report)
    written = {"JSON": json_file(json), "Report": report, "Learnt": saved}
    print_result(result.to_dict, partial(_print, result=result), json=json, files=written)
    return 0 if result.ending.reached else 1


def _print(console: "Console", result: "Positioning") -> None:
    from stickslip.records import prefixed, unit_of

    unit = unit_of("position", result.kind)
    run = result.runs[-1]
    arm = run.arm
    axis = f"{result.kind} axis" if arm is None else f"flexible arm, {result.kind}"
    console.print(f"{result.name}: {result.controller}, {axis}", soft_wrap=True)
    console.print()
    console.print(_moves(result))
    if run.phases:
        from stickslip.cli.arm_tables import phases_table, series_table

        console.print(phases_table(run))
        if arm is not None and arm.series:
            console.print(series_table(arm, result))
    if result.runs[0].estimates:
        console.print(_estimates(result))
        if result.counts_offset:
            words = "Friction of each direction has the constant offset in it, also the truth's."
            console.print(textwrap.fill(words, console.width), style="dim", soft_wrap=True)
            console.print()
    last = result.last
    words = f"{result.ending.value}: {result.ending_text}"
    if result.ending.reached:
        words = (
            f"reached: {prefixed(last.final_error, unit)} from the target, tolerance "
            f"{prefixed(result.tolerance, unit)}."
        )
    mark = "✓" if result.ending.reached else "✗"
    style = "green" if result.ending.reached else "bold red"
    console.print(textwrap.fill(f"{mark} {words}", console.width), style=style, soft_wrap=True)
    for note in result.notes:
        console.print(textwrap.fill(note, console.width), style="dim", soft_wrap=True)


def _moves(result: "Positioning") -> "Table":
    from rich import box
    from rich.table import Table

    several = len(result.runs[0].moves) > 1
    arm = result.runs[0].arm is not None
    pulsed = bool(result.runs[0].estimates) and not arm
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("run", justify="right")
    if several:
        table.add_column("move", justify="right")
    swing = ("swing left",) if arm else ()
    for head in ("target", "final error", *swing, "within tolerance after"):
        table.add_column(head, justify="right", no_wrap=True)
    if pulsed:
        table.add_column("pulses", justify="right")
    table.add_column("peak effort", justify="right", no_wrap=True)
    table.add_column("ending", no_wrap=True)
    every = [(run, move) for run in result.runs for move in run.moves]
    for k, (run, move) in enumerate(every):
        if _FIRST <= k < len(every) - _LAST:
            if k == _FIRST:
                table.add_row("…")
            continue
        table.add_row(*_row(run, move, result, several=several, pulsed=pulsed))
    return table


def _row(
    run: "PositioningRun",
    move: "PositioningMove",
    result: "Positioning",
    *,
    several: bool,
    pulsed: bool,
) -> list[str]:
    from stickslip.records import prefixed, unit_of

    unit, settled = unit_of("position", result.kind), move.settling_time
    return [
        str(run.number),
        *([str(move.number)] if several else []),
        prefixed(move.target, unit),
        prefixed(move.final_error, unit),
        *([] if move.swing is None else [prefixed(move.swing, unit)]),
        "never" if settled is None else prefixed(settled, "s"),
        *([str(len(move.pulses))] if pulsed else []),
        prefixed(move.peak_effort, unit_of("effort", result.kind)),
        move.ending.word.lower(),
    ]


def _estimates(result: "Positioning") -> "Table":
    from rich import box
    from rich.table import Table

    from stickslip.records import between_text, parameter_label, unit_of, unit_text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("learnt", no_wrap=True)
    for head in ("at first", "in the end", "truth"):
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    last = result.runs[-1].estimates
    for name, values in result.runs[0].estimates.items():
        truth, limits = result.truth.get(name), result.limits.get(name)
        table.add_row(
            parameter_label(name, result.kind),
            f"{values[0]:.4g}",
            f"{last[name][-1]:.4g}" if limits is None else between_text(*limits),
            "-" if truth is None else f"{truth:.4g}",
            unit_text(unit_of(name, result.kind)),
        )
    return table
