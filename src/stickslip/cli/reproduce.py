"""``stickslip reproduce``: the report's figures, tables and claims, made anew."""

import contextlib
import sys
from collections.abc import Callable, Generator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from stickslip.cli.arguments import folder, whole_number
from stickslip.cli.terminal import console_on, reader_may_leave

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from stickslip.jobs import Reproduced
    from stickslip.records import EnergyReproduction, VariantScore

__all__ = ["reproduce"]


def reproduce(
    part: Annotated[
        Literal["part-a"],
        Parameter(help="part-a: energy-based estimation of Coulomb and viscous friction."),
    ],
    /,
    *,
    out: Annotated[
        Path,
        Parameter(help="Folder for what is written; made if it is missing.", converter=folder),
    ],
    runs: Annotated[
        int,
        Parameter(
            help="How often everything with noise is repeated; 5 or more.", converter=whole_number
        ),
    ] = 20,
    seed: Annotated[int, Parameter(help="Of all noise.", converter=whole_number)] = 1,
) -> int:
    """Make the figures and tables of the report anew, and put its claims beside measurements.

    Simulates the report's experiments with surrogate values, as its table of parameters is lost,
    and scores every variant of the estimator by Monte Carlo. Writes one page, its numbers as JSON
    and a PNG file for each figure into the folder.
    """
    del part  # there is one so far
    with _progress("reproducing part A") as progress:
        from stickslip.jobs import reproduce_part_a

        result = reproduce_part_a(out, runs=runs, seed=seed, progress=progress)
    console = console_on("output")
    with reader_may_leave():
        _print(console, result)
    return 0


@contextlib.contextmanager
def _progress(doing: str) -> Generator[Callable[[int, int], None] | None]:
    """Draw a bar on a terminal; say nothing where nobody looks on."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.progress import Progress

    with Progress(console=console_on("error"), transient=True) as bar:
        task = bar.add_task(doing, total=None)
        yield lambda done, every: bar.update(task, completed=done, total=every)


def _print(console: "Console", result: "Reproduced") -> None:
    from stickslip.records import EnergyReproduction

    reproduction = result.reproduction
    console.print(reproduction.setting)
    console.print()
    if isinstance(reproduction, EnergyReproduction):
        console.print(_five_runs(reproduction))
        console.print(_variants(reproduction))
    differing = [claim for claim in reproduction.claims if not claim.agrees]
    console.print(
        f"{len(reproduction.claims) - len(differing)} of {len(reproduction.claims)} claims of the "
        "report agree with what was measured. These differ:"
    )
    for claim in differing:
        console.print(f"  {claim.place}: {claim.statement}")
        console.print(f"    {claim.measured}", style="dim")
    console.print()
    console.print(f"Page     {result.page}", soft_wrap=True)
    console.print(f"Numbers  {result.numbers}", soft_wrap=True)
    console.print(
        f"Figures  {result.pictures[0]} and {len(result.pictures) - 1} more", soft_wrap=True
    )


def _five_runs(reproduction: "EnergyReproduction") -> "Table":
    from rich import box
    from rich.table import Table

    table = Table(
        title="After five consecutive runs",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
    )
    for head in ("loop", "case"):
        table.add_column(head)
    for head in ("Coulomb [N]", "viscous [N s/m]", "ITSE of run 1", "of run 5"):
        table.add_column(head, justify="right")
    for each in reproduction.five_runs:
        table.add_row(
            each.loop,
            each.case,
            *(f"{values[-1]:.4f}" for values in each.values.values()),
            f"{each.itse[0]:.3g}",
            f"{each.itse[-1]:.3g}",
        )
    return table


def _variants(reproduction: "EnergyReproduction") -> "Table":
    from rich import box
    from rich.table import Table

    table = Table(
        title=f"Bias (root mean square error) in % of the truth, "
        f"{reproduction.options['runs']} runs at the surrogate's noise, true σ where one is needed",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
    )
    table.add_column("variant")
    loops = list(dict.fromkeys(each.loop for each in reproduction.variants))
    for loop in loops:
        for head in ("Coulomb", "viscous"):
            table.add_column(f"{loop}\n{head}", justify="right")
    scores: dict[tuple[str, str], VariantScore] = {}
    for each in reproduction.variants:
        if each.noise == 1.0 and each.assumed in {None, 1.0}:
            # A variant that needs no σ is shown as it is without one, which comes first.
            scores.setdefault((each.variant, each.loop), each)
    for variant in dict.fromkeys(name for name, _ in scores):
        cells = [
            f"{100 * scores[variant, loop].bias[name]:+.2f} "
            f"({100 * scores[variant, loop].rmse[name]:.2f})"
            for loop in loops
            for name in scores[variant, loop].bias
        ]
        table.add_row(variant, *cells)
    return table
