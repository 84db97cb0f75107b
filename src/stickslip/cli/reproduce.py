"""``stickslip reproduce``: the report's figures, tables and claims, made anew."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from stickslip.cli.arguments import folder, whole_number
from stickslip.cli.landing_tables import friction_errors, landing_scores, reference_series
from stickslip.cli.pulse_tables import carried_runs, controller_scores, printed_numbers
from stickslip.cli.terminal import console_on, progress_bar, reader_may_leave

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from stickslip.jobs import Reproduced
    from stickslip.records import Claim, EnergyReproduction, VariantScore

__all__ = ["reproduce"]

_RUNS, _AXES, _ARMS = 20, 400, 2
_PARTS = {"part-a": "part A", "part-b": "part B", "conjunction": "the conjunction"}


def reproduce(
    part: Annotated[
        Literal["part-a", "part-b", "conjunction"],
        Parameter(
            help="part-a: energy-based estimation of Coulomb and viscous friction; part-b: pulse "
            "width control and pulse amplitude pulse width control; conjunction: both together, "
            "which land a flexible arm."
        ),
    ],
    /,
    *,
    out: Annotated[
        Path,
        Parameter(help="Folder for what is written; made if it is missing.", converter=folder),
    ],
    runs: Annotated[
        int | None,
        Parameter(
            help="Of part-a: how often everything with noise is repeated; 5 or more, 20 unless "
            "given.",
            converter=whole_number,
        ),
    ] = None,
    axes: Annotated[
        int | None,
        Parameter(
            help="Of part-b: on how many random axes the controllers are compared; 25 or more, "
            f"{_AXES} unless given.",
            converter=whole_number,
        ),
    ] = None,
    arms: Annotated[
        int | None,
        Parameter(
            help="Of conjunction: on how many random arms the controllers are compared; "
            f"{_ARMS} unless given. Each takes some ten seconds.",
            converter=whole_number,
        ),
    ] = None,
    seed: Annotated[
        int,
        Parameter(help="Of all noise and of the random axes or arms.", converter=whole_number),
    ] = 1,
) -> int:
    """Make the figures and tables of the report anew, and put its claims beside measurements.

    Part A simulates its experiments with surrogate values, as its table of parameters is lost, and
    scores every variant of the estimator by Monte Carlo. Part B simulates its own with the values
    of its Table 1, in each reading that its text allows, and compares pulse controllers and PID
    controllers on random axes. The conjunction, which the report only sketches, lands a flexible
    arm at rest, and compares controllers on random arms. Writes one page, its numbers as JSON and a
    PNG file for each figure into the folder.
    """
    _check_options(
        part,
        {
            "--runs": (runs, "part-a"),
            "--axes": (axes, "part-b"),
            "--arms": (arms, "conjunction"),
        },
    )
    with progress_bar(f"reproducing {_PARTS[part]}") as progress:
        if part == "part-a":
            from stickslip.jobs import reproduce_part_a

            result = reproduce_part_a(
                out, runs=_RUNS if runs is None else runs, seed=seed, progress=progress
            )
        elif part == "part-b":
            from stickslip.jobs import reproduce_part_b

            result = reproduce_part_b(
                out, axes=_AXES if axes is None else axes, seed=seed, progress=progress
            )
        else:
            from stickslip.jobs import reproduce_conjunction

            result = reproduce_conjunction(
                out, arms=_ARMS if arms is None else arms, seed=seed, progress=progress
            )
    console = console_on("output")
    with reader_may_leave():
        _print(console, result)
    return 0


def _check_options(part: str, options: Mapping[str, tuple[int | None, str]]) -> None:
    """Refuse an option that has no use for the part."""
    from stickslip.records import InputError

    for name, (value, of) in options.items():
        if value is not None and of != part:
            raise InputError(
                f"{name} is an option of {of}, it has no use for {part}",
                where="reproduce",
                remedy=f"leave it out, or reproduce {of}",
            )


def _print(console: "Console", result: "Reproduced") -> None:
    from stickslip.records import (
        ConjunctionReproduction,
        EnergyReproduction,
        PulseReproduction,
    )

    reproduction = result.reproduction
    console.print(reproduction.setting)
    console.print()
    match reproduction:
        case EnergyReproduction():
            console.print(_five_runs(reproduction))
            console.print(_variants(reproduction))
        case PulseReproduction():
            console.print(printed_numbers(reproduction))
            console.print(carried_runs(reproduction))
            console.print(controller_scores(reproduction))
        case ConjunctionReproduction():
            console.print(reference_series(reproduction))
            console.print(friction_errors(reproduction))
            console.print(landing_scores(reproduction))
        case _:
            pass
    _print_claims(console, reproduction.claims)
    console.print()
    console.print(f"Page     {result.page}", soft_wrap=True)
    console.print(f"Numbers  {result.numbers}", soft_wrap=True)
    console.print(
        f"Figures  {result.pictures[0]} and {len(result.pictures) - 1} more", soft_wrap=True
    )


def _print_claims(console: "Console", claims: "Sequence[Claim]") -> None:
    """Print how many claims agree, and those that differ."""
    agree = sum(claim.agrees for claim in claims)
    partly = sum(claim.agrees_partly for claim in claims)
    in_part = f", {partly} in part of the readings" if partly else ""
    console.print(
        f"{agree} of {len(claims)} claims of the report agree with what was measured{in_part}."
        + (" These differ:" if agree + partly < len(claims) else "")
    )
    for claim in claims:
        if not (claim.agrees or claim.agrees_partly):
            console.print(f"  {claim.place}: {claim.statement}")
            console.print(f"    {claim.measured}", style="dim")


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
