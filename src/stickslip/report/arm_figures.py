"""The figures of a positioning task on a flexible arm; what they draw was computed before."""

import math
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.records import (
    ArmRun,
    Positioning,
    PositioningMove,
    PositioningRun,
    prefixed,
    prefixed_unit,
    unit_of,
    unit_text,
)
from stickslip.report.drawing import (
    BLUE,
    GREEN,
    GREY,
    INK,
    PALE,
    PINK,
    VERMILION,
    Plot,
    Trace,
    axis,
    layout,
    line,
    thinned_text,
)
from stickslip.report.phase_figures import PHASE_MARGIN, phase_numbers, phase_shades, shown_until
from stickslip.report.positioning_figures import staircase, tolerance_band

__all__ = [
    "arm_end_plots",
    "arm_motion_plot",
]

_LEAST = 1e-15
"""Distance that is drawn for none at all [m or rad]."""

_BELOW = 0.03
"""Lower end of the distances drawn, over the tolerance or what is left."""

_MOST_ENDS = 6
"""Moves whose end is drawn, and the last."""

_UNDER_WAY = 0.75
"""Share of a move after which it should have ended."""

_ROOM = 1.15


def arm_motion_plot(run: PositioningRun, arm: ArmRun, positioning: Positioning) -> Plot:
    """Draw where both masses of a run are, how far from the target, and the effort."""
    kind = positioning.kind
    unit = unit_of("position", kind)
    factor, shown = prefixed_unit(float(np.max(np.abs(arm.position))), unit)
    time, end = run.time, shown_until(run)
    # The target is held from sample to sample as efforts are; the last sample has none of its own
    traces: list[Trace] = [
        staircase(time, factor * arm.target[:-1], name="target", colour=INK, row=1, dash="dash"),
    ]
    ends: list[float] = []
    for name, position, look in _masses(arm):
        distance = np.maximum(np.abs(position - arm.target), _LEAST)
        ends.append(float(distance[-1]))
        traces.append(line(time, factor * position, name=name, **look))
        traces.append(line(time, distance, name=name, row=2, **look))
    tolerance = np.full(2, positioning.tolerance)
    traces += [
        line(
            time[[0, -1]], tolerance, name="tolerance", colour=GREEN, width=1.4, dash="dash", row=2
        ),
        staircase(time, run.effort, name="effort", colour=GREY, row=3),
    ]
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
            + thinned_text(run.time.size)
        ),
        traces=traces,
        layout=layout(
            x=axis("time <i>t</i> [s]", range=[0.0, end]),
            y=[
                axis(f"position [{shown}]"),
                axis(
                    f"distance [{unit}]",
                    type="log",
                    dtick=2,
                    range=[
                        math.log10(_BELOW * min(positioning.tolerance, max(ends))),
                        math.log10(2.0 * float(np.max(np.abs(run.error)))),
                    ],
                ),
                axis(f"effort <i>u</i> [{unit_text(unit_of('effort', kind))}]"),
            ],
            shapes=phase_shades(run),
            annotations=phase_numbers(run, end),
            margin=PHASE_MARGIN,
        ),
        height=640,
    )


def _masses(
    arm: ArmRun, *, measured: bool = False
) -> list[tuple[str, Float[np.ndarray, " n"], dict[str, Any]]]:
    """Return name, position and look of both masses, the first one last: it lies on top."""
    if measured:
        return [
            ("mass 2, measured", arm.measured_load_position, {"colour": PINK, "width": 0.8}),
            ("mass 1, measured", arm.measured_position, {"colour": PALE, "width": 0.8}),
        ]
    return [
        ("mass 2", arm.load_position, {"colour": VERMILION, "width": 1.8, "dash": "dot"}),
        ("mass 1", arm.position, {"colour": BLUE, "width": 2.2}),
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
    drawn = [*(_masses(arm, measured=True) if sensed else []), *_masses(arm)]
    errors = [(name, position[there] - move.target, look) for name, position, look in drawn]
    # The instant in which the last pulse ends may be far off still
    late = time >= begin + 0.1 * (end - begin)
    half = max(float(np.max(np.abs(error[late]))) for _, error, _ in errors)
    half = _ROOM * max(half, positioning.tolerance if sensed else _LEAST)
    factor, shown = prefixed_unit(half, unit)
    traces = [tolerance_band(time, factor * positioning.tolerance, 1)]
    traces += [line(time, factor * error, name=name, **look) for name, error, look in errors]
    swing = "" if move.swing is None else f" Mass 2 swings by {prefixed(move.swing, unit)}."
    return Plot(
        anchor=f"end-{run.number}-{move.number}",
        alternative=(
            f"Both masses about the target from {begin:.3g} s to {end:.3g} s, magnified.{swing}"
        ),
        caption="",
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
