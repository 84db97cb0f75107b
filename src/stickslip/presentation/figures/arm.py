"""The figures of a flexible arm: its motion, the end of each move, and its series of pulses."""

import math

import numpy as np
from jaxtyping import Float

from stickslip.presentation.figures import drawing as draw
from stickslip.presentation.figures.drawing import Look, Plot, Trace, axis, layout, line
from stickslip.presentation.figures.phases import (
    phase_layout,
    phase_traces,
    shown_until,
    tolerance_band,
)
from stickslip.presentation.words import prefixed, prefixed_unit, printed_unit
from stickslip.records import (
    ArmRun,
    ArmSeries,
    Positioning,
    PositioningMove,
    PositioningRun,
    unit_of,
)

__all__ = ["arm_end_plots", "arm_motion_plot", "series_plots"]

_LEAST = 1e-15
"""Distance that is drawn for none at all [m or rad]."""

_BELOW = 0.03
"""Lower end of the distances drawn, over the tolerance or what is left."""

_MOST_ENDS = 6
"""Moves whose end is drawn, and the last."""

_UNDER_WAY = 0.75
"""Share of a move after which it should have ended."""

_ROOM = 1.15

_FIRST, _LAST = 6, 4
"""Series of a long run that are drawn."""

_TAIL = 0.4
"""Share of a series' duration that is drawn after it."""

_Mass = tuple[str, Float[np.ndarray, " n"], Look]


def arm_motion_plot(run: PositioningRun, arm: ArmRun, positioning: Positioning) -> Plot:
    """Draw where both masses of a run are, how far from the target, and the effort."""
    kind, tolerance = positioning.kind, positioning.tolerance
    unit = unit_of("position", kind)
    factor, shown = prefixed_unit(float(np.max(np.abs(arm.position))), unit)
    time, end = run.time, shown_until(run)
    # The target is held from sample to sample as efforts are; the last sample has none of its own
    look = Look(draw.INK, 1.5, "dash")
    traces: list[Trace] = [draw.steps(time, factor * arm.target[:-1], "target", look)]
    ends: list[float] = []
    for name, position, look in _masses(arm):
        distance = np.maximum(np.abs(position - arm.target), _LEAST)
        ends.append(float(distance[-1]))
        traces.append(line(time, factor * position, name, look))
        traces.append(line(time, distance, name, look, 2))
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
            "Above, where both masses are; in the middle, how far from the target, in powers of "
            "ten; below, the effort."
            + (" Shaded are the phases, numbered as in the table below." if run.phases else "")
            + draw.thinned_text(run.time.size)
        ),
        traces=traces,
        layout=layout(
            x=axis("time <i>t</i> [s]", range=[0.0, end]),
            y=[
                axis(f"position [{shown}]"),
                axis(f"distance [{unit}]", type="log", dtick=2, range=decades),
                axis(f"effort <i>u</i> [{printed_unit('effort', kind)}]"),
            ],
            **phase_layout(run, end),
        ),
        height=640,
        also_in_legend=phase_traces(run),
    )


def _masses(arm: ArmRun, *, measured: bool = False) -> list[_Mass]:
    """Return name, position and look of both masses, the first one last: it lies on top."""
    if measured:
        return [
            ("mass 2, measured", arm.measured_load_position, Look(draw.PINK, 0.8)),
            ("mass 1, measured", arm.measured_position, Look(draw.PALE, 0.8)),
        ]
    look = Look(draw.VERMILION, dash="dot")
    return [
        ("mass 2", arm.load_position, look),
        ("mass 1", arm.position, Look(draw.BLUE, 2.2)),
    ]


def arm_end_plots(run: PositioningRun, arm: ArmRun, positioning: Positioning) -> list[Plot]:
    """Draw the end of each move, seen from its target and magnified: what swing is left."""
    return [
        _end_plot(run, arm, positioning, move)
        for move in [*run.moves[:_MOST_ENDS], *run.moves[_MOST_ENDS:][-1:]]
    ]


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
    shown_masses = [*(_masses(arm, measured=True) if sensed else []), *_masses(arm)]
    errors = [(name, position[there] - move.target, look) for name, position, look in shown_masses]
    # The instant in which the last pulse ends may be far off still
    late = time >= begin + 0.1 * (end - begin)
    half = max(float(np.max(np.abs(error[late]))) for _, error, _ in errors)
    half = _ROOM * max(half, positioning.tolerance if sensed else _LEAST)
    factor, shown = prefixed_unit(half, unit)
    traces = [tolerance_band(time, factor * positioning.tolerance, 1)]
    traces += [line(time, factor * error, name, look) for name, error, look in errors]
    swing = "" if move.swing is None else f" Mass 2 swings by {prefixed(move.swing, unit)}."
    return Plot(
        anchor=f"end-{run.number}-{move.number}",
        alternative=(
            f"Both masses about the target from {begin:.3g} s to {end:.3g} s, magnified.{swing}"
        ),
        traces=traces,
        layout=layout(
            x=axis("time <i>t</i> [s]", range=[begin, end]),
            y=[axis(f"off target [{shown}]", range=[-factor * half, factor * half])],
        ),
        height=250,
        heading=f"The end of move {move.number}, magnified"
        if len(run.moves) > 1
        else "The end, magnified",
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
    there = (run.time > series.start_time - 0.5 * series.sampling_time) & (run.time <= end)
    time = run.time[there]
    factor, shown = prefixed_unit(float(np.max(np.abs(arm.position[there]))), unit)
    pairs = (
        ("mass 2", arm.load_position, series.load_position, draw.VERMILION),
        ("mass 1", arm.position, series.position, draw.BLUE),
    )
    missed = [np.interp(planned, run.time, true) - plan for _, true, plan, _ in pairs]
    apart = max(float(np.max(np.abs(each))) for each in missed)
    fine, fine_unit = prefixed_unit(apart, unit)
    as_planned = Look(draw.INK, 1.2, "dash")
    traces: list[Trace] = []
    for (name, true, plan, colour), off in zip(pairs, missed, strict=True):
        traces += [
            line(time, factor * true[there], name, Look(colour, 2.6)),
            line(planned, factor * plan, "as planned", as_planned),
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
            x=axis("time <i>t</i> [s]"),
            y=[
                axis(f"position [{shown}]"),
                axis(f"off plan [{fine_unit}]"),
                axis(f"effort [{printed_unit('effort', positioning.kind)}]"),
            ],
        ),
        height=500,
        heading=f"Series {k}",
    )
