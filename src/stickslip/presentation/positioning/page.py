"""A positioning task as tables and as a page: its outcome, the motion, and what was learned."""

from collections.abc import Sequence

import numpy as np

from stickslip.presentation.drawing import symbol
from stickslip.presentation.page import (
    Block,
    Fact,
    Fold,
    Grid,
    Heading,
    Page,
    Section,
    Text,
    Verdict,
    headed_list,
    scenario_blocks,
)
from stickslip.presentation.positioning import figures
from stickslip.presentation.positioning.film import film
from stickslip.presentation.table import Cell, Column, Table
from stickslip.presentation.words import (
    NONE,
    between_text,
    or_none,
    prefixed,
    printed_unit,
    shown,
    typeset,
)
from stickslip.records import (
    ArmRun,
    Ending,
    Positioning,
    PositioningMove,
    PositioningRun,
    count_of,
    parameter_label,
    unit_of,
)

_UNFOLDED = 3  # runs up to which all are open
_MOST_RUNS = 8  # runs that are drawn: the first, the last, and some between
_ROUNDING = 1e-12  # errors below it come from rounding [m or rad]

_SERIES_TEXT = (
    "What each series was planned to do with both masses from the state it began in, and what it "
    "did. Where a series shall miss on purpose, the next one comes back from there. Errors are "
    "those to the target of the series, and true ones."
)
_BOTH_FRICTIONS = (
    "Coulomb and viscous friction without a direction are those of the online estimator, from the "
    "whole motion; mass and friction of each direction are those of the pulses, which are too "
    "short and slow to determine viscous friction well."
)
_LIMITS_TEXT = (
    "Static friction shows itself only to pulses near it: it is known to lie between the strongest "
    "effort that has not freed the axis, or its Coulomb friction, and the weakest that has freed "
    "it."
)


def positioning_page(result: Positioning) -> Page:
    """Return the page of a positioning task."""
    last, unit = result.last, unit_of("position", result.kind)
    away = (
        f"The final error is {shown(last.final_error, unit)}, the tolerance "
        f"{shown(result.tolerance, unit)}."
    )
    if result.ending is Ending.HUNTING:
        low, high = last.late_errors
        away += f" It swings between {shown(low, unit)} and {shown(high, unit)}."
    sections = _of_axis(result) if result.runs[0].arm is None else _of_arm(result)
    notes = headed_list("Notes", result.notes)
    scenario = scenario_blocks(result.scenario, result.file, result.sha256)
    return Page(
        title=f"Positioning: {result.name}",
        kicker=f"positioning · {what_moves(result)}",
        name=result.name,
        verdict=Verdict(result.ending.reached, result.ending.word, f"{result.ending_text} {away}"),
        facts=_facts(result),
        sections=[*sections, Section("scenario", "Scenario", [*notes, *scenario])],
        version=result.stickslip_version,
    )


def what_moves(result: Positioning) -> str:
    """Return the kind of axis in words."""
    rigid = result.runs[0].arm is None
    return f"{result.kind} axis" if rigid else f"flexible arm, {result.kind}"


def _of_axis(result: Positioning) -> list[Section]:
    """Return the sections of a rigid axis."""
    drawn = _drawn(result.runs)
    motions = [[figures.motion_plot(run, result), *_phases(run)] for run in drawn]
    sections = [Section("motion", "Motion", [*_moves(result), *_run_by_run(drawn, motions)])]
    if result.runs[0].estimates:
        estimates = figures.estimate_plots(result)
        steps = "over time" if any(run.phases for run in drawn) else "from pulse to pulse"
        parted = " Dotted lines part the runs." if len(result.runs) > 1 else ""
        lead = Text(f"Each estimate {steps}.{parted}", "lead")
        pulses = _run_by_run(drawn, [_pulses(run, result) for run in drawn])
        drawings = [lead, Grid(estimates)] if estimates else []
        learned = [*_estimates(result), *drawings]
        sections += [
            Section("pulses", "Pulses", [Grid(figures.pulse_plots(result)), *pulses]),
            Section("learned", "What was learned", learned),
        ]
    return sections


def _of_arm(result: Positioning) -> list[Section]:
    """Return the sections of a flexible arm."""
    drawn = _drawn(result.runs)
    motions: list[list[Block]] = []
    series: list[list[Block]] = []
    for run in drawn:
        if run.arm is None:
            continue
        motion = figures.arm_motion_plot(run, run.arm, result)
        ends = figures.arm_end_plots(run, run.arm, result)
        motions.append([motion, *_phases(run), Grid(ends)])
        listed = series_table(run, run.arm, result)
        sent = listed if run.arm.series else Text("No series of pulses was sent.")
        series.append([sent, Grid(figures.series_plots(run, run.arm, result))])
    sections = [
        Section("moving", "The arm moving", [film(result.runs[-1], result)]),
        Section("motion", "Motion", [*_moves(result), *_run_by_run(drawn, motions)]),
    ]
    if any(run.phases for run in drawn):
        blocks = [Text(_SERIES_TEXT, "lead"), *_run_by_run(drawn, series)]
        sections.append(Section("series", "Series of pulses", blocks))
    estimates = figures.estimate_plots(result)
    if estimates:
        blocks = [*_estimates(result), Grid(estimates)]
        sections.append(Section("learned", "What was learned", blocks))
    return sections


def _drawn(runs: Sequence[PositioningRun]) -> list[PositioningRun]:
    """Return the first run, the last, and of many some between them."""
    if len(runs) <= _MOST_RUNS:
        return list(runs)
    last = len(runs) - 1
    return [runs[round(k * last / (_MOST_RUNS - 1))] for k in range(_MOST_RUNS)]


def _run_by_run(drawn: Sequence[PositioningRun], bodies: Sequence[Sequence[Block]]) -> list[Block]:
    """Return the first and the last run as they are, and those between to be opened."""
    if len(drawn) == 1:
        return list(bodies[0])
    blocks: list[Block] = []
    for k, (run, body) in enumerate(zip(drawn, bodies, strict=True)):
        words = ", ".join(dict.fromkeys(move.ending.word.lower() for move in run.moves))
        made = "" if run.arm or not run.estimates else f", {count_of(len(run.pulses), 'pulse')}"
        name = f"Run {run.number}: {words}{made}"
        if k in {0, len(drawn) - 1} or len(drawn) <= _UNFOLDED:
            blocks += [Heading(name), *body]
        else:
            blocks.append(Fold(name, body))
    return blocks


def _facts(result: Positioning) -> list[Fact]:
    first, run, last = result.runs[0], result.runs[-1], result.last
    unit, several = unit_of("position", result.kind), len(result.runs) > 1
    what = "target less true position" if run.arm is None else "of the mass that is farther"
    before = shown(first.moves[-1].final_error, unit)
    meaning = f"of run {run.number}; first run {before}" if several else what
    tolerance = f"tolerance {shown(result.tolerance, unit)}"
    facts = [
        Fact("Final error", shown(last.final_error, unit), meaning),
        Fact("Within tolerance after", typeset(_settled(last)), tolerance),
    ]
    if run.arm is not None:
        swing = or_none(last.swing, lambda swing: shown(swing, unit))
        facts.append(Fact("Swing left", swing, "of mass 2, its amplitude in the end"))
        if run.phases:
            pulses = count_of(sum(each.pulses for each in run.arm.series), "pulse")
            facts.append(Fact("Series", str(len(run.arm.series)), f"{pulses} in all"))
    elif first.estimates:
        counted = f"in run {run.number}; {len(first.pulses)} in the first"
        meaning = counted if several else "whose outcome is known"
        facts.append(Fact("Pulses", str(len(run.pulses)), meaning))
    peak = shown(max(move.peak_effort for move in run.moves), unit_of("effort", result.kind))
    moves = f", the last of {count_of(len(run.moves), 'move')}" if len(run.moves) > 1 else ""
    ends = f"from {shown(last.start, unit)} to {shown(last.target, unit)}{moves}"
    return [
        *facts,
        Fact("Peak effort", peak, "largest magnitude"),
        Fact("Controller", result.method, result.controller, code=True),
        Fact("Travel", shown(abs(last.target - last.start), unit), ends),
    ]


def _settled(move: PositioningMove) -> str:
    if move.settling_time is None:
        return "never"
    return "at once" if move.settling_time == 0 else prefixed(move.settling_time, "s")


def _moves(result: Positioning) -> list[Block]:
    return [move_table(result)] if sum(len(run.moves) for run in result.runs) > 1 else []


def move_table(result: Positioning) -> Table:
    """Return every move of every run."""
    position, effort = unit_of("position", result.kind), unit_of("effort", result.kind)
    first = result.runs[0]
    several, arm = len(first.moves) > 1, first.arm is not None
    pulsed = bool(first.estimates) and not arm

    columns = [
        Column("Run"),
        *[Column("Move")] * several,
        *map(Column, ("Target", "Final error")),
        *[Column("Swing left"), Column("Series", only="page")] * arm,
        Column("Within tolerance after"),
        *[Column("Pulses")] * pulsed,
        *[Column("Peak effort"), Column("Ending", "left")],
    ]
    rows: list[list[str | Cell]] = []
    moves = [(run, move) for run in result.runs for move in run.moves]
    for run, move in moves:
        series = [] if run.arm is None else run.arm.series
        sent = sum(each.move == move.number for each in series)
        swing = or_none(move.swing, lambda swing: prefixed(swing, position))
        rows.append(
            [
                str(run.number),
                *[str(move.number)] * several,
                prefixed(move.target, position),
                prefixed(move.final_error, position),
                *[swing, str(sent)] * arm,
                _settled(move),
                *[str(len(move.pulses))] * pulsed,
                prefixed(move.peak_effort, effort),
                Cell(move.ending.word.lower(), "good" if move.ending.reached else "bad"),
            ]
        )
    return Table(columns=columns, rows=rows, what="moves")


def _phases(run: PositioningRun) -> list[Block]:
    return [phase_table(run)] if run.phases else []


def phase_table(run: PositioningRun) -> Table:
    """Return the phases of a run, each with why it began."""
    rows: list[list[str | Cell]] = [
        [
            str(k),
            Cell(phase.word, swatch=figures.PHASE_COLOURS[phase.name]),
            prefixed(phase.start_time, "s"),
            prefixed(phase.end_time - phase.start_time, "s"),
            phase.reason,
        ]
        for k, phase in enumerate(run.phases, start=1)
    ]
    columns = [
        Column("Phase", "left", only="page"),
        Column("What", "left", short="phase"),
        Column("From"),
        Column("For"),
        Column("Why it began", "left"),
    ]
    return Table(columns=columns, rows=rows, style="phases", what="phases")


def series_table(run: PositioningRun, arm: ArmRun, result: Positioning) -> Table:
    """Return the series of a run: the plan of each, and its true outcome."""
    unit = unit_of("position", result.kind)
    several = len(run.moves) > 1

    def missed(value: float | None) -> str:
        if value is None:
            return "not at rest"
        tiny = abs(value) < _ROUNDING
        return f"below 1 p{unit}" if tiny else prefixed(value, unit)

    rows: list[list[str]] = []
    for k, series in enumerate(arm.series, start=1):
        pulses = str(series.pulses)
        if series.pulses != series.effort.size:
            pulses += f" of {count_of(series.effort.size // series.pulses, 'sample')}"
        rows.append(
            [
                str(k),
                *[str(series.move)] * several,
                prefixed(series.start_time, "s"),
                prefixed(float(series.position[0]), unit),
                prefixed(series.target, unit),
                prefixed(series.duration, "s"),
                pulses,
                prefixed(series.start_swing, unit),
                missed(series.planned_error),
                missed(series.final_error),
                missed(series.final_load_error),
                missed(series.final_swing),
            ]
        )
    columns = [
        Column("Series", "left"),
        *[Column("Move", only="page")] * several,
        *map(Column, ("At", "From", "To", "Duration", "Pulses")),
        Column("Swing before", only="page"),
        Column("Planned to miss by", only="page"),
        Column("Mass 1 missed by"),
        Column("Mass 2 at most by", only="page"),
        Column("Swing left", short="mass 2 swings by"),
    ]
    return Table(columns=columns, rows=rows, what="series")


def _pulses(run: PositioningRun, result: Positioning) -> list[Block]:
    """Return the pulses of a run."""
    if not run.pulses:
        return [Text("No pulse of this run has ended.")]
    position, effort = unit_of("position", result.kind), unit_of("effort", result.kind)
    heads = ("Error before", "Predicted", "Achieved", "Missed by")
    columns = [Column("Pulse"), Column("Time"), Column("Effort and width", "left")]
    columns += map(Column, heads)
    rows: list[list[str | Cell]] = []
    for k, pulse in enumerate(run.pulses, start=1):
        achieved, predicted = pulse.achieved_displacement, pulse.predicted_displacement
        levels = (
            f"{shown(level, effort)} for {shown(width, 's')}" for level, width in pulse.levels
        )
        rows.append(
            [
                str(k),
                prefixed(pulse.time, "s"),
                ", ".join(levels),
                prefixed(pulse.error, position),
                prefixed(predicted, position),
                prefixed(achieved, position) if pulse.moved else Cell("did not move", "bad"),
                prefixed(achieved - predicted, position),
            ]
        )
    return [Table(columns=columns, rows=rows, what="pulses")]


def estimate_table(result: Positioning) -> Table:
    """Return the controller's estimates at first and in the end, with the truth."""
    last = result.runs[-1].estimates
    rows: list[list[str | Cell]] = []
    for name, values in result.runs[0].estimates.items():
        truth, end = result.truth.get(name), float(last[name][-1])
        if name in result.limits:
            low, high = result.limits[name]
            ended, missed = between_text(low, high), _inside(truth, low, high)
        elif all(np.all(run.estimates[name] == values[0]) for run in result.runs):
            ended = missed = NONE  # nothing was learned
        else:
            ended = f"{end:.4g}"
            # Adding zero makes 0.0 of -0.0
            missed = f"{round(100 * (end / truth - 1), 1) + 0.0:+.1f} %" if truth else NONE
        rows.append(
            [
                Cell(parameter_label(name, result.kind), symbol=symbol(name)),
                f"{values[0]:.4g}",
                ended,
                or_none(truth, "{:.4g}".format),
                missed,
                printed_unit(name, result.kind),
            ]
        )
    columns = [
        Column("Estimate", "left"),
        Column("At first"),
        Column("In the end", css="value"),
        Column("Truth"),
        Column("Error in the end"),
        Column("Unit", "left", css="unit"),
    ]
    return Table(columns=columns, rows=rows, style="parameters")


def _inside(truth: float | None, low: float | None, high: float | None) -> str:
    if truth is None or (low is None and high is None):
        return NONE

    def printed(value: float) -> float:  # for a verdict that agrees with the row
        return float(f"{value:.4g}")

    inside = (low is None or printed(low) <= printed(truth)) and (
        high is None or printed(truth) <= printed(high)
    )
    return "inside" if inside else "outside"


def _estimates(result: Positioning) -> list[Block]:
    """Return the controller's estimates, and where its first guess came from."""
    first = result.runs[0].estimates
    counted = (
        "Friction of each direction has the constant offset in it, as the controller counts it."
    )
    sources = [
        f"{parameter_label(name, result.kind)}: {source}"
        for name, source in result.first_guess_sources.items()
    ]
    both = "coulomb_friction" in first and "coulomb_friction_positive" in first
    texts = (
        (result.counts_offset, counted),
        (both, _BOTH_FRICTIONS),
        (result.limits, _LIMITS_TEXT),
    )
    where = headed_list("Where the first guess came from", sources)
    return [estimate_table(result), *(Text(text) for needed, text in texts if needed), *where]
