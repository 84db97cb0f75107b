"""The figures of series of pulses: as planned, as they went, and what sets the two apart."""

import numpy as np

from stickslip.records import (
    ArmRun,
    ArmSeries,
    Positioning,
    PositioningRun,
    prefixed_unit,
    unit_of,
    unit_text,
)
from stickslip.report.drawing import BLUE, GREY, INK, VERMILION, Plot, Trace, axis, layout, line
from stickslip.report.positioning_figures import staircase

__all__ = ["series_plots"]

_FIRST, _LAST = 6, 4
"""Series of a long run that are drawn."""

_TAIL = 0.4
"""Share of a series' duration that is drawn after it."""


def series_plots(run: PositioningRun, arm: ArmRun, positioning: Positioning) -> list[Plot]:
    """Draw the series of a run, the first and the last of many: as planned, and as it went."""
    drawn = list(enumerate(arm.series, start=1))
    if len(drawn) > _FIRST + _LAST:
        drawn = [*drawn[:_FIRST], *drawn[-_LAST:]]
    return [_series_plot(run, arm, positioning, k, series) for k, series in drawn]


def _series_plot(
    run: PositioningRun, arm: ArmRun, positioning: Positioning, k: int, series: ArmSeries
) -> Plot:
    unit = unit_of("position", positioning.kind)
    planned, end = series.time, series.end_time + _TAIL * series.duration
    there = (run.time > series.start_time - 0.5 * series.sampling_time) & (run.time <= end)
    time = run.time[there]
    factor, shown = prefixed_unit(float(np.max(np.abs(arm.position[there]))), unit)
    pairs = (
        ("mass 2", arm.load_position, series.load_position, VERMILION),
        ("mass 1", arm.position, series.position, BLUE),
    )
    missed = [np.interp(planned, run.time, true) - plan for _, true, plan, _ in pairs]
    apart = max(float(np.max(np.abs(each))) for each in missed)
    fine, fine_unit = prefixed_unit(apart, unit)
    traces: list[Trace] = []
    for (name, true, plan, colour), off in zip(pairs, missed, strict=True):
        traces += [
            line(time, factor * true[there], name=name, colour=colour, width=2.6),
            line(planned, factor * plan, name="as planned", colour=INK, width=1.2, dash="dash"),
            line(planned, fine * off, name=name, colour=colour, width=1.8, row=2),
        ]
    ends = time[[0, -1]]
    traces.append(
        line(
            ends,
            np.full(2, factor * series.target),
            name="target of the series",
            colour=GREY,
            width=1.2,
            dash="dot",
        )
    )
    efforts = run.effort[there[:-1]]
    held = run.time[: run.effort.size][there[:-1]]
    traces.append(staircase(np.append(held, end), efforts, name="effort", colour=GREY, row=3))
    effort = unit_text(unit_of("effort", positioning.kind))
    return Plot(
        anchor=f"series-{run.number}-{k}",
        alternative=(
            f"Series {k}: both masses as planned and as they went, over {series.duration:.3g} s; "
            f"at most {fine * apart:.3g} {fine_unit} lie between the two."
        ),
        caption="",
        traces=traces,
        layout=layout(
            x=axis("time <i>t</i> [s]"),
            y=[
                axis(f"position [{shown}]"),
                axis(f"off plan [{fine_unit}]"),
                axis(f"effort [{effort}]"),
            ],
        ),
        height=500,
        heading=f"Series {k}",
    )
