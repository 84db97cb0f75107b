"""``stickslip position``: a positioning task on a simulated axis, from a scenario file."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from stickslip.cli.outputs import ResultFiles, check_apart, output
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
    files: ResultFiles | None = None,
    learned: Annotated[
        Path | None,
        output(
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
    from stickslip.input_files import check_exists
    from stickslip.outputs import check_output

    check_exists(scenario, "scenario file")  # before what takes long to load
    from stickslip.tasks import read_scenario

    files = files or ResultFiles()
    read = read_scenario(scenario)
    if learned is not None and not read.learns:
        raise InputError("learns_nothing", where=str(scenario))
    check_apart({**files.named(), "learned": learned})
    files.check(inputs=[scenario, *read.inputs])
    if learned is not None:  # may replace the values that the run resumes from
        inputs = [each for each in read.inputs if each != read.learned]
        check_output(learned, inputs=[scenario, *inputs], what="learned")
    with progress_bar(f"positioning, {scenario.name}") as progress:
        from stickslip.tasks import position, write_json

        result = position(read, progress=progress)
        saved = None if result.learned is None else learned
        if saved is not None and result.learned is not None:
            write_json(result.learned.to_dict(), saved)
        files.write_all(result)
    from stickslip.presentation.terminal import print_positioning

    files.print(result, print_positioning, learned=saved)
    return 0 if result.ending.reached else 1
