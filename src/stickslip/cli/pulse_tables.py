"""What part B of the report gives, as tables on a terminal."""

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table

    from stickslip.records import PulseReproduction

__all__ = ["carried_runs", "controller_scores", "printed_numbers", "table_of"]


def table_of(title: str, words: tuple[str, ...], numbers: tuple[str, ...]) -> "Table":
    """Return an empty table with columns of words, then of numbers."""
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    for head in words:
        table.add_column(head)
    for head in numbers:
        table.add_column(head, justify="right")
    return table


def printed_numbers(reproduction: "PulseReproduction") -> "Table":
    """Return the report's numbers beside ours."""
    table = table_of("The report's numbers", ("place", "quantity"), ("report", "ours", "unit"))
    for each in reproduction.printed_numbers:
        unit = "" if each.unit == "1" else each.unit
        table.add_row(each.place, each.quantity, each.report, f"{each.value:.4g}", unit)
    return table


def carried_runs(reproduction: "PulseReproduction") -> "Table":
    """Return how the first and the last run of each case ended."""
    table = table_of(
        "Consecutive runs: pulses and error [µm] of the first and of the last, and how many ended "
        "at rest on target",
        ("controller", "reading", "t_p,max [s]"),
        ("pulses", "error", "pulses", "error", "on target"),
    )
    for each in reproduction.carried_runs:
        table.add_row(
            each.controller,
            each.reading,
            "–" if each.longest_pulse is None else f"{each.longest_pulse:g}",
            *(
                cell
                for run in (0, -1)
                for cell in (f"{each.pulses[run]}", f"{1e6 * each.final_error[run]:.1f}")
            ),
            f"{int(each.reached.sum())} of {each.reached.size}",
        )
    return table


def controller_scores(reproduction: "PulseReproduction") -> "Table":
    """Return how the controllers do on random axes."""
    scores = reproduction.controller_scores
    table = table_of(
        f"Controllers on {scores[0].axes} random axes",
        ("controller",),
        ("on target", "hunting", "median error", "worst", "median time", "pulses"),
    )
    for each in scores:
        table.add_row(
            each.controller + (f" ({each.axes} axes)" if each.axes != scores[0].axes else ""),
            f"{100 * each.within_tolerance:.1f} %",
            f"{100 * each.hunting:.1f} %",
            f"{1e6 * each.median_error:.1f} µm",
            f"{1e6 * each.worst_error:.1f} µm",
            _number(each.median_time, " s"),
            _number(each.median_pulses, ""),
        )
    return table


def _number(value: float | None, unit: str) -> str:
    return "–" if value is None or math.isnan(value) else f"{value:.3g}{unit}"
