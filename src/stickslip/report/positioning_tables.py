"""Words and tables of the page of a positioning task. A user's text is escaped here."""

import html
from collections.abc import Sequence
from typing import Any

from stickslip.records import (
    ArmRun,
    Ending,
    Positioning,
    PositioningMove,
    PositioningRun,
    PulseRecord,
    between_text,
    count_of,
    parameter_label,
    prefixed,
    unit_of,
    unit_text,
)
from stickslip.report.dense import wide
from stickslip.report.drawing import symbol

__all__ = [
    "beliefs",
    "body_rows",
    "footer",
    "header",
    "heading_row",
    "moves",
    "provenance",
    "pulses",
    "shortened",
    "shown",
]

_FIRST, _LAST = 30, 15
"""Rows of a long table that are shown."""


def shown(value: float, unit: str) -> str:
    """Return a value in the unit that suits it, as HTML."""
    return prefixed(value, unit).replace("-", "−").replace(" ", "\u00a0")


def header(positioning: Positioning) -> str:
    """Return the head of the page: the task, how it ended, and the main figures."""
    last, position = positioning.last, unit_of("position", positioning.kind)
    mark, tone = ("✓", "trusted") if positioning.ending.reached else ("!", "doubtful")
    away = (
        f"The final error is {shown(last.final_error, position)}, the tolerance "
        f"{shown(positioning.tolerance, position)}."
    )
    if positioning.ending is Ending.HUNTING:
        low, high = last.late_errors
        away += f" It swings between {shown(low, position)} and {shown(high, position)}."
    return (
        '<header class="top">\n'
        f'<p class="kicker">stickslip · positioning · {_axis(positioning)}</p>\n'
        f"<h1>{html.escape(positioning.name)}</h1>\n"
        f'<div class="verdict {tone}"><p class="word">{mark} {positioning.ending.word}</p>'
        f"<p>{html.escape(positioning.ending_text)} {away}</p></div>\n"
        f"{_facts(positioning)}</header>\n"
    )


def _axis(positioning: Positioning) -> str:
    arm = positioning.runs[0].arm is not None
    return f"flexible arm, {positioning.kind}" if arm else f"{positioning.kind} axis"


def _facts(positioning: Positioning) -> str:
    run, first, last = positioning.runs[-1], positioning.runs[0], positioning.last
    position, effort = unit_of("position", positioning.kind), unit_of("effort", positioning.kind)
    several = len(positioning.runs) > 1
    facts = [
        (
            "Final error",
            shown(last.final_error, position),
            f"of run {run.number}; first run {shown(first.moves[-1].final_error, position)}"
            if several
            else _which(positioning),
        ),
        (
            "Within tolerance after",
            _settled(last),
            f"tolerance {shown(positioning.tolerance, position)}",
        ),
    ]
    if run.arm is not None:
        facts += _arm_facts(run, run.arm, last, position)
    elif positioning.runs[0].estimates:
        facts.append(
            (
                "Pulses",
                str(len(run.pulses)),
                f"in run {run.number}; {len(first.pulses)} in the first"
                if several
                else "whose outcome is known",
            )
        )
    peak = max(move.peak_effort for move in run.moves)
    facts += [
        ("Peak effort", shown(peak, effort), "largest magnitude"),
        (
            "Controller",
            f"<code>{html.escape(positioning.method)}</code>",
            html.escape(positioning.controller),
        ),
        (
            "Way",
            shown(abs(last.target - last.start), position),
            f"from {shown(last.start, position)} to {shown(last.target, position)}"
            + (f", the last of {count_of(len(run.moves), 'move')}" if len(run.moves) > 1 else ""),
        ),
    ]
    items = "".join(
        f"<div><dt>{term}</dt><dd>{value}<span class='meaning'>{meaning}</span></dd></div>"
        for term, value, meaning in facts
    )
    return f'<dl class="facts">{items}</dl>\n'


def _which(positioning: Positioning) -> str:
    arm = positioning.runs[0].arm is not None
    return "of the mass that is farther" if arm else "target less true position"


def _arm_facts(
    run: PositioningRun, arm: ArmRun, last: PositioningMove, unit: str
) -> list[tuple[str, str, str]]:
    swing = "–" if last.swing is None else shown(last.swing, unit)
    facts = [("Swing left", swing, "of mass 2, its amplitude in the end")]
    if run.phases:
        pulses = sum(each.pulses for each in arm.series)
        facts.append(("Series", str(len(arm.series)), f"{count_of(pulses, 'pulse')} in all"))
    return facts


def _settled(move: PositioningMove) -> str:
    if move.settling_time is None:
        return "never"
    return "at once" if move.settling_time == 0 else shown(move.settling_time, "s")


def moves(positioning: Positioning) -> str:
    """Return the table of every move of every run; empty if there is only one."""
    every = [(run, move) for run in positioning.runs for move in run.moves]
    if len(every) == 1:
        return ""
    position, effort = unit_of("position", positioning.kind), unit_of("effort", positioning.kind)
    several = len(positioning.runs[0].moves) > 1
    arm = positioning.runs[0].arm is not None
    pulsed = bool(positioning.runs[0].estimates) and not arm
    heads = ["Run", *(["Move", "Target"] if several else []), "Ending", "Final error"]
    heads += ["Swing left", "Series"] if arm else []
    heads += ["Within tolerance after", *(["Pulses"] if pulsed else []), "Peak effort"]
    rows: list[list[str]] = []
    for run, move in every:
        word = move.ending.word
        row = [str(run.number)]
        if several:
            row += [str(move.number), shown(move.target, position)]
        row += [
            f'<span class="mark-{"yes" if move.ending.reached else "no"}">'
            f"{'✓' if move.ending.reached else '✗'} {word}</span>",
            shown(move.final_error, position),
            *_arm_cells(run, move, position),
            _settled(move),
        ]
        if pulsed:
            row.append(str(len(move.pulses)))
        rows.append([*row, shown(move.peak_effort, effort)])
    return wide(heading_row(heads) + body_rows(rows, "moves"))


def _arm_cells(run: PositioningRun, move: PositioningMove, unit: str) -> list[str]:
    if run.arm is None:
        return []
    series = [each for each in run.arm.series if each.move == move.number]
    return ["–" if move.swing is None else shown(move.swing, unit), str(len(series))]


def pulses(run: PositioningRun, positioning: Positioning) -> str:
    """Return the table of the pulses of a run, without the middle of a long one."""
    if not run.pulses:
        return "<p>No pulse of this run has ended.</p>\n"
    position, effort = unit_of("position", positioning.kind), unit_of("effort", positioning.kind)
    heads = [
        "Pulse",
        "Time",
        "Effort and width",
        "Error before",
        "Predicted",
        "Achieved",
        "Missed by",
    ]
    rows = [
        [
            str(k),
            shown(pulse.time, "s"),
            _levels(pulse, effort),
            shown(pulse.error, position),
            shown(pulse.predicted_displacement, position),
            shown(pulse.achieved_displacement, position)
            if pulse.moved
            else '<span class="mark-no">did not move</span>',
            shown(pulse.achieved_displacement - pulse.predicted_displacement, position),
        ]
        for k, pulse in enumerate(run.pulses, start=1)
    ]
    return wide(heading_row(heads) + body_rows(rows, "pulses"))


def _levels(pulse: PulseRecord, unit: str) -> str:
    return ", ".join(
        f"{shown(level, unit)} for {shown(width, 's')}" for level, width in pulse.levels
    )


def heading_row(heads: Sequence[str]) -> str:
    """Return the head of a table; the heads are HTML."""
    cells = "".join(f'<th scope="col">{head}</th>' for head in heads)
    return f"<thead><tr>{cells}</tr></thead>\n"


def body_rows(rows: Sequence[Sequence[str]], what: str) -> str:
    """Return the rows of a table, without the middle of a long one; the cells are HTML."""
    lines = [
        f'<tr><th scope="row">{row[0]}</th>'
        + "".join(f'<td class="number">{cell}</td>' for cell in row[1:])
        + "</tr>\n"
        for row in rows
    ]
    return shortened(lines, what, columns=len(rows[0]) if rows else 1)


def shortened(lines: list[str], what: str, *, columns: int) -> str:
    """Return the rows of a table, given as HTML, without the middle of a long one."""
    if len(lines) > _FIRST + _LAST + 1:
        left_out = len(lines) - _FIRST - _LAST
        lines = [
            *lines[:_FIRST],
            f'<tr><td colspan="{columns}">… {left_out} more {what}, all of them in the JSON '
            "file …</td></tr>\n",
            *lines[-_LAST:],
        ]
    return f"<tbody>\n{''.join(lines)}</tbody>"


def beliefs(positioning: Positioning) -> str:
    """Return what the controller believed at first and in the end, with the truth."""
    first, last = positioning.runs[0].estimates, positioning.runs[-1].estimates
    rows: list[str] = []
    for name, values in first.items():
        unit = unit_of(name, positioning.kind)
        truth = positioning.truth.get(name)
        ended, missed = _number(float(last[name][-1])), _error(float(last[name][-1]), truth)
        if name in positioning.limits:
            low, high = positioning.limits[name]
            ended = between_text(low, high)
            missed = "–" if truth is None else _inside(truth, low, high)
        cells = [
            ("Unit", "unit", unit_text(unit)),
            ("At first", "number", _number(float(values[0]))),
            ("In the end", "number value", ended),
            ("Truth", "number", "–" if truth is None else _number(truth)),
            ("Error", "number", missed),
        ]
        body = "".join(
            f'<td class="{style}" data-label="{label}">{value}</td>'
            for label, style, value in cells
        )
        term = parameter_label(name, positioning.kind)
        label = f'{term} <span class="symbol">{symbol(name)}</span>'
        rows.append(f'<tr><th scope="row">{label}</th>{body}</tr>\n')
    heads = heading_row(["Estimate", "Unit", "At first", "In the end", "Truth", "Error in the end"])
    sources = "".join(
        f"<li>{parameter_label(name, positioning.kind)}: {html.escape(source)}</li>"
        for name, source in positioning.believed.items()
    )
    counted = (
        "<p>Friction of each direction has the constant offset in it, as the controller counts it."
        "</p>\n"
        if positioning.counts_offset
        else ""
    )
    if "coulomb_friction" in first and "coulomb_friction_positive" in first:
        counted += (
            "<p>Coulomb and viscous friction without a direction are those of the estimator that "
            "runs along, from the whole way; mass and friction of each direction are those of the "
            "pulses, which are too short and slow to tell much of viscous friction.</p>\n"
        )
    if positioning.limits:
        counted += (
            "<p>Static friction shows itself only to pulses near it: it is known to lie between "
            "the strongest effort that has not freed the axis, or its Coulomb friction, and the "
            "weakest that has freed it.</p>\n"
        )
    where = f'<h3>Where the first guess came from</h3>\n<ul class="plain">{sources}</ul>\n'
    return (
        f'<table class="parameters">{heads}<tbody>\n{"".join(rows)}</tbody></table>\n'
        f"{counted}{where if sources else ''}"
    )


def _number(value: float) -> str:
    return f"{value:.4g}".replace("-", "−")


def _inside(truth: float, low: float | None, high: float | None) -> str:
    if low is None and high is None:
        return "–"
    inside = (low is None or low <= truth) and (high is None or truth <= high)
    return "inside" if inside else "outside"


def _error(value: float, truth: float | None) -> str:
    if not truth:
        return "–"
    percent = round(100.0 * (value / truth - 1.0), 1) + 0.0  # of −0.0 it makes 0.0
    return f"{percent:+.1f}\u00a0%".replace("-", "−")


def _notes(positioning: Positioning) -> str:
    """Return the notes as a list; empty if there are none."""
    items = "".join(f"<li>{html.escape(each)}</li>" for each in positioning.notes)
    return f'<h3>Notes</h3>\n<ul class="plain">{items}</ul>\n' if items else ""


def provenance(positioning: Positioning) -> str:
    """Return what the scenario says, table by table, and where the result came from."""
    parts = [_notes(positioning)]
    for table, keys in positioning.scenario.items():
        rows = [(html.escape(key), _plain(value, unit)) for key, (value, unit) in keys.items()]
        if rows:
            parts.append(f"<h3><code>[{html.escape(table)}]</code></h3>\n{_rows(rows)}")
    rows = [
        ("Scenario", html.escape(positioning.file)),
        ("SHA-256", f"<code>{html.escape(positioning.sha256)}</code>"),
    ]
    parts.append(f"<h3>Provenance</h3>\n{_rows(rows)}")
    return "".join(parts)


def _plain(value: Any, unit: str) -> str:
    several = value if isinstance(value, tuple | list) else (value,)
    text = ", ".join(f"{each:.6g}" if isinstance(each, float) else str(each) for each in several)
    return f"{html.escape(text)} {unit_text(unit)}".rstrip()


def _rows(rows: Sequence[tuple[str, str]]) -> str:
    body = "".join(f'<tr><th scope="row">{term}</th><td>{value}</td></tr>' for term, value in rows)
    return f'<table class="options"><tbody>{body}</tbody></table>\n'


def footer(positioning: Positioning) -> str:
    """Return the last line of the page."""
    return (
        f"<footer>Written by stickslip {html.escape(positioning.stickslip_version)}. This page "
        "holds everything it shows and fetches nothing.</footer>\n"
    )
