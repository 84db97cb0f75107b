"""What ``stickslip position`` prints of landings: phases, and of a flexible arm its series."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table

    from stickslip.records import ArmRun, Positioning, PositioningRun

__all__ = ["phases_table", "series_table"]

_FIRST, _LAST = 14, 6
"""Rows of a long table that are printed."""


def phases_table(run: "PositioningRun") -> "Table":
    """Return the phases of a run, each with why it began."""
    from stickslip.records import prefixed

    table = _table("phase")
    table.add_column("from", justify="right", no_wrap=True)
    table.add_column("for", justify="right", no_wrap=True)
    table.add_column("as")
    for k, phase in enumerate(run.phases):
        if _FIRST <= k < len(run.phases) - _LAST:
            if k == _FIRST:
                table.add_row("…")
            continue
        table.add_row(
            phase.word.lower(),
            prefixed(phase.start_time, "s"),
            prefixed(phase.end_time - phase.start_time, "s"),
            phase.reason,
        )
    return table


def series_table(arm: "ArmRun", result: "Positioning") -> "Table":
    """Return the series of a run, with what each truly did."""
    from stickslip.records import prefixed, unit_of

    unit = unit_of("position", result.kind)
    table = _table("series")
    heads = ("at", "from", "to", "for", "pulses", "mass 1 missed by", "mass 2 swings by")
    for head in heads:
        table.add_column(head, justify="right", no_wrap=True)
    for k, series in enumerate(arm.series):
        if _FIRST <= k < len(arm.series) - _LAST:
            if k == _FIRST:
                table.add_row("…")
            continue
        error, swing = series.final_error, series.final_swing
        table.add_row(
            str(k + 1),
            prefixed(series.start_time, "s"),
            prefixed(float(series.position[0]), unit),
            prefixed(series.target, unit),
            prefixed(series.duration, "s"),
            str(series.pulses),
            "not at rest" if error is None else prefixed(error, unit),
            "-" if swing is None else prefixed(swing, unit),
        )
    return table


def _table(first: str) -> "Table":
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column(first, no_wrap=True)
    return table
