"""Figures of estimators side by side."""

from dataclasses import dataclass

import numpy as np

from stickslip.records import (
    AxisKind,
    ComparedEstimator,
    EstimatorComparison,
    EstimatorStudy,
    parameter_label,
    unit_of,
    unit_text,
)
from stickslip.report.drawing import (
    BLUE,
    GREY,
    VERMILION,
    Plot,
    Trace,
    axis,
    axis_title,
    layout,
    line,
    numbers,
    symbol,
)

__all__ = ["estimate_plots", "motion_plots", "score_plots"]

_ROW = 26  # px an estimator
_FRAME = 90  # px around them
_MARGIN = 0.15  # of what is drawn, on either side
_FAR = 4.0
"""Widths of the middle half of the values beyond which one is not drawn, but told."""


@dataclass(frozen=True, kw_only=True)
class _Bar:
    """A value with what it may be off by."""

    name: str
    value: float
    low: float | None
    high: float | None
    good: bool


def estimate_plots(found: EstimatorComparison) -> list[Plot]:
    """Draw each parameter as every estimator found it, with its 95 % interval."""
    plots: list[Plot] = []
    for name in found.parameters:
        bars: list[_Bar] = []
        for each in found.applied:
            parameter = None if each.estimate is None else each.estimate.parameters.get(name)
            if each.estimate is None or parameter is None or parameter.value is None:
                continue
            low, high = parameter.ci95 or (None, None)
            bars.append(
                _Bar(
                    name=each.name,
                    value=parameter.value,
                    low=low,
                    high=high,
                    good=each.estimate.status.trusted,
                )
            )
        plots.append(
            _bars(name, found.log.kind, bars, names=("trusted", "not to be trusted"), truth=None)
        )
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
            bars.append(
                _Bar(
                    name=each.name,
                    value=bias,
                    low=bias - reach,
                    high=bias + reach,
                    # What several standard errors of the mean do not explain is a bias
                    good=score.bias**2 <= 9.0 * variance / max(score.runs, 1),
                )
            )
        unit = "% of the truth" if truth else unit_text(unit_of(name, study.kind))
        plots.append(
            _bars(
                name,
                study.kind,
                bars,
                names=("no bias to be seen", "biased by more than three standard errors"),
                truth=0.0,
                title=f"error of {symbol(name)} [{unit}]",
            )
        )
    return plots


def _bars(
    name: str,
    kind: AxisKind,
    bars: list[_Bar],
    *,
    names: tuple[str, str],
    truth: float | None,
    title: str | None = None,
) -> Plot:
    """Draw values one below the other; what lies far off is told instead."""
    unit = unit_text(unit_of(name, kind))
    label = parameter_label(name)
    values = np.array([bar.value for bar in bars])
    quarter, middle, three = np.percentile(values, [25, 50, 75])
    typical = [bar.high - bar.low for bar in bars if bar.low is not None and bar.high is not None]
    reach = _FAR * max(
        float(three - quarter), float(np.median(typical)) if typical else 0.0, 1e-3 * abs(middle)
    )
    shown = [bar for bar in bars if abs(bar.value - middle) <= reach]
    far = [f"{bar.name} at {bar.value:.3g}" for bar in bars if bar not in shown]
    order = [bar.name for bar in bars]
    traces: list[Trace] = []
    for which, colour, sign in ((True, BLUE, "circle"), (False, VERMILION, "x")):
        some = [bar for bar in shown if bar.good is which]
        if not some:
            continue
        highs = [bar.value if bar.high is None else bar.high for bar in some]
        lows = [bar.value if bar.low is None else bar.low for bar in some]
        own = np.array([bar.value for bar in some])
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": names[0] if which else names[1],
                "x": numbers(own),
                "y": [bar.name for bar in some],
                "marker": {"color": colour, "size": 8, "symbol": sign},
                "error_x": {
                    "type": "data",
                    "symmetric": False,
                    "array": numbers(np.array(highs) - own),
                    "arrayminus": numbers(own - np.array(lows)),
                    "color": colour,
                    "thickness": 1.6,
                },
            }
        )
    settings = {}
    if truth is not None:
        settings["shapes"] = [
            {
                "type": "line",
                "x0": truth,
                "x1": truth,
                "yref": "paper",
                "y0": 0,
                "y1": 1,
                "line": {"color": GREY, "dash": "dash", "width": 1.2},
            }
        ]
    ends = [end for bar in shown for end in (bar.value, bar.low, bar.high) if end is not None]
    low, high = max(min(ends), middle - reach), min(max(ends), middle + reach)
    if truth is not None:
        low, high = min(low, truth), max(high, truth)
    margin = _MARGIN * (high - low) or 0.05 * abs(high) or 1.0
    said = ", ".join(f"{bar.name} {bar.value:.4g}" for bar in bars)
    return Plot(
        anchor=f"estimates-{name.replace('_', '-')}",
        alternative=f"{label} by estimator: {said}.",
        caption=f"Out of the picture: {', '.join(far)}." if far else "",
        traces=traces,
        layout=layout(
            x=axis(title or f"{symbol(name)} [{unit}]", range=[low - margin, high + margin]),
            y=[axis("", type="category", categoryorder="array", categoryarray=order[::-1])],
            hovermode="closest",
            **settings,
        ),
        height=_FRAME + _ROW * len(bars),
        heading=label,
    )


def motion_plots(found: EstimatorComparison) -> list[Plot]:
    """Draw what each identified axis misses of the measured position, all at one scale."""
    drawn = [each for each in found.applied if each.resimulation is not None]
    errors = [_error(each) for each in drawn]
    if not drawn:
        return []
    typical = [float(np.percentile(np.abs(error), 99.0)) for error in errors]
    scale = 1.2 * min(max(typical), _FAR * float(np.median(typical))) or 1.0
    plots: list[Plot] = []
    for each, error in zip(drawn, errors, strict=True):
        again = each.resimulation
        if again is None:
            continue
        plots.append(
            Plot(
                anchor=f"motion-{each.name}",
                alternative=(
                    f"Simulated less measured position over time with the law that {each.name} "
                    f"found; it explains {again.fit:.2%} of the position."
                ),
                caption=f"explains {again.fit:.2%} of the position",
                traces=[line(again.time, error, name="simulated less measured", colour=BLUE)],
                layout=layout(
                    x=axis("time [s]"),
                    y=[axis(axis_title("position", found.log.kind), range=[-scale, scale])],
                ),
                height=230,
                heading=each.name,
            )
        )
    return plots


def _error(each: ComparedEstimator) -> np.ndarray:
    again = each.resimulation
    if again is None:
        return np.zeros(1)
    return again.simulated_position - again.measured_position
