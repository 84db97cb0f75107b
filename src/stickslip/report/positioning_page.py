"""The page of a positioning task: how it ended, the motion, the pulses, and what was learnt."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from stickslip.outputs import check_output, whole_file
from stickslip.records import Positioning, PositioningRun, count_of
from stickslip.report import positioning_tables as tables
from stickslip.report.drawing import Plot, key
from stickslip.report.interactive import SCRIPT_POLICY, ending_with, figure
from stickslip.report.positioning_figures import estimate_plots, motion_plot, pulse_plots
from stickslip.report.sheet import contents, head, section

__all__ = ["write_positioning_page"]

_UNFOLDED = 3
"""Runs up to which all are open."""

_MOST_RUNS = 12
"""Runs that are drawn: the first, the last, and some between."""


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
    target = Path(path)
    check_output(target, what="the report")
    with whole_file(target, what="the report") as stream:
        stream.writelines(_page(positioning))
    return target


def _page(positioning: Positioning) -> Iterable[str]:
    drawn = _drawn(positioning.runs)
    motions = [motion_plot(run, positioning) for run in drawn]
    compared = pulse_plots(positioning)
    estimates = estimate_plots(positioning)
    sections = [
        ("motion", "Motion", _motion(positioning, drawn, motions)),
        ("pulses", "Pulses", _pulses(positioning, drawn, compared)),
        ("learnt", "What was learnt", _learnt(positioning, estimates)),
        ("scenario", "Scenario", tables.provenance(positioning)),
    ]
    if not estimates:
        sections = [each for each in sections if each[0] not in {"pulses", "learnt"}]
    yield head(f"Positioning: {positioning.name}", policy=SCRIPT_POLICY)
    yield tables.header(positioning)
    yield contents([(anchor, name) for anchor, name, _ in sections])
    yield "<main>\n"
    for anchor, name, body in sections:
        yield section(anchor, name, body)
    yield "</main>\n"
    yield tables.footer(positioning)
    yield from ending_with([*motions, *compared, *estimates])


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
    bodies = [figure(plot, key(plot.traces)) for plot in plots]
    parts.append(_run_by_run(drawn, bodies))
    return "".join(parts)


def _pulses(
    positioning: Positioning, drawn: Sequence[PositioningRun], plots: Sequence[Plot]
) -> str:
    drawings = "".join(figure(plot, "") for plot in plots)
    shared = key([trace for plot in plots for trace in plot.traces])
    grid = f'{shared}<div class="grid">\n{drawings}</div>\n' if plots else ""
    return grid + _run_by_run(drawn, [tables.pulses(run, positioning) for run in drawn])


def _run_by_run(drawn: Sequence[PositioningRun], bodies: Sequence[str]) -> str:
    """Return the first and the last run as they are, and those between to be opened."""
    if len(drawn) == 1:
        return bodies[0]
    parts: list[str] = []
    for k, (run, body) in enumerate(zip(drawn, bodies, strict=True)):
        words = ", ".join(dict.fromkeys(move.ending.word.lower() for move in run.moves))
        made = f", {count_of(len(run.pulses), 'pulse')}" if run.estimates else ""
        name = f"Run {run.number}: {words}{made}"
        if k in {0, len(drawn) - 1} or len(drawn) <= _UNFOLDED:
            parts.append(f"<h3>{name}</h3>\n{body}")
        else:
            parts.append(f"<details><summary>{name}</summary>\n{body}</details>\n")
    return "".join(parts)


def _learnt(positioning: Positioning, plots: Sequence[Plot]) -> str:
    drawings = "".join(figure(plot, "") for plot in plots)
    shared = key(plots[0].traces) if plots else ""
    parted = " Dotted lines part the runs." if len(positioning.runs) > 1 else ""
    return (
        tables.beliefs(positioning)
        + f'<p class="lead">Each estimate from pulse to pulse.{parted}</p>\n'
        + f'{shared}<div class="grid">\n{drawings}</div>\n'
    )
