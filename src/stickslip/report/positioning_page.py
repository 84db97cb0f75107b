"""The page of a positioning task: how it ended, the motion, the pulses, and what was learnt."""

from collections.abc import Iterable, Sequence
from itertools import chain
from pathlib import Path

from stickslip.records import Positioning, PositioningRun, count_of
from stickslip.report import positioning_tables as tables
from stickslip.report.arm_animation import animation
from stickslip.report.arm_figures import (
    arm_end_plots,
    arm_motion_plot,
)
from stickslip.report.arm_series_figures import series_plots
from stickslip.report.arm_tables import phases_table, series_table
from stickslip.report.drawing import Plot, key
from stickslip.report.interactive import SCRIPT_POLICY, ending_with, figure, write_page
from stickslip.report.phase_figures import phase_traces
from stickslip.report.positioning_figures import estimate_plots, motion_plot, pulse_plots
from stickslip.report.sheet import Section, contents, head, section
from stickslip.report.timed_estimates import timed_estimate_plots

__all__ = ["write_positioning_page"]

_UNFOLDED = 3
"""Runs up to which all are open."""

_MOST_RUNS = 8
"""Runs that are drawn: the first, the last, and some between."""

_SERIES_TEXT = (
    "What each series was planned to do with both masses from the state it began in, and what it "
    "did. Where a series shall miss on purpose, the next one comes back from there. Errors are "
    "those to the target of the series, and true ones."
)


def write_positioning_page(positioning: Positioning, path: Path | str) -> Path:
    """Write a positioning task as one HTML page that works offline, on paper and on a phone.

    The page holds everything it needs (about 5 MB, nearly all of it the drawing library) and
    fetches nothing. It appears under its name only once it is complete.

    Parameters
    ----------
    positioning
        What to show; nothing is computed from it but the drawing.
    path
        The HTML file to write; an existing one is replaced.

    Returns
    -------
    The path written.

    Raises
    ------
    InputError
        If nothing can be written there.
    """
    return write_page(_page(positioning), path)


def _page(positioning: Positioning) -> Iterable[str]:
    rigid = positioning.runs[0].arm is None
    sections, plots = _of_axis(positioning) if rigid else _of_arm(positioning)
    sections.append(Section("scenario", "Scenario", tables.provenance(positioning)))
    yield head(f"Positioning: {positioning.name}", policy=SCRIPT_POLICY)
    yield tables.header(positioning)
    yield contents([(anchor, name) for anchor, name, _ in sections])
    yield "<main>\n"
    for anchor, name, body in sections:
        yield section(anchor, name, body)
    yield "</main>\n"
    yield tables.footer(positioning)
    yield from ending_with(plots)


def _of_axis(positioning: Positioning) -> tuple[list[Section], list[Plot]]:
    """Return the sections of a rigid axis, and what is drawn in them."""
    drawn = _drawn(positioning.runs)
    motions = [motion_plot(run, positioning) for run in drawn]
    compared = pulse_plots(positioning)
    timed = any(run.phases for run in positioning.runs)
    estimates = timed_estimate_plots(positioning) if timed else estimate_plots(positioning)
    sections = [Section("motion", "Motion", _motion(positioning, drawn, motions))]
    if estimates:
        sections += [
            Section("pulses", "Pulses", _pulses(positioning, drawn, compared)),
            Section("learnt", "What was learnt", _learnt(positioning, estimates)),
        ]
    return sections, [*motions, *compared, *estimates]


def _of_arm(positioning: Positioning) -> tuple[list[Section], list[Plot]]:
    """Return the sections of a flexible arm, and what is drawn in them."""
    drawn = _drawn(positioning.runs)
    arms = [(run, run.arm) for run in drawn if run.arm is not None]
    motions = [arm_motion_plot(run, arm, positioning) for run, arm in arms]
    ends = [arm_end_plots(run, arm, positioning) for run, arm in arms]
    flown = [series_plots(run, arm, positioning) for run, arm in arms]
    estimates = timed_estimate_plots(positioning)
    bodies = [
        _phased(plot, run) + _grid(last)
        for plot, last, (run, _) in zip(motions, ends, arms, strict=True)
    ]
    sections = [
        Section("moving", "The arm moving", animation(positioning.runs[-1], positioning)),
        Section("motion", "Motion", tables.moves(positioning) + _run_by_run(drawn, bodies)),
    ]
    if any(run.phases for run in drawn):
        tabled = [
            series_table(run, arm, positioning) + _grid(plots)
            for (run, arm), plots in zip(arms, flown, strict=True)
        ]
        about = f'<p class="lead">{_SERIES_TEXT}</p>\n'
        sections.append(Section("series", "Series of pulses", about + _run_by_run(drawn, tabled)))
    if estimates:
        learnt = tables.beliefs(positioning) + _grid(estimates)
        sections.append(Section("learnt", "What was learnt", learnt))
    return sections, [*motions, *chain(*ends), *chain(*flown), *estimates]


def _grid(plots: Sequence[Plot]) -> str:
    """Return drawings beside each other, with the key that they share."""
    if not plots:
        return ""
    shared = key([trace for plot in plots for trace in plot.traces])
    drawings = "".join(figure(plot, "") for plot in plots)
    return f'{shared}<div class="grid">\n{drawings}</div>\n'


def _drawn(runs: Sequence[PositioningRun]) -> list[PositioningRun]:
    """Return the first run, the last, and of many some between them."""
    if len(runs) <= _MOST_RUNS:
        return list(runs)
    last = len(runs) - 1
    return [runs[round(k * last / (_MOST_RUNS - 1))] for k in range(_MOST_RUNS)]


def _motion(
    positioning: Positioning, drawn: Sequence[PositioningRun], plots: Sequence[Plot]
) -> str:
    parts = [tables.moves(positioning)]
    bodies = [_phased(plot, run) for plot, run in zip(plots, drawn, strict=True)]
    parts.append(_run_by_run(drawn, bodies))
    return "".join(parts)


def _phased(plot: Plot, run: PositioningRun) -> str:
    """Return the drawing of a run's motion, with its phases."""
    return figure(plot, key([*plot.traces, *phase_traces(run)])) + phases_table(run)


def _pulses(
    positioning: Positioning, drawn: Sequence[PositioningRun], plots: Sequence[Plot]
) -> str:
    return _grid(plots) + _run_by_run(drawn, [tables.pulses(run, positioning) for run in drawn])


def _run_by_run(drawn: Sequence[PositioningRun], bodies: Sequence[str]) -> str:
    """Return the first and the last run as they are, and those between to be opened."""
    if len(drawn) == 1:
        return bodies[0]
    parts: list[str] = []
    for k, (run, body) in enumerate(zip(drawn, bodies, strict=True)):
        words = ", ".join(dict.fromkeys(move.ending.word.lower() for move in run.moves))
        made = "" if run.arm or not run.estimates else f", {count_of(len(run.pulses), 'pulse')}"
        name = f"Run {run.number}: {words}{made}"
        if k in {0, len(drawn) - 1} or len(drawn) <= _UNFOLDED:
            parts.append(f"<h3>{name}</h3>\n{body}")
        else:
            parts.append(f"<details><summary>{name}</summary>\n{body}</details>\n")
    return "".join(parts)


def _learnt(positioning: Positioning, plots: Sequence[Plot]) -> str:
    steps = "over time" if positioning.runs[0].phases else "from pulse to pulse"
    parted = " Dotted lines part the runs." if len(positioning.runs) > 1 else ""
    return (
        tables.beliefs(positioning)
        + f'<p class="lead">Each estimate {steps}.{parted}</p>\n'
        + _grid(plots)
    )
