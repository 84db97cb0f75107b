"""Simulate the experiments of van de Wijdeven (2002), and judge the claims of each part.

``python -m studies.van_de_wijdeven part-a --out DIR [--runs N]``, ``part-b`` and ``conjunction``
write one page, its numbers as JSON and a PNG file for each figure into a folder.
"""

import logging
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, CycloptsError, Parameter
from rich.console import Console

from stickslip.cli.arguments import folder, whole_number
from stickslip.cli.terminal import console_on, one_line, progress_bar, reader_may_leave, say
from stickslip.presentation.page import Text
from stickslip.presentation.table import Table, print_table
from stickslip.records import InputError, StickslipError
from studies import van_de_wijdeven as parts
from studies.van_de_wijdeven.page import own_sections
from studies.van_de_wijdeven.records import Claim

_COMMAND = "python -m studies.van_de_wijdeven"
_RUNS, _AXES, _ARMS = 20, 400, 2
_BAD_INPUT, _INTERRUPTED = 2, 130  # exit codes, as of the command line of stickslip

app = App(name=_COMMAND, version_flags=())


@app.default
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
        Parameter(help="Folder for the files; made if it is missing.", converter=folder),
    ],
    runs: Annotated[
        int | None,
        Parameter(
            help="Of part-a: how often everything with noise is repeated; 5 or more, default "
            f"{_RUNS}.",
            converter=whole_number,
        ),
    ] = None,
    axes: Annotated[
        int | None,
        Parameter(
            help="Of part-b: number of random axes on which the controllers are compared; 25 or "
            f"more, default {_AXES}.",
            converter=whole_number,
        ),
    ] = None,
    arms: Annotated[
        int | None,
        Parameter(
            help="Of conjunction: number of random arms on which the controllers are compared; "
            f"default {_ARMS}. Each takes some ten seconds.",
            converter=whole_number,
        ),
    ] = None,
    seed: Annotated[
        int,
        Parameter(help="Of all noise and of the random axes or arms.", converter=whole_number),
    ] = 1,
) -> int:
    """Make the figures and tables of van de Wijdeven (2002), and compare its claims with data.

    Part A simulates its experiments with surrogate values, as its table of parameters is lost, and
    scores every variant of the estimator by Monte Carlo. Part B simulates its own with the values
    of its Table 1, in each reading that its text allows, and compares pulse controllers and PID
    controllers on random axes. The conjunction, which the source only sketches, lands a flexible
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
    with progress_bar(f"simulating {part}") as progress:
        if part == "part-a":
            result = parts.reproduce_part_a(
                out, runs=_RUNS if runs is None else runs, seed=seed, progress=progress
            )
        elif part == "part-b":
            result = parts.reproduce_part_b(
                out, axes=_AXES if axes is None else axes, seed=seed, progress=progress
            )
        else:
            result = parts.reproduce_conjunction(
                out, arms=_ARMS if arms is None else arms, seed=seed, progress=progress
            )
    console = console_on("output")
    with reader_may_leave():
        _print(console, result)
    return 0


def _check_options(part: str, options: Mapping[str, tuple[int | None, str]]) -> None:
    """Refuse an option that has no use for the part."""
    for name, (value, of) in options.items():
        if value is not None and of != part:
            raise InputError(
                "setting_unused", where=_COMMAND, name=name, value="", estimator=part, others=[of]
            )


def _print(console: Console, result: parts.Reproduced) -> None:
    reproduction = result.reproduction
    console.print(reproduction.setting)
    console.print()
    for section in own_sections(reproduction):
        for block in section.blocks:
            if isinstance(block, Text):
                console.print(f"{block.text}\n", markup=False)
            elif isinstance(block, Table) and block.style != "options":
                print_table(console, block)
                if block.caption:
                    console.print(f"{block.caption}\n", markup=False)
    _print_claims(console, reproduction.claims)
    console.print()
    console.print(f"Page     {result.page}", soft_wrap=True)
    console.print(f"Numbers  {result.numbers}", soft_wrap=True)
    console.print(
        f"Figures  {result.pictures[0]} and {len(result.pictures) - 1} more", soft_wrap=True
    )


def _print_claims(console: Console, claims: Sequence[Claim]) -> None:
    """Print how many claims agree, and those that differ."""
    agree = sum(claim.agrees for claim in claims)
    partly = sum(claim.agrees_partly for claim in claims)
    in_part = f", {partly} in part of the readings" if partly else ""
    console.print(
        f"{agree} of {len(claims)} claims of the source agree with what was measured{in_part}."
        + (" These differ:" if agree + partly < len(claims) else "")
    )
    for claim in claims:
        if not (claim.agrees or claim.agrees_partly):
            console.print(f"  {claim.place}: {claim.statement}")
            measured = "; ".join(
                f"{each.quantity}: {each.value_text}" for each in claim.measures if not each.agrees
            )
            console.print(f"    {measured}", style="dim")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code: 0 done, 2 bad input, 130 interrupted."""
    try:
        command, bound, _ = app.parse_args(
            sys.argv[1:] if arguments is None else arguments,
            print_error=False,
            exit_on_error=False,
        )
        return command(*bound.args, **bound.kwargs) or 0
    except CycloptsError as error:
        say(f"{one_line(str(error)).rstrip('.')}; see: {_COMMAND} --help")
    except StickslipError as error:
        say(one_line(str(error)))
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        say(f"{where}{error.strerror or error}; check the path and its permissions")
    except KeyboardInterrupt:
        say("interrupted; no file is half-written")
        return _INTERRUPTED
    return _BAD_INPUT


if __name__ == "__main__":
    logging.basicConfig(format="stickslip: %(message)s")
    sys.exit(main())
