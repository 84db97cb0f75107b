"""``stickslip position``: a positioning task on a simulated axis, from a scenario file."""

from functools import partial
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from stickslip.cli.outputs import check_apart, json_file, print_result
from stickslip.cli.terminal import progress_bar

EXAMPLES = """Examples:
  stickslip position examples/scenarios/exact.toml --report exact.html
  stickslip position examples/scenarios/arm.toml --report arm.html
  stickslip position stage.toml --learned learned.json --json -"""


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
    learned: Annotated[
        Path | None,
        Parameter(
            help="Save what the controller has learned, for learned = FILE in the [guess] of a "
            "scenario.",
        ),
    ] = None,
) -> int:
    """Position a simulated axis or flexible arm with friction, as a scenario file states.

    The scenario states the axis, its targets, its sensors, and the controller with its first guess.
    Prints how each move ended. Exit code 0: every move of the last run ended within the tolerance;
    1: one did not, for the reason printed.
    """
    from stickslip.errors import InputError
    from stickslip.outputs import check_output
    from stickslip.tasks import read_scenario

    files = {"json": json_file(json), "report": report, "learned": learned}
    read = read_scenario(scenario)
    if learned is not None and not read.learns:
        raise InputError("learns_nothing", where=str(scenario))
    check_apart(files)
    for option, path in files.items():
        if path is None:
            continue
        # The learned values may replace those that the run resumes from
        resumes = option == "learned"
        inputs = [each for each in read.inputs if not (resumes and each == read.learned)]
        check_output(path, inputs=[scenario, *inputs], what=option)
    with progress_bar(f"positioning, {scenario.name}") as progress:
        from stickslip import write_report
        from stickslip.tasks import position, write_json

        result = position(read, progress=progress)
        saved = None if result.learned is None else learned
        if saved is not None and result.learned is not None:
            write_json(result.learned.to_dict(), saved)
        if (path := json_file(json)) is not None:
            write_json(result.to_dict(), path)
        if report is not None:
            write_report(result, report)
    from stickslip.presentation.terminal import print_positioning

    written = {"JSON": json_file(json), "Report": report, "Learned": saved}
    print_result(
        result.to_dict, partial(print_positioning, result=result), json=json, files=written
    )
    return 0 if result.ending.reached else 1
