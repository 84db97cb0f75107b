"""The figures of a positioning task on a flexible arm; what they draw was computed before."""

import math
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.records import (
    ArmRun,
    LandingPhaseName,
    Positioning,
    PositioningMove,
    PositioningRun,
    parameter_label,
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
    SKY,
    VERMILION,
    Plot,
    Trace,
    axis,
    band,
    layout,
    line,
    symbol,
    thinned_text,
)
from stickslip.report.positioning_figures import staircase, starts, tolerance_band

__all__ = [
    "PHASE_COLOURS",
    "arm_end_plots",
    "arm_estimate_plots",
    "arm_motion_plot",
    "phase_traces",
    "shown_until",
]

PHASE_COLOURS: dict[LandingPhaseName, str] = {
    "feedback": "#d6e6f5",
    "resting": "#eceff2",
    "series": "#fce3bd",
    "pulses": "#fce3bd",
    "done": "#d3eddf",
    "stopped": "#f6d3c4",
}
"""Pale enough to lie behind curves; phases are numbered too."""

_AFTER = 1.15
"""Time drawn over the time until the controller has ended."""

_NARROW = 0.012
"""Share of the time that a phase takes at least to have its number above it."""

_LEAST = 1e-15
"""Distance that is drawn for none at all [m or rad]."""

_BELOW = 0.03
"""Lower end of the distances drawn, over the tolerance or what is left."""

_MOST_ENDS = 6
"""Moves whose end is drawn, and the last."""

_UNDER_WAY = 0.75
"""Share of a move after which it should have ended."""

_ROOM = 1.15
_NORMAL_95 = 1.96
_SETTLED = 0.25  # of the time, at whose end an estimate is taken for settled


def shown_until(run: PositioningRun) -> float:
    """Return the time up to which a run is drawn at first: without a long rest at its end."""
    whole = float(run.time[-1])
    phases = () if run.arm is None else run.arm.phases
    if len(run.moves) > 1 or not phases or phases[-1].name not in {"done", "stopped"}:
        return whole
    return min(whole, _AFTER * phases[-1].start_time)


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
            + (" Shaded are the phases, numbered as in the table below." if arm.phases else "")
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
            shapes=_shades(arm),
            annotations=_numbers(arm, end),
            margin={"l": 56, "r": 14, "t": 22, "b": 44},  # the numbers stand above
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


def phase_traces(arm: ArmRun) -> list[Trace]:
    """Return what the key shows of the phases: their colours, each once."""
    words: dict[LandingPhaseName, str] = {each.name: each.word.lower() for each in arm.phases}
    return [
        {"name": word, "fill": "toself", "fillcolor": PHASE_COLOURS[name]}
        for name, word in words.items()
    ]


def _shades(arm: ArmRun) -> list[dict[str, object]]:
    return [
        {
            "type": "rect",
            "layer": "below",
            "xref": "x",
            "yref": "paper",
            "x0": phase.start_time,
            "x1": phase.end_time,
            "y0": 0,
            "y1": 1,
            "fillcolor": PHASE_COLOURS[phase.name],
            "line": {"width": 0},
        }
        for phase in arm.phases
    ]


def _numbers(arm: ArmRun, end: float) -> list[dict[str, object]]:
    return [
        {
            "text": str(k),
            "showarrow": False,
            "xref": "x",
            "yref": "paper",
            "x": 0.5 * (phase.start_time + min(phase.end_time, end)),
            "y": 1,
            "yanchor": "bottom",
            "font": {"size": 11, "color": GREY},
        }
        for k, phase in enumerate(arm.phases, start=1)
        if min(phase.end_time, end) - phase.start_time > _NARROW * end
    ]


def arm_estimate_plots(positioning: Positioning) -> list[Plot]:
    """Draw each estimate over time, through all runs, with its interval and the truth."""
    runs = positioning.runs
    begins = np.cumsum([0.0, *(float(run.time[-1]) for run in runs)])
    time = np.concatenate(
        [begin + run.estimate_time for begin, run in zip(begins, runs, strict=False)]
    )
    end = max(float(begins[-2]) + shown_until(runs[-1]), float(time[0]) + 1e-9)
    plots: list[Plot] = []
    for name in runs[0].estimates:
        values = np.concatenate([run.estimates[name] for run in runs])
        widths = _NORMAL_95 * np.concatenate(
            [
                np.full(run.estimate_time.size, np.nan)
                if run.arm is None or name not in run.arm.deviations
                else run.arm.deviations[name]
                for run in runs
            ]
        )
        plots.append(
            _estimate_plot(
                name,
                (time, values, widths),
                positioning,
                end=end,
                shapes=[
                    *(_shades(runs[0].arm) if len(runs) == 1 and runs[0].arm else []),
                    *starts([float(run.time[-1]) for run in runs], first=0.0),
                ],
            )
        )
    return plots


def _estimate_plot(
    name: str,
    known: tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"], Float[np.ndarray, " k"]],
    positioning: Positioning,
    *,
    end: float,
    shapes: list[dict[str, object]],
) -> Plot:
    """Draw an estimate with its interval and the truth, and how far it is from the truth."""
    time, values, widths = known
    truth = positioning.truth.get(name)
    unit = unit_text(unit_of(name, positioning.kind))
    traces = [
        *band(time, values - widths, values + widths, name="95 % interval"),
        line(time, values, name="estimate", colour=BLUE, width=2.0),
    ]
    rows = [axis(f"{symbol(name)} [{unit}]", **_range(values, widths, truth))]
    said = "."
    if truth is not None:
        said = f"; the true value is {truth:.4g} {unit}."
        ends = np.full(2, truth)
        true = line(time[[0, -1]], ends, name="true value", colour=INK, dash="dash", width=1.2)
        least = _LEAST * max(abs(truth), 1.0)
        off, wide = (np.maximum(np.abs(each), least) for each in (values - truth, widths))
        traces += [
            true,
            line(time, wide, name="half of the interval", colour=SKY, dash="dot", row=2),
            line(time, off, name="error of the estimate", colour=VERMILION, width=1.4, row=2),
        ]
        rows.append(axis(f"error [{unit}]", type="log", nticks=5))
    return Plot(
        anchor=f"estimate-{name.replace('_', '-')}",
        alternative=(
            f"{parameter_label(name)} as estimated over time, from {values[0]:.4g} to "
            f"{values[-1]:.4g} {unit}{said}"
        ),
        caption="",
        traces=traces,
        layout=layout(x=axis("time <i>t</i> [s]", range=[0.0, end]), y=rows, shapes=shapes),
        height=360,
        heading=parameter_label(name),
    )


def _range(values: np.ndarray, widths: np.ndarray, truth: float | None) -> dict[str, list[float]]:
    """Choose a vertical range that shows how the estimate settles, not its first wild guesses."""
    later = slice(int(_SETTLED * values.size), None)
    shown = np.concatenate(
        [
            values,
            (values - widths)[later],
            (values + widths)[later],
            [] if truth is None else [truth],
        ]
    )
    shown = shown[np.isfinite(shown)]
    low, high = float(np.min(shown)), float(np.max(shown))
    margin = 0.12 * (high - low) or 0.05 * abs(high) or 1.0
    return {"range": [low - margin, high + margin]}
