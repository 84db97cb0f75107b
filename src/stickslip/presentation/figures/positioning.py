"""The figures of a positioning task; what they draw was computed before."""

import numpy as np
from jaxtyping import Float

from stickslip.presentation.figures import drawing as draw
from stickslip.presentation.figures.drawing import Look, Plot, axis, layout, line
from stickslip.presentation.figures.phases import (
    phase_layout,
    phase_shades,
    phase_traces,
    shown_until,
    starts,
    tolerance_band,
)
from stickslip.presentation.words import prefixed_unit, printed_unit
from stickslip.records import (
    Positioning,
    PositioningRun,
    parameter_label,
    unit_of,
)

__all__ = ["estimate_plots", "motion_plot", "pulse_plots"]

_MOST_PULSES = 3000
"""Markers in a figure."""

_FEW = 60
"""Values up to which each is marked."""

_ZOOM = 4.0
"""Half-height of the magnified panel in tolerances, unless the axis ends farther away."""

_AFTER = 1.6
"""Time drawn over the time until the last motion."""

_WILD = 5.0
"""Largest over smallest ratio of displacements from which on they are drawn on logarithms."""

_ROOM = 1.15
_LOGARITHMS = {"type": "log", "dtick": 1, "exponentformat": "none"}
_LEAST = 1e-15
"""Error that is drawn for none at all, over the value."""

_NORMAL_95 = 1.96
_SETTLED = 0.25  # of the time, at whose end an estimate is taken for settled


def motion_plot(run: PositioningRun, positioning: Positioning) -> Plot:
    """Draw the error of a run, once whole and once about the tolerance, and the effort."""
    kind, tolerance = positioning.kind, positioning.tolerance
    unit = unit_of("position", kind)
    whole, whole_unit = prefixed_unit(float(np.max(np.abs(run.error))), unit)
    half = _zoom(run, tolerance)
    near, near_unit = prefixed_unit(half, unit)
    lines = [("error, true", run.error, Look(draw.BLUE, 2.0))]
    if not np.array_equal(run.measured_error, run.error):
        lines.insert(0, ("error, measured", run.measured_error, Look(draw.GREY, 1.0)))
    traces: list[draw.Trace] = []
    for row, factor in ((1, whole), (2, near)):
        traces.append(tolerance_band(run.time, factor * tolerance, row))
        traces += [line(run.time, factor * values, name, look, row) for name, values, look in lines]
    traces.append(draw.steps(run.time, run.effort, "effort", Look(draw.VERMILION, 1.5), 3))
    end, last = _shown_until(run), float(run.time[-1])
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
            + (" Shaded are the phases, numbered as in the table below." if run.phases else "")
            + draw.thinned_text(run.time.size)
        ),
        traces=traces,
        layout=layout(
            x=axis("time <i>t</i> [s]", range=[0.0, end]),
            y=[
                axis(f"error [{whole_unit}]"),
                axis(f"magnified [{near_unit}]", range=[-near * half, near * half]),
                axis(f"effort <i>u</i> [{printed_unit('effort', kind)}]"),
            ],
            **phase_layout(run, end),
        ),
        height=620,
        also_in_legend=phase_traces(run),
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
    """Draw what each pulse was to do against what it did, and how the two draw together."""
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
    expected = "as predicted", Look(draw.INK, 1.2, "dash")
    pairs = [line(ends, ends, *expected)]
    ratios = [draw.level([1.0, float(max(2, len(every)))], 1.0, *expected)]
    for direction, name, colour, mark in (
        (1, "forward pulse", draw.BLUE, "circle"),
        (-1, "backward pulse", draw.VERMILION, "diamond"),
    ):
        there = [each for each in moved if each[2] * direction > 0]
        if not there:
            continue
        predicted, achieved = np.abs(np.array([each[2:] for each in there])).T
        look = {"color": colour, "size": 7, "opacity": 0.7, "symbol": mark}
        texts = [each[0] for each in there]
        pairs.append(draw.markers(factor * predicted, factor * achieved, name, look, text=texts))
        ratios.append(
            draw.markers(
                [float(each[1]) for each in there], achieved / predicted, name, look, text=texts
            )
        )
    scale = _LOGARITHMS if max(sizes) > _WILD * min(sizes) else {"rangemode": "tozero"}
    spread = [achieved / predicted for *_, predicted, achieved in moved]
    wild = _LOGARITHMS if max(spread) > _WILD * min(spread) else {"rangemode": "tozero"}
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
                x=axis("pulse, over all runs [-]"),
                y=[axis("achieved over predicted [-]", **wild)],
                hovermode="closest",
                shapes=starts([len(run.pulses) for run in runs], first=0.5),
            ),
            height=340,
            heading="Pulse by pulse",
        ),
    ]


def estimate_plots(positioning: Positioning) -> list[Plot]:
    """Draw each estimate through all runs with the truth: over time, or from pulse to pulse."""
    runs = positioning.runs
    timed = runs[0].arm is not None or any(run.phases for run in runs)
    drawn = _over_time if timed else _by_pulse
    names = [name for name in runs[0].estimates if name not in positioning.limits]
    return [drawn(name, positioning) for name in names]


def _by_pulse(name: str, positioning: Positioning) -> Plot:
    """Draw how an estimate goes from pulse to pulse."""
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
        traces.append(draw.level(ends, truth, "truth", Look(draw.INK, 1.2, "dash")))
    unit, label = printed_unit(name, positioning.kind), parameter_label(name, positioning.kind)
    return Plot(
        anchor=f"estimate-{name.replace('_', '-')}",
        alternative=(
            f"{label} as estimated after each pulse, from {values[0]:.4g} to {values[-1]:.4g} "
            f"{unit}" + ("." if truth is None else f"; the truth is {truth:.4g}.")
        ),
        traces=traces,
        layout=layout(
            x=axis("pulse, over all runs [-]"),
            y=[axis(f"{draw.symbol(name)} [{unit}]")],
            shapes=starts([each.size for each in own], first=-0.5),
        ),
        height=250,
        heading=label,
    )


def _over_time(name: str, positioning: Positioning) -> Plot:
    """Draw an estimate over time with its interval, and how far it is from the truth."""
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
    said = "."
    if truth is not None:
        said = f"; the true value is {truth:.4g} {unit}."
        least = _LEAST * max(abs(truth), 1.0)
        off, wide = (np.maximum(np.abs(each), least) for each in (values - truth, widths))
        traces += [
            draw.level(time, truth, "true value", Look(draw.INK, 1.2, "dash")),
            line(time, wide, "half of the interval", Look(draw.SKY, dash="dot"), 2),
            line(time, off, "error of the estimate", Look(draw.VERMILION, 1.4), 2),
        ]
        rows.append(axis(f"error [{unit}]", type="log", nticks=5))
    shades = phase_shades(runs[0]) if len(runs) == 1 else []
    return Plot(
        anchor=f"estimate-{name.replace('_', '-')}",
        alternative=(
            f"{label} as estimated over time, from {values[0]:.4g} to {values[-1]:.4g} {unit}{said}"
        ),
        traces=traces,
        layout=layout(
            x=axis("time <i>t</i> [s]", range=[0.0, end]),
            y=rows,
            shapes=[*shades, *starts(lengths, first=0.0)],
        ),
        height=360,
        heading=label,
    )
