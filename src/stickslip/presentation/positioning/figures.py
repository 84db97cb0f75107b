"""The figures of a positioning task: motion, pulses, series of pulses and estimates."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float

from stickslip.presentation import drawing as draw
from stickslip.presentation.drawing import Look, Plot, Trace, axis, layout, line
from stickslip.presentation.words import prefixed, prefixed_unit, printed_unit
from stickslip.records import (
    ArmRun,
    ArmSeries,
    LandingPhaseName,
    Positioning,
    PositioningMove,
    PositioningRun,
    parameter_label,
    unit_of,
)

PHASE_COLOURS: dict[LandingPhaseName, str] = {
    "feedback": "#d6e6f5",
    "resting": "#eceff2",
    "series": "#fce3bd",
    "pulses": "#fce3bd",
    "done": "#d3eddf",
    "stopped": "#f6d3c4",
}
"""Pale enough to lie behind curves; phases are numbered too."""

_MARGIN = {"l": 56, "r": 14, "t": 22, "b": 44}  # of a figure with numbers of phases above it [px]
_AFTER_END = 1.15  # time drawn over the time until the controller has ended
_AFTER_MOTION = 1.6  # time drawn over the time until the last motion
_NARROW = 0.012  # share of the time that a phase takes at least to have its number above it
_ZOOM = 4.0  # half-height of the magnified panel in tolerances, unless the axis ends farther away
_ROOM = 1.15  # half-height of a panel over the largest value in it
_LEAST = 1e-15  # distance, or error over the value, that is drawn for none at all

_MOST_PULSES = 3000  # markers in a figure
_FEW = 60  # values up to which each is marked
_WILD = 5.0  # ratio of displacements from which on they are drawn on logarithms
_LOGARITHMS = {"type": "log", "dtick": 1, "exponentformat": "none"}

_BELOW = 0.03  # lower end of the distances drawn, over the tolerance or the final distance
_MOST_ENDS = 6  # moves whose end is drawn, and the last
_UNDER_WAY = 0.75  # share of a move after which it should have ended
_FIRST, _LAST = 6, 4  # series of a long run that are drawn
_TAIL = 0.4  # share of a series' duration that is drawn after it

_NORMAL_95 = 1.96  # standard deviations of a 95 % interval
_SETTLED = 0.25  # of the time, at whose end an estimate is taken for settled

_TIME = "time <i>t</i> [s]"
_BY_PULSE = "pulse, over all runs [-]"
_SHADED = " Shaded are the phases, numbered as in the table below."
_DASHED = Look(draw.INK, 1.2, "dash")


def shown_until(run: PositioningRun) -> float:
    """Return the time up to which a run is drawn at first: without a long rest at its end."""
    whole = float(run.time[-1])
    phases = run.phases
    if len(run.moves) > 1 or not phases or phases[-1].name not in {"done", "stopped"}:
        return whole
    return min(whole, _AFTER_END * phases[-1].start_time)


def _phase_traces(run: PositioningRun) -> list[Trace]:
    """Return the entries of the phases in the legend: their colours, each once."""
    words: dict[LandingPhaseName, str] = {each.name: each.word.lower() for each in run.phases}
    return [
        {"name": word, "fill": "toself", "fillcolor": PHASE_COLOURS[name]}
        for name, word in words.items()
    ]


def _phase_shades(run: PositioningRun) -> list[dict[str, object]]:
    """Return the phases as bands behind curves over time."""
    return [
        draw.shade(phase.start_time, phase.end_time, PHASE_COLOURS[phase.name])
        for phase in run.phases
    ]


def _phase_layout(run: PositioningRun, end: float) -> dict[str, object]:
    """Return the settings of a layout that shade and number the phases up to a time."""
    numbers = [
        {
            "text": str(k),
            "showarrow": False,
            "xref": "x",
            "yref": "paper",
            "x": 0.5 * (phase.start_time + min(phase.end_time, end)),
            "y": 1,
            "yanchor": "bottom",
            "font": {"size": 11, "color": draw.GREY},
        }
        for k, phase in enumerate(run.phases, start=1)
        if min(phase.end_time, end) - phase.start_time > _NARROW * end
    ]
    margin = {"margin": _MARGIN} if run.phases else {}
    return {"shapes": _phase_shades(run), "annotations": numbers, **margin}


def _tolerance_band(time: Float[np.ndarray, " n"], half: float, row: int) -> Trace:
    """Shade the tolerance over the whole time."""
    ends = time[[0, -1]]
    (shade,) = draw.band(ends, np.full(2, -half), np.full(2, half), name="tolerance", row=row)
    return shade


def _starts(lengths: Sequence[float] | Sequence[int], *, first: float) -> list[dict[str, object]]:
    """Return a dotted line where each run but the first begins."""
    begins = np.cumsum([0, *lengths[:-1]])[1:] + first
    return [draw.vertical(float(x), dash="dot") for x in begins]


def _jumping(
    run: PositioningRun, error: Float[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " m"]]:
    """Return times and errors, at each new target also the error of the target before."""
    at = np.searchsorted(run.time, [move.start_time for move in run.moves[1:]])
    steps = [new.target - old.target for old, new in pairwise(run.moves)]
    return np.insert(run.time, at, run.time[at]), np.insert(error, at, error[at] - steps)


def motion_plot(run: PositioningRun, positioning: Positioning) -> Plot:
    """Draw the error of a run, once whole and once about the tolerance, and the effort."""
    kind, tolerance = positioning.kind, positioning.tolerance
    unit = unit_of("position", kind)
    whole, whole_unit = prefixed_unit(float(np.max(np.abs(run.error))), unit)
    half = _zoom(run, tolerance)
    near, near_unit = prefixed_unit(half, unit)
    lines = [("error, true", run.error, Look(draw.BLUE, 1.4))]
    if not np.array_equal(run.measured_error, run.error):
        lines.insert(0, ("error, measured", run.measured_error, Look(draw.PALE, 4.5)))
    traces: list[Trace] = []
    for row, factor in ((1, whole), (2, near)):
        traces.append(_tolerance_band(run.time, factor * tolerance, row))
        for name, values, look in lines:
            time, error = _jumping(run, values)
            traces.append(line(time, factor * error, name, look, row))
    traces.append(draw.steps(run.time, run.effort, "effort", Look(draw.VERMILION, 1.5), 3))
    end, last = _motion_until(run), float(run.time[-1])
    return Plot(
        anchor=f"motion-{run.number}",
        alternative=(
            f"Run {run.number}: position error and effort over {last:.3g} s. The error "
            f"starts at {whole * run.error[0]:.3g} {whole_unit} and ends at "
            f"{near * run.error[-1]:.3g} {near_unit}."
        ),
        caption=(
            "Error is target less position; the shaded band is the tolerance. The panel in the "
            "middle is the upper one, magnified about the target."
            + (" At each new target the error jumps." if len(run.moves) > 1 else "")
            + (f" From {end:.3g} s to the end at {last:.4g} s nothing changes." * (end < last))
            + _SHADED * bool(run.phases)
            + draw.thinned_text(run.time.size)
        ),
        traces=traces,
        layout=layout(
            x=axis(_TIME, range=[0.0, end]),
            y=[
                axis(f"error [{whole_unit}]"),
                axis(f"magnified [{near_unit}]", range=[-near * half, near * half]),
                axis(f"effort <i>u</i> [{printed_unit('effort', kind)}]"),
            ],
            **_phase_layout(run, end),
        ),
        height=620,
        also_in_legend=_phase_traces(run),
    )


def _motion_until(run: PositioningRun) -> float:
    """Return the time up to which the error is drawn at first: not long after the last motion."""
    whole = float(run.time[-1])
    error = run.error
    if len(run.moves) > 1:
        return whole
    moving = np.flatnonzero((error[1:] != error[:-1]) | (run.effort != 0.0))
    last = float(run.time[moving[-1] + 1]) if moving.size else 0.0
    return min(whole, float(f"{max(_AFTER_MOTION * last, 0.05 * whole):.2g}"))


def _zoom(run: PositioningRun, tolerance: float) -> float:
    """Return the half-height of the magnified panel: it shows how every move ends."""
    farthest = 0.0
    for move in run.moves:
        # The last quarter: of an axis that hunts a good part of a cycle
        begin = move.end_time - 0.25 * (move.end_time - move.start_time)
        late = (run.time > begin) & (run.time < move.end_time)
        if late.any():
            farthest = max(farthest, float(np.max(np.abs(run.error[late]))))
    return max(_ZOOM * tolerance, _ROOM * farthest)


def pulse_plots(positioning: Positioning) -> list[Plot]:
    """Draw the predicted and the achieved displacement of each pulse, and their ratio."""
    runs = positioning.runs
    every = [(run.number, k, p) for run in runs for k, p in enumerate(run.pulses, start=1)]
    moved = [
        (f"run {number}, pulse {k}", count, p.predicted_displacement, p.achieved_displacement)
        for count, (number, k, p) in enumerate(every, start=1)
        if p.moved and p.achieved_displacement * p.predicted_displacement > 0
    ]
    if len(moved) < 2:
        return []
    others = len(every) - len(moved)
    moved = moved[:: -(-len(moved) // _MOST_PULSES)]
    sizes = [abs(size) for _, _, *both in moved for size in both]
    factor, shown = prefixed_unit(max(sizes), unit_of("position", positioning.kind))
    ends = np.array([min(sizes) / 1.5, max(sizes) * 1.5]) * factor
    pairs = [line(ends, ends, "as predicted", _DASHED)]
    ratios = [draw.level([1.0, float(max(2, len(every)))], 1.0, "as predicted", _DASHED)]
    for direction, name, colour, mark in (
        (1, "forward pulse", draw.BLUE, "circle"),
        (-1, "backward pulse", draw.VERMILION, "diamond"),
    ):
        there = [each for each in moved if each[2] * direction > 0]
        if not there:
            continue
        texts, counts, *both = zip(*there, strict=True)
        predicted, achieved = np.abs(np.array(both))
        look = {"color": colour, "size": 7, "opacity": 0.7, "symbol": mark}
        texts, counts = list(texts), [float(each) for each in counts]
        pairs.append(draw.markers(factor * predicted, factor * achieved, name, look, text=texts))
        ratios.append(draw.markers(counts, achieved / predicted, name, look, text=texts))
    spread = [achieved / predicted for *_, predicted, achieved in moved]
    scale, wild = (
        _LOGARITHMS if max(each) > _WILD * min(each) else {"rangemode": "tozero"}
        for each in (sizes, spread)
    )
    not_drawn = (
        f" {others} of {len(every)} pulses moved nothing or went the other way and are not drawn."
    )
    return [
        Plot(
            anchor="pulse-pairs",
            alternative=(
                f"Achieved against predicted displacement of {len(every)} pulses, from "
                f"{ends[0]:.2g} to {ends[1]:.2g} {shown}."
            ),
            caption="Points on the line went as far as the controller expected."
            + not_drawn * bool(others),
            traces=pairs,
            layout=layout(
                x=axis(f"predicted displacement [{shown}]", **scale),
                y=[axis(f"achieved displacement [{shown}]", **scale)],
                hovermode="closest",
            ),
            height=340,
            heading="Achieved against predicted",
        ),
        Plot(
            anchor="pulse-ratios",
            alternative=(
                "Achieved over predicted displacement, pulse by pulse through all runs; 1 is as "
                "predicted."
            ),
            caption="A controller that learns draws near 1."
            + " Dotted lines part the runs." * (len(runs) > 1),
            traces=ratios,
            layout=layout(
                x=axis(_BY_PULSE),
                y=[axis("achieved over predicted [-]", **wild)],
                hovermode="closest",
                shapes=_starts([len(run.pulses) for run in runs], first=0.5),
            ),
            height=340,
            heading="Pulse by pulse",
        ),
    ]


def estimate_plots(positioning: Positioning) -> list[Plot]:
    """Draw each estimate through all runs with the truth: over time, or from pulse to pulse.

    Where there are neither phases nor pulses, nothing is drawn.
    """
    runs = positioning.runs
    timed = runs[0].arm is not None or any(run.phases for run in runs)
    if not timed and not any(run.pulses for run in runs):
        return []
    drawn = _over_time if timed else _by_pulse
    names = [name for name in runs[0].estimates if name not in positioning.limits]
    return [drawn(name, positioning) for name in names]


def _by_pulse(name: str, positioning: Positioning) -> Plot:
    """Draw an estimate from pulse to pulse."""
    # A run begins with what the one before it ended with
    own = [run.estimates[name][min(k, 1) :] for k, run in enumerate(positioning.runs)]
    values = np.concatenate(own)
    pulses = np.arange(values.size, dtype=np.float64)
    trace = line(pulses, values, "estimate", Look(draw.BLUE))
    trace["line"]["shape"] = "hv"
    if values.size <= _FEW:
        trace |= {"mode": "lines+markers", "marker": {"color": draw.BLUE, "size": 5}}
    traces = [trace]
    truth = positioning.truth.get(name)
    if truth is not None:
        ends = [0.0, max(1.0, float(pulses[-1]))]
        traces.append(draw.level(ends, truth, "truth", _DASHED))
    unit, label = printed_unit(name, positioning.kind), parameter_label(name, positioning.kind)
    return Plot(
        anchor=f"estimate-{name.replace('_', '-')}",
        alternative=(
            f"{label} as estimated after each pulse, from {values[0]:.4g} to {values[-1]:.4g} "
            f"{unit}" + ("." if truth is None else f"; the truth is {truth:.4g}.")
        ),
        traces=traces,
        layout=layout(
            x=axis(_BY_PULSE),
            y=[axis(f"{draw.symbol(name)} [{unit}]")],
            shapes=_starts([each.size for each in own], first=-0.5),
        ),
        height=250,
        heading=label,
    )


def _over_time(name: str, positioning: Positioning) -> Plot:
    """Draw an estimate over time with its interval, and its distance from the truth."""
    runs = positioning.runs
    lengths = [float(run.time[-1]) for run in runs]
    begins = np.cumsum([0.0, *lengths[:-1]])
    time = np.concatenate([at + run.estimate_time for at, run in zip(begins, runs, strict=True)])
    end = max(float(begins[-1]) + shown_until(runs[-1]), float(time[0]) + 1e-9)
    values = np.concatenate([run.estimates[name] for run in runs])
    unknown = [np.full(run.estimate_time.size, np.nan) for run in runs]
    widths: Float[np.ndarray, " k"] = _NORMAL_95 * np.concatenate(
        [run.deviations.get(name, none) for run, none in zip(runs, unknown, strict=True)]
    )
    truth = positioning.truth.get(name)
    unit, label = printed_unit(name, positioning.kind), parameter_label(name, positioning.kind)
    traces = [
        *draw.band(time, values - widths, values + widths, name="95 % interval"),
        line(time, values, "estimate", Look(draw.BLUE, 2.0)),
    ]
    # How the estimate settles, not its first wild guesses
    later = slice(int(_SETTLED * values.size), None)
    known = values, (values - widths)[later], (values + widths)[later]
    settings = draw.range_of(*known, [] if truth is None else [truth], room=0.12)
    rows = [axis(f"{draw.symbol(name)} [{unit}]", **settings)]
    truth_text = ""
    if truth is not None:
        truth_text = f"; the true value is {truth:.4g} {unit}"
        least = _LEAST * max(abs(truth), 1.0)
        off, wide = (np.maximum(np.abs(each), least) for each in (values - truth, widths))
        traces += [
            draw.level(time, truth, "true value", _DASHED),
            line(time, wide, "half of the interval", Look(draw.SKY, dash="dot"), 2),
            line(time, off, "error of the estimate", Look(draw.VERMILION, 1.4), 2),
        ]
        rows.append(axis(f"error [{unit}]", type="log", nticks=5))
    shades = _phase_shades(runs[0]) if len(runs) == 1 else []
    return Plot(
        anchor=f"estimate-{name.replace('_', '-')}",
        alternative=(
            f"{label} as estimated over time, from {values[0]:.4g} to {values[-1]:.4g} {unit}"
            f"{truth_text}."
        ),
        traces=traces,
        layout=layout(
            x=axis(_TIME, range=[0.0, end]),
            y=rows,
            shapes=[*shades, *_starts(lengths, first=0.0)],
        ),
        height=360,
        heading=label,
    )


def arm_motion_plot(run: PositioningRun, arm: ArmRun, positioning: Positioning) -> Plot:
    """Draw both masses of a run, their distance from the target, and the effort."""
    kind, tolerance = positioning.kind, positioning.tolerance
    unit = unit_of("position", kind)
    factor, shown = prefixed_unit(float(np.max(np.abs(arm.position))), unit)
    time, end = run.time, shown_until(run)
    # The target is held from sample to sample as efforts are; the last sample has none of its own
    look = Look(draw.INK, 1.5, "dash")
    traces: list[Trace] = [draw.steps(time, factor * arm.target[:-1], "target", look)]
    ends: list[float] = []
    for name, position, look in _masses(arm):
        moments, error = _jumping(run, arm.target - position)
        distance = np.maximum(np.abs(error), _LEAST)
        ends.append(float(distance[-1]))
        traces.append(line(time, factor * position, name, look))
        traces.append(line(moments, distance, name, look, 2))
    look = Look(draw.GREEN, 1.4, "dash")
    traces.append(draw.level(time, tolerance, "tolerance", look, 2))
    traces.append(draw.steps(time, run.effort, "effort", Look(draw.GREY, 1.5), 3))
    lowest, highest = _BELOW * min(tolerance, max(ends)), 2.0 * float(np.max(np.abs(run.error)))
    decades = [math.log10(lowest), math.log10(highest)]
    return Plot(
        anchor=f"motion-{run.number}",
        alternative=(
            f"Run {run.number}: both masses, their distance from the target, and the effort over "
            f"{time[-1]:.3g} s. In the end mass 2 is {prefixed(ends[0], unit)} away from the "
            f"target, mass 1 {prefixed(ends[1], unit)}."
        ),
        caption=(
            "The upper panel shows the positions of both masses, the middle one their distance "
            "from the target in powers of ten, the lower one the effort."
            + _SHADED * bool(run.phases)
            + draw.thinned_text(run.time.size)
        ),
        traces=traces,
        layout=layout(
            x=axis(_TIME, range=[0.0, end]),
            y=[
                axis(f"position [{shown}]"),
                axis(f"distance [{unit}]", type="log", dtick=2, range=decades),
                axis(f"effort <i>u</i> [{printed_unit('effort', kind)}]"),
            ],
            **_phase_layout(run, end),
        ),
        height=640,
        also_in_legend=_phase_traces(run),
    )


def _masses(arm: ArmRun) -> list[tuple[str, Float[np.ndarray, " n"], Look]]:
    """Return name, true position and look of both masses, the first one last: it lies on top."""
    return [
        ("mass 2", arm.load_position, Look(draw.VERMILION, dash="dot")),
        ("mass 1", arm.position, Look(draw.BLUE, 2.2)),
    ]


def arm_end_plots(run: PositioningRun, arm: ArmRun, positioning: Positioning) -> list[Plot]:
    """Draw the end of each move about its target, magnified to show the remaining swing."""
    moves = [*run.moves[:_MOST_ENDS], *run.moves[_MOST_ENDS:][-1:]]
    return [_end_plot(run, arm, positioning, move) for move in moves]


def _end_plot(
    run: PositioningRun, arm: ArmRun, positioning: Positioning, move: PositioningMove
) -> Plot:
    unit = unit_of("position", positioning.kind)
    own = [each for each in arm.series if each.move == move.number]
    rest = move.start_time + _UNDER_WAY * (move.end_time - move.start_time)
    begin = min(own[-1].end_time if own else rest, rest)
    end = min(move.end_time, shown_until(run))
    if end <= begin:
        end = move.end_time
    there = (run.time >= begin) & (run.time <= end)
    time = run.time[there]
    sensed = not (
        np.array_equal(arm.position, arm.measured_position)
        and np.array_equal(arm.load_position, arm.measured_load_position)
    )
    measured = [
        ("mass 2, measured", arm.measured_load_position, Look(draw.PINK, 0.8)),
        ("mass 1, measured", arm.measured_position, Look(draw.PALE, 0.8)),
    ]
    errors = [
        (name, position[there] - move.target, look)
        for name, position, look in [*measured * sensed, *_masses(arm)]
    ]
    # The instant in which the last pulse ends may be far off still
    late = time >= begin + 0.1 * (end - begin)
    half = max(float(np.max(np.abs(error[late]))) for _, error, _ in errors)
    half = _ROOM * max(half, positioning.tolerance if sensed else _LEAST)
    factor, shown = prefixed_unit(half, unit)
    swing = "" if move.swing is None else f" Mass 2 swings by {prefixed(move.swing, unit)}."
    which = f"The end of move {move.number}" if len(run.moves) > 1 else "The end"
    return Plot(
        anchor=f"end-{run.number}-{move.number}",
        alternative=(
            f"Both masses about the target from {begin:.3g} s to {end:.3g} s, magnified.{swing}"
        ),
        traces=[
            _tolerance_band(time, factor * positioning.tolerance, 1),
            *(line(time, factor * error, name, look) for name, error, look in errors),
        ],
        layout=layout(
            x=axis(_TIME, range=[begin, end]),
            y=[axis(f"off target [{shown}]", range=[-factor * half, factor * half])],
        ),
        height=250,
        heading=f"{which}, magnified",
    )


def series_plots(run: PositioningRun, arm: ArmRun, positioning: Positioning) -> list[Plot]:
    """Draw the series of a run, the first and the last of many: as planned, and as it went."""
    every = list(enumerate(arm.series, start=1))
    if len(every) > _FIRST + _LAST:
        every = [*every[:_FIRST], *every[-_LAST:]]
    return [_series_plot(run, arm, positioning, k, series) for k, series in every]


def _series_plot(
    run: PositioningRun, arm: ArmRun, positioning: Positioning, k: int, series: ArmSeries
) -> Plot:
    unit = unit_of("position", positioning.kind)
    planned, end = series.time, series.end_time + _TAIL * series.duration
    there: Bool[np.ndarray, " n"] = (run.time > series.start_time - 0.5 * series.sampling_time) & (
        run.time <= end
    )
    time = run.time[there]
    factor, shown = prefixed_unit(float(np.max(np.abs(arm.position[there]))), unit)
    pairs = (
        ("mass 2", arm.load_position, series.load_position, draw.VERMILION),
        ("mass 1", arm.position, series.position, draw.BLUE),
    )
    missed = [np.interp(planned, run.time, true) - plan for _, true, plan, _ in pairs]
    apart = max(float(np.max(np.abs(each))) for each in missed)
    fine, fine_unit = prefixed_unit(apart, unit)
    traces: list[Trace] = []
    for (name, true, plan, colour), off in zip(pairs, missed, strict=True):
        traces += [
            line(time, factor * true[there], name, Look(colour, 2.6)),
            line(planned, factor * plan, "as planned", _DASHED),
            line(planned, fine * off, name, Look(colour), 2),
        ]
    look = Look(draw.GREY, 1.2, "dot")
    traces.append(draw.level(time, factor * series.target, "target of the series", look))
    held = np.append(run.time[: run.effort.size][there[:-1]], end)
    efforts = run.effort[there[:-1]]
    traces.append(draw.steps(held, efforts, "effort", Look(draw.GREY, 1.5), 3))
    return Plot(
        anchor=f"series-{run.number}-{k}",
        alternative=(
            f"Series {k}: both masses as planned and as they went, over {series.duration:.3g} s; "
            f"at most {fine * apart:.3g} {fine_unit} lie between the two."
        ),
        traces=traces,
        layout=layout(
            x=axis(_TIME),
            y=[
                axis(f"position [{shown}]"),
                axis(f"off plan [{fine_unit}]"),
                axis(f"effort [{printed_unit('effort', positioning.kind)}]"),
            ],
        ),
        height=500,
        heading=f"Series {k}",
    )
