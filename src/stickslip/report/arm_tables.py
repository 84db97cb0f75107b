"""Tables of the phases of a landing and of the series of an arm, for the page of a task."""

import html

from stickslip.records import ArmRun, Positioning, PositioningRun, count_of, unit_of
from stickslip.report.dense import wide
from stickslip.report.phase_figures import PHASE_COLOURS
from stickslip.report.positioning_tables import body_rows, heading_row, shortened, shown

__all__ = ["phases_table", "series_table"]

_ROUNDING = 1e-12
"""Errors below it come from rounding [m or rad]."""


def phases_table(run: PositioningRun) -> str:
    """Return the phases of a run, each with why it began; empty if there are none."""
    if not run.phases:
        return ""
    rows = [
        f'<tr><th scope="row">{k}</th><td><span class="swatch" style="background:'
        f'{PHASE_COLOURS[phase.name]}"></span>{phase.word}</td>'
        f'<td class="number">{shown(phase.start_time, "s")}</td>'
        f'<td class="number">{shown(phase.end_time - phase.start_time, "s")}</td>'
        f"<td>{html.escape(phase.reason)}</td></tr>\n"
        for k, phase in enumerate(run.phases, start=1)
    ]
    heads = heading_row(["Phase", "What", "From", "For", "Why it began"])
    return f'<table class="phases">{heads}{shortened(rows, "phases", columns=5)}</table>\n'


def series_table(run: PositioningRun, arm: ArmRun, positioning: Positioning) -> str:
    """Return the series of a run: what each was to do, and what it truly did."""
    if not arm.series:
        return "<p>No series of pulses was sent.</p>\n"
    unit = unit_of("position", positioning.kind)
    several = len(run.moves) > 1
    heads = ["Series", *(["Move"] if several else []), "At", "From", "To", "Pulses", "Duration"]
    heads += ["Swing before", "Planned to miss by", "Mass 1 missed by", "Mass 2 at most by"]
    rows: list[list[str]] = []
    for k, series in enumerate(arm.series, start=1):
        rows.append(
            [
                str(k),
                *([str(series.move)] if several else []),
                shown(series.start_time, "s"),
                shown(float(series.position[0]), unit),
                shown(series.target, unit),
                _pulses(series.pulses, series.effort.size),
                shown(series.duration, "s"),
                shown(series.start_swing, unit),
                _tiny(series.planned_error, unit),
                _or_not(series.final_error, unit),
                _or_not(series.final_load_error, unit),
                _or_not(series.final_swing, unit),
            ]
        )
    return wide(heading_row([*heads, "Swing left"]) + body_rows(rows, "series"))


def _pulses(pulses: int, samples: int) -> str:
    of = "" if pulses == samples else f" of {count_of(samples // pulses, 'sample')}"
    return f"{pulses}{of}"


def _or_not(value: float | None, unit: str) -> str:
    return "not at rest" if value is None else _tiny(value, unit)


def _tiny(value: float, unit: str) -> str:
    return f"below 1 p{unit}" if abs(value) < _ROUNDING else shown(value, unit)
