"""``stickslip demo``: from a log to a landing, on a simulated arm whose friction is known."""

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from stickslip.cli.arguments import folder, whole_number
from stickslip.cli.tables import print_identification
from stickslip.cli.terminal import console_on, reader_may_leave, working

if TYPE_CHECKING:
    from rich.console import Console

    from stickslip.records import Positioning

__all__ = ["demo"]


def demo(
    *,
    out: Annotated[
        Path,
        Parameter(help="Folder for what is written; made if it is missing.", converter=folder),
    ],
    seed: Annotated[int, Parameter(help="Of the sensors' noise.", converter=whole_number)] = 1,
) -> int:
    """Simulate a flexible arm, identify its friction beside the truth, and land it on a target.

    Two masses and a spring, friction on the first, driven to and fro and left to rest, measured by
    noisy sensors: the arm of van de Wijdeven (2002), with surrogate values, as the source's table
    of parameters is lost. What was identified is then the first guess of a controller that lands
    both masses at rest on a target, under the same noise. Writes the simulated log, the estimate,
    the scenario of the landing, and a page on each into the folder.
    """
    from stickslip.jobs import demonstrate

    with working("identifying and landing the arm"):
        result = demonstrate(out, seed=seed)
    console = console_on("output")
    with reader_may_leave():
        console.print(result.setting)
        print_identification(console, result.identification)
        console.print(f"Log       {result.log_file}", soft_wrap=True)
        console.print(f"Estimate  {result.json_file}", soft_wrap=True)
        console.print(f"Report    {result.report_file}", soft_wrap=True)
        console.print()
        _print_landing(console, result.landing)
        console.print(f"Scenario  {result.scenario_file}", soft_wrap=True)
        console.print(f"Landing   {result.landing_file}", soft_wrap=True)
    trusted = result.identification.estimate.status.trusted
    return 0 if trusted and result.landing.ending.reached else 1


def _print_landing(console: "Console", landing: "Positioning") -> None:
    """Print how the arm has landed."""
    from stickslip.records import prefixed

    run, move = landing.runs[-1], landing.last
    console.print(
        textwrap.fill(
            f"Then the same arm is sent {prefixed(move.target, 'm')} away, with this estimate for "
            "its first guess and the same noisy sensors: feedback, then series of pulses.",
            console.width,
        )
    )
    if not landing.ending.reached:
        words = f"✗ {landing.ending.value}: {landing.ending_text}"
        console.print(textwrap.fill(words, console.width), style="bold red")
        return
    arm = run.arm
    fired = "" if arm is None else f", by {len(arm.series)} series"
    swing = "" if move.swing is None else f", mass 2 swings by {prefixed(move.swing, 'm')}"
    settled = "" if move.settling_time is None else f" after {prefixed(move.settling_time, 's')}"
    words = (
        f"✓ landed{settled}{fired}: mass 1 rests {prefixed(abs(move.final_error), 'm')} from the "
        f"target{swing}; asked for were {prefixed(landing.tolerance, 'm')}."
    )
    console.print(textwrap.fill(words, console.width), style="green")
