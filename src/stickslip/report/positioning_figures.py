"""The figures of a positioning task; what they draw was computed before."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from stickslip.records import (
    AxisKind,
    Positioning,
    PositioningRun,
    parameter_label,
    prefixed_unit,
    unit_of,
    unit_text,
)
from stickslip.report.drawing import (
    BAND,
    BLUE,
    GREY,
    INK,
    VERMILION,
    Plot,
    Trace,
    axis,
    layout,
    line,
    numbers,
    symbol,
    thin,
    thinned_text,
)
from stickslip.report.phase_figures import PHASE_MARGIN, phase_numbers, phase_shades

__all__ = [
    "estimate_plots",
    "motion_plot",
    "pulse_plots",
    "staircase",
    "starts",
    "tolerance_band",
    "zoom",
]

_MOST_PULSES = 3000
"""Markers in a drawing."""

_FEW = 60
"""Values up to which each is marked."""

_ZOOM = 4.0
"""Half-height of the magnified panel in tolerances, unless the axis ends farther away."""

_AFTER = 1.6
"""Time drawn over the time until the last motion."""

_WILD = 5.0
"""Largest over smallest ratio of displacements from which on they are drawn on logarithms."""

_ROOM = 1.15
_FRAME = "#9ca3af"


def motion_plot(run: PositioningRun, positioning: Positioning) -> Plot:
    """Draw the error of a run, once whole and once about the tolerance, and the effort."""
    kind, tolerance = positioning.kind, positioning.tolerance
    unit = unit_of("position", kind)
    largest = float(np.max(np.abs(run.error)))
    whole, whole_unit = prefixed_unit(largest, unit)
    half = zoom(run, tolerance)
    near, near_unit = prefixed_unit(half, unit)
    traces: list[Trace] = []
    sensed = not np.array_equal(run.measured_error, run.error)
    for row, factor in ((1, whole), (2, near)):
        traces.append(tolerance_band(run.time, factor * tolerance, row))
        if sensed:
            traces.append(
                line(
                    run.time,
                    factor * run.measured_error,
                    name="error, measured",
                    colour=GREY,
                    width=1.0,
                    row=row,
                )
            )
        traces.append(
            line(run.time, factor * run.error, name="error, true", colour=BLUE, width=2.0, row=row)
        )
    traces.append(staircase(run.time, run.effort, name="effort", colour=VERMILION, row=3))
    jumps = " At each new target the error jumps." if len(run.moves) > 1 else ""
    shaded = " Shaded are the phases, numbered as in the table below." if run.phases else ""
    end, whole_time = _shown_until(run), float(run.time[-1])
    still = (
        f" From {end:.3g} s to the end at {whole_time:.4g} s nothing changes."
        if end < whole_time
        else ""
    )
    return Plot(
        anchor=f"motion-{run.number}",
        alternative=(
            f"Run {run.number}: position error and effort over {run.time[-1]:.3g} s. The error "
            f"starts at {whole * run.error[0]:.3g} {whole_unit} and ends at "
            f"{near * run.error[-1]:.3g} {near_unit}."
        ),
        caption=(
            "Error is target less position; the shaded band is the tolerance. The panel in the "
            f"middle is the upper one, magnified about the target.{jumps}{still}{shaded}"
            + thinned_text(run.time.size)
        ),
        traces=traces,
        layout=layout(
            x=axis("time <i>t</i> [s]", range=[0.0, end]),
            y=[
                axis(f"error [{whole_unit}]"),
                axis(f"magnified [{near_unit}]", range=[-near * half, near * half]),
                axis(f"effort <i>u</i> [{unit_text(unit_of('effort', kind))}]"),
            ],
            shapes=phase_shades(run),
            annotations=phase_numbers(run, end),
            **({"margin": PHASE_MARGIN} if run.phases else {}),
        ),
        height=620,
    )


def _shown_until(run: PositioningRun) -> float:
    """Return the time up to which a run is drawn at first: without a long rest at its end."""
    whole = float(run.time[-1])
    error = run.error
    if len(run.moves) > 1:
        return whole
    moving = np.flatnonzero((error[1:] != error[:-1]) | (run.effort != 0.0))
    last = float(run.time[moving[-1] + 1]) if moving.size else 0.0
    return min(whole, float(f"{max(_AFTER * last, 0.05 * whole):.2g}"))


def zoom(run: PositioningRun, tolerance: float) -> float:
    """Return the half-height of the magnified panel: it shows how every move ends."""
    farthest = 0.0
    for move in run.moves:
        # The last quarter: of an axis that hunts a good part of a cycle
        begin = move.end_time - 0.25 * (move.end_time - move.start_time)
        late = (run.time > begin) & (run.time < move.end_time)
        if late.any():
            farthest = max(farthest, float(np.max(np.abs(run.error[late]))))
    return max(_ZOOM * tolerance, _ROOM * farthest)


def tolerance_band(time: Float[np.ndarray, " n"], half: float, row: int) -> Trace:
    """Shade the tolerance over the whole time."""
    ends = [float(time[0]), float(time[-1])]
    trace: Trace = {
        "type": "scatter",
        "mode": "lines",
        "name": "tolerance",
        "x": [*ends, *ends[::-1]],
        "y": [half, half, -half, -half],
        "fill": "toself",
        "fillcolor": BAND,
        "line": {"width": 0, "color": BAND},
        "hoverinfo": "skip",
    }
    if row > 1:
        trace["yaxis"] = f"y{row}"
    return trace


def staircase(
    time: Float[np.ndarray, " samples"],
    values: Float[np.ndarray, " efforts"],
    *,
    name: str,
    colour: str,
    row: int,
    dash: str = "solid",
) -> Trace:
    """Draw what is held from sample to sample, only where it changes if that is seldom."""
    held = np.append(values, values[-1:])
    changes: Int[np.ndarray, " c"] = np.flatnonzero(np.diff(held) != 0.0) + 1
    kept = np.unique(np.concatenate(([0], changes, [held.size - 1])))
    kept = kept[thin(held[kept])]
    trace: Trace = {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": numbers(time[kept]),
        "y": numbers(held[kept]),
        "line": {"color": colour, "width": 1.5, "shape": "hv", "dash": dash},
    }
    if row > 1:
        trace["yaxis"] = f"y{row}"
    return trace


def pulse_plots(positioning: Positioning) -> list[Plot]:
    """Draw what each pulse was to do against what it did, and how the two draw together."""
    every = [
        (run.number, k, pulse)
        for run in positioning.runs
        for k, pulse in enumerate(run.pulses, start=1)
    ]
    moved = [
        (number, k, count, pulse)
        for count, (number, k, pulse) in enumerate(every, start=1)
        if pulse.moved and pulse.achieved_displacement * pulse.predicted_displacement > 0
    ]
    if len(moved) < 2:
        return []
    others = len(every) - len(moved)
    moved = moved[:: -(-len(moved) // _MOST_PULSES)]
    unit = unit_of("position", positioning.kind)
    sizes = [abs(p.predicted_displacement) for *_, p in moved]
    sizes += [abs(p.achieved_displacement) for *_, p in moved]
    factor, shown = prefixed_unit(max(sizes), unit)
    ends = np.array([min(sizes) / 1.5, max(sizes) * 1.5]) * factor
    scale = _LOGARITHMS if max(sizes) > _WILD * min(sizes) else {"rangemode": "tozero"}
    pairs: list[Trace] = [
        line(ends, ends, name="as predicted", colour=INK, dash="dash", width=1.2),
    ]
    ratios: list[Trace] = [
        line(
            np.array([1.0, max(2.0, len(every))]),
            np.ones(2),
            name="as predicted",
            colour=INK,
            dash="dash",
            width=1.2,
        )
    ]
    for direction, name, colour, mark in (
        (1, "forward pulse", BLUE, "circle"),
        (-1, "backward pulse", VERMILION, "diamond"),
    ):
        there = [each for each in moved if each[3].predicted_displacement * direction > 0]
        if not there:
            continue
        predicted = np.array([abs(p.predicted_displacement) for *_, p in there])
        achieved = np.array([abs(p.achieved_displacement) for *_, p in there])
        labels = [f"run {number}, pulse {k}" for number, k, _, _ in there]
        look = {"color": colour, "size": 7, "opacity": 0.7, "symbol": mark}
        common: Trace = {"type": "scatter", "mode": "markers", "name": name, "text": labels}
        pairs.append(
            {
                **common,
                "x": numbers(factor * predicted),
                "y": numbers(factor * achieved),
                "marker": look,
            }
        )
        ratios.append(
            {
                **common,
                "x": [count for *_, count, _ in there],
                "y": numbers(achieved / predicted),
                "marker": look,
            }
        )
    spread = [abs(p.achieved_displacement / p.predicted_displacement) for *_, p in moved]
    wild = max(spread) > _WILD * min(spread)
    not_drawn = (
        f" {others} of {len(every)} pulses moved nothing or went the other way and are not drawn."
        if others
        else ""
    )
    return [
        Plot(
            anchor="pulse-pairs",
            alternative=(
                f"Achieved against predicted displacement of {len(every)} pulses, from "
                f"{ends[0]:.2g} to {ends[1]:.2g} {shown}."
            ),
            caption="Points on the line went as far as the controller expected." + not_drawn,
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
            caption="A controller that learns draws near 1. " + _STARTS_TEXT
            if len(positioning.runs) > 1
            else "A controller that learns draws near 1.",
            traces=ratios,
            layout=layout(
                x=axis("pulse, all runs on end [-]"),
                y=[
                    axis("achieved over predicted [-]", **_LOGARITHMS)
                    if wild
                    else axis("achieved over predicted [-]", rangemode="tozero")
                ],
                hovermode="closest",
                shapes=starts([len(run.pulses) for run in positioning.runs], first=0.5),
            ),
            height=340,
            heading="Pulse by pulse",
        ),
    ]


_LOGARITHMS = {"type": "log", "dtick": 1, "exponentformat": "none"}
_STARTS_TEXT = "Dotted lines part the runs."


def starts(lengths: Sequence[float] | Sequence[int], *, first: float) -> list[dict[str, object]]:
    """Return a dotted line where each run but the first begins."""
    begins = np.cumsum([0, *lengths[:-1]])[1:] + first
    return [
        {
            "type": "line",
            "xref": "x",
            "yref": "paper",
            "x0": float(x),
            "x1": float(x),
            "y0": 0,
            "y1": 1,
            "line": {"color": _FRAME, "width": 1, "dash": "dot"},
        }
        for x in begins
    ]


def estimate_plots(positioning: Positioning) -> list[Plot]:
    """Draw how each estimate goes from pulse to pulse, through all runs, with the truth."""
    kind: AxisKind = positioning.kind
    runs = positioning.runs
    plots: list[Plot] = []
    for name in runs[0].estimates:
        if name in positioning.limits:
            continue
        # A run begins with what the one before it ended with
        own = [run.estimates[name][min(k, 1) :] for k, run in enumerate(runs)]
        values = np.concatenate(own)
        pulses = np.arange(values.size, dtype=np.float64)
        marked = values.size <= _FEW
        kept = thin(values)
        traces: list[Trace] = [
            {
                "type": "scatter",
                "mode": "lines+markers" if marked else "lines",
                "name": "estimate",
                "x": numbers(pulses[kept]),
                "y": numbers(values[kept]),
                "line": {"color": BLUE, "width": 1.8, "shape": "hv"},
                "marker": {"color": BLUE, "size": 5},
            }
        ]
        true_value = positioning.truth.get(name)
        if true_value is not None:
            ends = np.array([0.0, max(1.0, pulses[-1])])
            traces.append(
                line(
                    ends,
                    np.full(2, true_value),
                    name="truth",
                    colour=INK,
                    dash="dash",
                    width=1.2,
                )
            )
        unit = unit_text(unit_of(name, kind))
        plots.append(
            Plot(
                anchor=f"estimate-{name.replace('_', '-')}",
                alternative=(
                    f"{parameter_label(name, kind)} as estimated after each pulse, from "
                    f"{values[0]:.4g} to {values[-1]:.4g} {unit}"
                    + ("." if true_value is None else f"; the truth is {true_value:.4g}.")
                ),
                caption="",
                traces=traces,
                layout=layout(
                    x=axis("pulse, all runs on end [-]"),
                    y=[axis(f"{symbol(name)} [{unit}]")],
                    shapes=starts([each.size for each in own], first=-0.5),
                ),
                height=250,
                heading=parameter_label(name, kind),
            )
        )
    return plots
