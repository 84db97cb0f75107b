"""The look that all figures share, and what makes large arrays small enough to draw."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from stickslip.presentation.words import printed_unit
from stickslip.records import QUANTITIES, AxisKind, EffortUnit, quantity_name

if TYPE_CHECKING:
    import matplotlib.figure

Trace = dict[str, Any]
Values = Float[np.ndarray, " n"]

# The palette of Okabe and Ito: its colours stay apart under every common colour blindness. Lines
# that share a panel differ in dash or width as well, so that a grey print can be read.
INK = "#1f2933"
GREY = "#6b7280"
PALE = "#a9b2bc"
BLUE = "#0072b2"
GREEN = "#009e73"
VERMILION = "#d55e00"
ORANGE = "#e69f00"
SKY = "#56b4e9"
PINK = "#cc79a7"
BAND = "rgba(0, 114, 178, 0.20)"

_GRID = "#e5e7eb"
FRAME = "#9ca3af"

MOST_POINTS = 2000
"""Points a trace is thinned to: more than a screen has columns."""

_KEPT = 4  # points of a stretch: its first, its last and its extremes
_FINER = 16  # parts of a stretch that are searched for changes
_DIGITS = 7  # of a number in a figure: finer than a pixel


@dataclass(frozen=True, kw_only=True)
class Plot:
    """A figure: its traces, its layout, and the words that go with it."""

    kind = "plot"
    anchor: str  #: Identifier of the figure on its page.
    alternative: str  #: Description of the figure, for a reader who cannot see it.
    traces: list[Trace]  #: As plotly.js takes them.
    layout: dict[str, Any]  #: As plotly.js takes it.
    height: int  #: Height on the page [px].
    caption: str = ""  #: What to look for.
    heading: str = ""  #: A heading of its own, where a section has several figures alike.
    #: Traces that are shown in the legend only, such as shades behind the lines.
    also_in_legend: Sequence[Trace] = ()

    def to_plotly(self) -> dict[str, Any]:
        """Return the figure as plotly takes it: ``data`` and ``layout``, as plain JSON types."""
        return {"data": self.traces, "layout": self.layout}

    def to_matplotlib(self) -> "matplotlib.figure.Figure":
        """Return the figure drawn with matplotlib, with its legend and caption."""
        from stickslip.presentation.matplotlib_figure import drawn

        return drawn(self)


def numbers(values: Values) -> list[float | None]:
    """Return values as JSON numbers with the digits a drawing needs; NaN becomes a gap."""
    return [
        float(f"{value:.{_DIGITS}g}") if math.isfinite(value) else None for value in values.tolist()
    ]


def thin(values: Values, *, most: int = MOST_POINTS) -> Int[np.ndarray, " m"] | slice:
    """Choose the samples of a long series to draw, most of them where it changes.

    Of each stretch the extremes are kept, and where it begins and ends, so that what rests is drawn
    at rest. A series that is short enough is a slice of everything.
    """
    n = values.size
    if n <= most:
        return slice(None)
    known = np.where(np.isfinite(values), values, np.nan)
    edges = _edges(known, most // _KEPT)
    chosen: set[int] = set()
    for begin, end in pairwise(edges.tolist()):
        stretch = known[begin:end]
        chosen |= {begin, end - 1}
        missing = np.isnan(stretch)
        if missing.any():
            chosen.add(begin + int(np.argmax(missing)))
        if not missing.all():
            chosen |= {begin + int(np.nanargmin(stretch)), begin + int(np.nanargmax(stretch))}
    return np.array(sorted(chosen), dtype=np.int64)


def thinned_text(samples: int) -> str:
    """Return a sentence if the longest series has too many samples to be drawn one by one."""
    if samples <= MOST_POINTS:
        return ""
    return (
        f" Of {samples} samples each line shows at most {MOST_POINTS}, half of them where it "
        "changes most."
    )


def _edges(known: Values, stretches: int) -> Int[np.ndarray, " e"]:
    """Part a series, NaN where there is none, into so many stretches at most.

    Half of them are of one length, half are where it changes most.
    """
    n, half = known.size, stretches // 2
    fine = np.linspace(0, n, min(n, _FINER * stretches) + 1).astype(np.int64)
    change = np.fmax.reduceat(known, fine[:-1]) - np.fmin.reduceat(known, fine[:-1])
    change = np.where(np.isnan(change), 0.0, change)
    # A change that every stretch has is noise, and no reason to look closer
    excess = np.maximum(change - np.median(change), 0.0)
    even = np.linspace(0, n, stretches - half + 1)
    if not np.any(excess):
        return even.astype(np.int64)
    # The root lets a small motion beside a large one have its share
    share = np.concatenate(([0.0], np.cumsum(np.sqrt(excess))))
    dense = np.interp(np.linspace(0.0, share[-1], half + 1), share, fine)
    return np.unique(np.concatenate((even, dense)).astype(np.int64))


def _trace(name: str, row: int, **look: Any) -> Trace:
    return {"type": "scatter", "name": name, **look, **({"yaxis": f"y{row}"} if row > 1 else {})}


class Look(NamedTuple):
    """Colour, width [px] and dash of a line."""

    colour: str
    width: float = 1.8
    dash: str = "solid"

    def of_line(self, **more: str) -> dict[str, Any]:
        """Return it as plotly takes it."""
        return {"color": self.colour, "dash": self.dash, "width": self.width, **more}


def line(x: Values, y: Values, name: str, look: Look, row: int = 1) -> Trace:
    """Return a series to draw, thinned if it is long."""
    chosen = thin(y)
    return _trace(
        name, row, mode="lines", x=numbers(x[chosen]), y=numbers(y[chosen]), line=look.of_line()
    )


def level(
    ends: Sequence[float] | Values, value: float, name: str, look: Look, row: int = 1
) -> Trace:
    """Return a horizontal line from the first to the last of some values."""
    along = np.array([ends[0], ends[-1]], dtype=np.float64)
    return line(along, np.full(2, value), name, look, row)


def markers(
    x: Sequence[float] | Values,
    y: Sequence[float | str] | Values,
    name: str,
    look: Mapping[str, Any],
    **settings: Any,
) -> Trace:
    """Return points to draw, none of which is left out; their look is plotly's of markers."""
    across = list(y) if isinstance(y, Sequence) else numbers(y)
    along = numbers(np.asarray(x, dtype=np.float64))
    return _trace(name, 1, mode="markers", x=along, y=across, marker=dict(look), **settings)


def bars_across(values: Values, low: Values, high: Values, colour: str) -> dict[str, Any]:
    """Return horizontal error bars, as plotly takes them."""
    reach = {"array": numbers(high - values), "arrayminus": numbers(values - low)}
    return {"type": "data", "symmetric": False, **reach, "color": colour, "thickness": 1.6}


def steps(
    time: Float[np.ndarray, " samples"],
    values: Float[np.ndarray, " efforts"],
    name: str,
    look: Look,
    row: int = 1,
) -> Trace:
    """Return a signal held from sample to sample, only where it changes if that is seldom."""
    held = np.append(values, values[-1:])
    changes: Int[np.ndarray, " c"] = np.flatnonzero(np.diff(held) != 0.0) + 1
    kept = np.unique(np.concatenate(([0], changes, [held.size - 1])))
    kept = kept[thin(held[kept])]
    look_of_line = look.of_line(shape="hv")
    x, y = numbers(time[kept]), numbers(held[kept])
    return _trace(name, row, mode="lines", x=x, y=y, line=look_of_line)


def vertical(x: float, *, dash: str, width: float = 1.0, colour: str = FRAME) -> dict[str, Any]:
    """Return a vertical line through all panels, as a shape of a layout."""
    look = {"color": colour, "width": width, "dash": dash}
    return {"type": "line", **_upright(x, x), "line": look}


def shade(x0: float, x1: float, colour: str) -> dict[str, Any]:
    """Return a shade between two places behind all panels, as a shape of a layout."""
    look = {"fillcolor": colour, "line": {"width": 0}}
    return {"type": "rect", "layer": "below", **_upright(x0, x1), **look}


def _upright(x0: float, x1: float) -> dict[str, Any]:
    return {"xref": "x", "yref": "paper", "x0": x0, "x1": x1, "y0": 0, "y1": 1}


def band(x: Values, low: Values, high: Values, *, name: str, row: int = 1) -> list[Trace]:
    """Shade between two curves; where either is not finite the shading is interrupted."""
    finite = np.isfinite(low) & np.isfinite(high) & np.isfinite(x)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], finite.astype(np.int8), [0]))))
    look = {"line": {"width": 0, "color": BAND}, "fill": "toself", "fillcolor": BAND}
    traces: list[Trace] = []
    for start, stop in edges.reshape(-1, 2).tolist():
        stride = max(1, math.ceil((stop - start) / MOST_POINTS))
        there = np.unique(np.append(np.arange(start, stop, stride), stop - 1))
        along = numbers(np.concatenate((x[there], x[there[::-1]])))
        across = numbers(np.concatenate((low[there], high[there[::-1]])))
        traces.append(_trace(name, row, mode="lines", x=along, y=across, hoverinfo="skip", **look))
    return traces


class LegendEntry(NamedTuple):
    """A sample of a line, of points or of a shade, with its name."""

    name: str
    kind: str
    colour: str
    width: float = 0.0
    dashes: str = ""


def legend(traces: Iterable[Trace]) -> list[LegendEntry]:
    """Return the legend of traces, every name once."""
    entries: dict[str, LegendEntry] = {}
    for trace in traces:
        name, look = trace["name"], trace.get("line", {})
        if "fill" in trace:
            entry = LegendEntry(name, "fill", trace["fillcolor"])
        elif trace["mode"] == "markers":
            entry = LegendEntry(name, "markers", trace["marker"]["color"])
        else:
            dashes = {"dash": "7 4", "dot": "2 3"}.get(look.get("dash", ""), "")
            entry = LegendEntry(name, "line", look["color"], look["width"], dashes)
        entries.setdefault(name, entry)
    return list(entries.values())


def range_of(
    *values: Float[np.ndarray, " _"] | Sequence[float], room: float
) -> dict[str, list[float]]:
    """Return the range of an axis that shows finite values, with room around; empty for none."""
    every = np.concatenate([np.asarray(each, dtype=np.float64) for each in values])
    every = every[np.isfinite(every)]
    if not every.size:
        return {}
    low, high = float(np.min(every)), float(np.max(every))
    margin = room * (high - low) or 0.05 * abs(high) or 1.0
    return {"range": [low - margin, high + margin]}


def quantity_axis(
    quantity: str, kind: AxisKind, effort: EffortUnit = "", **settings: Any
) -> dict[str, Any]:
    """Return the axis of a quantity, with its name in words, its symbol and its unit."""
    unit = printed_unit(quantity, kind, effort)
    return axis(f"{QUANTITIES[quantity].name} {symbol(quantity)} [{unit}]", **settings)


def symbol(name: str) -> str:
    """Return the letter of a quantity or parameter, with its index and direction, as HTML."""
    directions = {"_positive": "+", "_negative": "−"}
    raised = next((sign for suffix, sign in directions.items() if name.endswith(suffix)), "")
    letter, _, index = QUANTITIES[quantity_name(name)].symbol.partition("_")
    below = f"<sub>{index}</sub>" if index else ""
    above = f"<sup>{raised}</sup>" if raised else ""
    return f"<i>{letter}</i>{below}{above}"


def axis(title: str, **settings: Any) -> dict[str, Any]:
    """Return an axis with the shared look."""
    return {
        "title": {"text": title, "standoff": 8},
        "automargin": True,
        "gridcolor": _GRID,
        "zerolinecolor": FRAME,
        "zerolinewidth": 1,
        "linecolor": FRAME,
        "ticks": "outside",
        "tickcolor": FRAME,
        "ticklen": 4,
        "exponentformat": "power",
        **settings,
    }


def layout(*, x: dict[str, Any], y: list[dict[str, Any]], **settings: Any) -> dict[str, Any]:
    """Return a layout of panels below each other that share their horizontal axis."""
    gap = 0.09
    height = (1 - gap * (len(y) - 1)) / len(y)
    axes: dict[str, Any] = {}
    for k, each in enumerate(y):
        top = 1 - k * (height + gap)
        axes["yaxis" if k == 0 else f"yaxis{k + 1}"] = {
            **each,
            "domain": [max(0.0, top - height), top],
        }
    lowest = "y" if len(y) == 1 else f"y{len(y)}"
    return {
        "autosize": True,
        "margin": {"l": 56, "r": 14, "t": 8, "b": 44},
        "paper_bgcolor": "#ffffff",
        "plot_bgcolor": "#ffffff",
        "font": {
            "family": "system-ui, -apple-system, 'Segoe UI', Roboto, 'Liberation Sans', sans-serif",
            "size": 12.5,
            "color": INK,
        },
        # The key stands in the page, where it wraps on a narrow screen and on paper.
        "showlegend": False,
        "hovermode": "x unified",
        "xaxis": {**x, "anchor": lowest},
        **axes,
        **settings,
    }
