"""The figures of estimators side by side; what they draw was computed before."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stickslip.presentation.figures import drawing as draw
from stickslip.presentation.figures.drawing import Look, Plot, Trace, axis, axis_title, layout, line
from stickslip.presentation.words import printed_unit
from stickslip.records import (
    AxisKind,
    EstimatorComparison,
    EstimatorStudy,
    parameter_label,
)

__all__ = ["estimate_plots", "motion_plots", "score_plots"]

_ROW = 26  # px an estimator
_FRAME = 90  # px around them
_MARGIN = 0.15  # of what is drawn, on either side
_FAR = 4.0
"""Widths of the middle half of the values beyond which one is stated and not drawn."""


class _Bar(NamedTuple):
    """A value with what it may be off by."""

    name: str
    value: float
    low: float
    high: float
    good: bool


def estimate_plots(found: EstimatorComparison) -> list[Plot]:
    """Draw each parameter as every estimator found it, with its 95 % interval."""
    plots: list[Plot] = []
    kind = found.log.kind
    for name in found.parameters:
        bars = [
            _Bar(
                each.name,
                parameter.value,
                *(parameter.ci95 or (parameter.value, parameter.value)),
                each.estimate.status.trusted,
            )
            for each in found.applied
            if each.estimate is not None
            and (parameter := each.estimate.parameters.get(name)) is not None
            and parameter.value is not None
        ]
        title = f"{draw.symbol(name)} [{printed_unit(name, kind)}]"
        plots.append(_bars(name, kind, bars, names=("trusted", "not to be trusted"), title=title))
    return plots


def score_plots(study: EstimatorStudy) -> list[Plot]:
    """Draw the mean error of each parameter, and the standard deviation of a run around it."""
    plots: list[Plot] = []
    for name in study.parameters:
        truth = study.truth.get(name, 0.0)
        size = 100.0 / abs(truth) if truth else 1.0
        bars: list[_Bar] = []
        for each in study.applied:
            score = each.scores.get(name)
            if score is None:
                continue
            variance = max(score.rmse**2 - score.bias**2, 0.0)
            bias, reach = score.bias * size, variance**0.5 * size
            # What several standard errors of the mean do not explain is a bias
            good = score.bias**2 <= 9.0 * variance / max(score.runs, 1)
            bars.append(_Bar(each.name, bias, bias - reach, bias + reach, good))
        unit = "% of the truth" if truth else printed_unit(name, study.kind)
        names = ("no bias to be seen", "biased by more than three standard errors")
        title = f"error of {draw.symbol(name)} [{unit}]"
        plots.append(_bars(name, study.kind, bars, names=names, title=title, truth=0.0))
    return plots


def _bars(
    name: str,
    kind: AxisKind,
    bars: Sequence[_Bar],
    *,
    names: tuple[str, str],
    title: str,
    truth: float | None = None,
) -> Plot:
    """Draw values one below the other; values far off are given as text."""
    label = parameter_label(name, kind)
    quarter, middle, three = np.percentile([bar.value for bar in bars], [25, 50, 75])
    widths = [bar.high - bar.low for bar in bars if bar.high > bar.low]
    typical = float(np.median(widths)) if widths else 0.0
    reach = _FAR * max(float(three - quarter), typical, 1e-3 * abs(middle))
    shown = [bar for bar in bars if abs(bar.value - middle) <= reach]
    far = [f"{bar.name} at {bar.value:.3g}" for bar in bars if bar not in shown]
    traces: list[Trace] = []
    for good, words, colour, sign in (
        (True, names[0], draw.BLUE, "circle"),
        (False, names[1], draw.VERMILION, "x"),
    ):
        some = [bar for bar in shown if bar.good is good]
        if some:
            values, low, high = (
                np.array([getattr(bar, key) for bar in some]) for key in ("value", "low", "high")
            )
            traces.append(
                draw.markers(
                    values,
                    [bar.name for bar in some],
                    name=words,
                    look={"color": colour, "size": 8, "symbol": sign},
                    error_x=draw.bars_across(values, low, high, colour),
                )
            )
    low = max(min(bar.low for bar in shown), middle - reach)
    high = min(max(bar.high for bar in shown), middle + reach)
    shapes: list[dict[str, object]] = []
    if truth is not None:
        low, high = min(low, truth), max(high, truth)
        shapes.append(draw.vertical(truth, dash="dash", width=1.2, colour=draw.GREY))
    margin = _MARGIN * (high - low) or 0.05 * abs(high) or 1.0
    order = [bar.name for bar in bars][::-1]
    said = ", ".join(f"{bar.name} {bar.value:.4g}" for bar in bars)
    return Plot(
        anchor=f"estimates-{name.replace('_', '-')}",
        alternative=f"{label} by estimator: {said}.",
        caption=f"Out of the picture: {', '.join(far)}." if far else "",
        traces=traces,
        layout=layout(
            x=axis(title, range=[low - margin, high + margin]),
            y=[axis("", type="category", categoryorder="array", categoryarray=order)],
            hovermode="closest",
            shapes=shapes,
        ),
        height=_FRAME + _ROW * len(bars),
        heading=label,
    )


def motion_plots(found: EstimatorComparison) -> list[Plot]:
    """Draw what each identified axis misses of the measured position, all at one scale."""
    errors = [
        (each, again, again.simulated_position - again.measured_position)
        for each in found.applied
        if (again := each.resimulation) is not None
    ]
    if not errors:
        return []
    typical = [float(np.percentile(np.abs(error), 99.0)) for *_, error in errors]
    scale = 1.2 * min(max(typical), _FAR * float(np.median(typical))) or 1.0
    across = axis(axis_title("position", found.log.kind), range=[-scale, scale])
    return [
        Plot(
            anchor=f"motion-{each.name}",
            alternative=(
                f"Simulated less measured position over time with the law that {each.name} "
                f"found; it explains {again.fit:.2%} of the position."
            ),
            caption=f"explains {again.fit:.2%} of the position",
            traces=[line(again.time, error, "simulated less measured", Look(draw.BLUE))],
            layout=layout(x=axis("time [s]"), y=[across]),
            height=230,
            heading=each.name,
        )
        for each, again, error in errors
    ]
