"""``stickslip compare``: every estimator side by side, on a log or over runs of a scenario."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from stickslip.cli.arguments import EstimatedFriction, KnownAxis, LogReading, wanted, whole_number
from stickslip.cli.outputs import ResultFiles
from stickslip.cli.terminal import progress_bar

if TYPE_CHECKING:
    from stickslip.records import EstimatorComparison, EstimatorStudy

EXAMPLES = """Examples:
  stickslip compare stage.csv --report compare.html
  stickslip compare DATA_EMPS.mat --schema examples/emps.toml --json -
  stickslip compare stage.csv --mass 3.0 --only energy --only ekf
  stickslip compare examples/comparisons/velocity_noise.toml --runs 40"""


def compare(
    source: Annotated[
        Path,
        Parameter(
            help="A log, as stickslip identify takes it, or a scenario (.toml) that is simulated; "
            "see examples/comparisons for some."
        ),
    ],
    /,
    *,
    reading: LogReading | None = None,
    known: KnownAxis | None = None,
    friction: EstimatedFriction | None = None,
    only: Annotated[
        list[str] | None,
        wanted(negative="", help="Compare this estimator only; may be repeated. [default: all]"),
    ] = None,
    largest_delay: Annotated[
        int,
        wanted(
            converter=whole_number,
            help="Largest delay of the effort that maximum-likelihood looks for, in samples.",
        ),
    ] = 0,
    runs: Annotated[
        int | None,
        wanted(
            converter=whole_number,
            help="Number of runs of a scenario. [default: that of the scenario]",
        ),
    ] = None,
    files: ResultFiles | None = None,
) -> int:
    """Compare every estimator on a log, or over many runs of a simulated scenario.

    Of a log: the estimates with their 95 % intervals, the unexplained effort, and the time a
    sample. Of a scenario, whose true values are known: bias, root mean square error, its ratio to
    the Cramer-Rao bound, and the coverage of the intervals. The reason is printed where an
    estimator does not apply. An estimator that needs a mass gets that of the energy estimator if
    --mass is absent.
    Exit code 1: no result can be trusted.
    """
    from stickslip.errors import InputError
    from stickslip.input_files import check_exists

    given, reading, known = reading, reading or LogReading(), known or KnownAxis()
    friction, files = friction or EstimatedFriction(), files or ResultFiles()
    scenario = source.suffix.lower() == ".toml"
    if scenario and given not in (None, LogReading()):
        raise InputError("reading_of_scenario", where=str(source))
    if not scenario and runs is not None:
        raise InputError("runs_of_log", where=str(source), runs=runs)
    reading.units()  # options are refused before the files
    if scenario:
        check_exists(source, "scenario file")  # before what takes long to load
    files.check(inputs=[source] if scenario else reading.inputs(source))
    with progress_bar(f"comparing, {source.name}") as progress:
        from stickslip import EstimationTask
        from stickslip.tasks import compare_log, compare_scenario

        task = EstimationTask(**vars(known), **vars(friction), largest_delay=largest_delay)
        chosen = tuple(only or ())
        found: EstimatorComparison | EstimatorStudy
        if scenario:
            found = compare_scenario(source, runs=runs, task=task, only=chosen, progress=progress)
        else:
            found = compare_log(
                source,
                schema=reading.schema,
                axis=reading.axis,
                columns=reading.columns(),
                task=task,
                only=chosen,
                progress=progress,
            )
        files.write_all(found)
    from stickslip.presentation.terminal import print_comparison

    files.print(found, print_comparison)
    return 0 if found.trusted else 1
