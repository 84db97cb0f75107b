"""The figures of estimates over time: with their interval, the truth, and the phases behind."""

import numpy as np
from jaxtyping import Float

from stickslip.records import Positioning, parameter_label, unit_of, unit_text
from stickslip.report.drawing import (
    BLUE,
    INK,
    SKY,
    VERMILION,
    Plot,
    axis,
    band,
    layout,
    line,
    symbol,
)
from stickslip.report.phase_figures import phase_shades, shown_until
from stickslip.report.positioning_figures import starts

__all__ = ["timed_estimate_plots"]

_LEAST = 1e-15
"""Error that is drawn for none at all, over the value."""

_NORMAL_95 = 1.96
_SETTLED = 0.25  # of the time, at whose end an estimate is taken for settled


def timed_estimate_plots(positioning: Positioning) -> list[Plot]:
    """Draw each estimate over time, through all runs, with its interval and the truth."""
    runs = positioning.runs
    begins = np.cumsum([0.0, *(float(run.time[-1]) for run in runs)])
    time = np.concatenate(
        [begin + run.estimate_time for begin, run in zip(begins, runs, strict=False)]
    )
    end = max(float(begins[-2]) + shown_until(runs[-1]), float(time[0]) + 1e-9)
    plots: list[Plot] = []
    for name in runs[0].estimates:
        if name in positioning.limits:
            continue
        values = np.concatenate([run.estimates[name] for run in runs])
        widths = _NORMAL_95 * np.concatenate(
            [run.deviations.get(name, np.full(run.estimate_time.size, np.nan)) for run in runs]
        )
        plots.append(
            _estimate_plot(
                name,
                (time, values, widths),
                positioning,
                end=end,
                shapes=[
                    *(phase_shades(runs[0]) if len(runs) == 1 else []),
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
            f"{parameter_label(name, positioning.kind)} as estimated over time, from "
            f"{values[0]:.4g} to {values[-1]:.4g} {unit}{said}"
        ),
        caption="",
        traces=traces,
        layout=layout(x=axis("time <i>t</i> [s]", range=[0.0, end]), y=rows, shapes=shapes),
        height=360,
        heading=parameter_label(name, positioning.kind),
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
