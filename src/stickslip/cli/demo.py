"""``stickslip demo``, a demonstration on a simulated arm, and ``stickslip data``, public logs."""

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from stickslip.cli.arguments import folder, whole_number
from stickslip.cli.terminal import console_on, reader_may_leave, working


def demo(
    *,
    out: Annotated[
        Path,
        Parameter(help="Folder for what is written; made if it is missing.", converter=folder),
    ] = Path("demo-output"),
    seed: Annotated[int, Parameter(help="Of the sensors' noise.", converter=whole_number)] = 1,
) -> int:
    """Simulate a flexible arm, identify its friction beside the truth, and land it on a target.

    Two masses and a spring, friction on the first, driven to and fro and left to rest, measured by
    noisy sensors: the arm of van de Wijdeven (2002), with surrogate values, as the source's table
    of parameters is lost. What was identified is then the first guess of a controller that lands
    both masses at rest on a target, under the same noise. Writes the simulated log, the estimate,
    the scenario of the landing, and a page on each into the folder.
    """
    from stickslip.presentation.terminal import print_identification, print_landing
    from stickslip.tasks import demonstrate

    with working("identifying and landing the arm"):
        result = demonstrate(out, seed=seed)
    console = console_on("output")
    with reader_may_leave():
        console.print(result.setting)
        print_identification(console, result.identification)
        console.print(f"Log       {result.log_file}", soft_wrap=True)
        console.print(f"Estimate  {result.json_file}", soft_wrap=True)
        console.print(f"Report    {result.report_file}\n", soft_wrap=True)
        print_landing(console, result.landing)
        console.print(f"Scenario  {result.scenario_file}", soft_wrap=True)
        console.print(f"Landing   {result.landing_file}", soft_wrap=True)
    trusted = result.identification.estimate.status.trusted
    return 0 if trusted and result.landing.ending.reached else 1


def data(name: Annotated[str, Parameter(help='The data set: "emps".')], /) -> int:
    """Find a public benchmark on this machine, or fetch it, and print its folder.

    Looked for in the folder that the environment variable STICKSLIP_DATA names, then in the user's
    cache; fetched to the cache otherwise, and checked.
    """
    from stickslip import find_benchmark

    with working(f"looking for {name}"):
        folder = find_benchmark(name)
    with reader_may_leave():
        sys.stdout.write(f"{folder}\n")
    return 0
