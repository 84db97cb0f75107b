"""``stickslip demo``: the whole path on a simulated arm whose friction is known."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from stickslip.cli.arguments import folder, whole_number
from stickslip.cli.tables import print_identification
from stickslip.cli.terminal import console_on, reader_may_leave, working

__all__ = ["demo"]


def demo(
    *,
    out: Annotated[
        Path,
        Parameter(help="Folder for what is written; made if it is missing.", converter=folder),
    ],
    seed: Annotated[int, Parameter(help="Of the sensors' noise.", converter=whole_number)] = 1,
) -> int:
    """Simulate a flexible arm, identify its friction, and show the truth beside the estimate.

    Two masses and a spring, friction on the first, driven to and fro and left to rest, measured by
    noisy sensors: the arm of the report this package implements, with surrogate values where the
    report's table was lost. Writes the simulated log, the estimate and the report into the folder.
    """
    from stickslip.jobs import demonstrate

    with working("simulating and identifying the arm"):
        result = demonstrate(out, seed=seed)
    console = console_on("output")
    with reader_may_leave():
        console.print(result.setting)
        print_identification(console, result.identification)
        console.print(f"Log       {result.log_file}", soft_wrap=True)
        console.print(f"Estimate  {result.json_file}", soft_wrap=True)
        console.print(f"Report    {result.report_file}", soft_wrap=True)
    return 0 if result.identification.estimate.status.trusted else 1
