"""The look that all figures share, and what makes large arrays small enough to draw."""

import html
import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from stickslip.records import QUANTITIES, AxisKind, quantity_name, unit_of, unit_text

__all__ = [
    "BAND",
    "BLUE",
    "GREEN",
    "GREY",
    "INK",
    "ORANGE",
    "PALE",
    "PINK",
    "SKY",
    "VERMILION",
    "Plot",
    "Trace",
    "axis",
    "axis_title",
    "band",
    "key",
    "layout",
    "line",
    "numbers",
    "symbol",
    "thin",
    "thinned_text",
]

Trace = dict[str, Any]

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
_FRAME = "#9ca3af"

MOST_POINTS = 2000
"""Points a trace is thinned to: more than a screen has columns."""

_KEPT = 4
"""Points kept of a stretch: its first, its last and its extremes."""

_FINER = 16
"""Parts of a stretch in which is looked for changes."""

_DIGITS = 7


@dataclass(frozen=True, kw_only=True)
class Plot:
    """One drawing: its traces, its layout, and the words that go with it.

    Attributes
    ----------
    anchor
        Identifier of the drawing on its page.
    alternative
        What the drawing shows, for a reader who cannot see it.
    caption
        What to look for.
    traces, layout
        As plotly.js takes them.
    height
        Height on the page [px].
    heading
        A heading of its own, where a section has several drawings alike.
    """

    anchor: str
    alternative: str
    caption: str
    traces: list[Trace]
    layout: dict[str, Any]
    height: int
    heading: str = ""


def numbers(values: Float[np.ndarray, " n"]) -> list[float | None]:
    """Return values as JSON numbers with the digits a drawing needs; NaN becomes a gap."""
    return [
        float(f"{value:.{_DIGITS}g}") if math.isfinite(value) else None for value in values.tolist()
    ]


def thin(
    values: Float[np.ndarray, " n"], *, most: int = MOST_POINTS
) -> Int[np.ndarray, " m"] | slice:
    """Choose the samples of a long series to draw, most of them where it changes.

    Of each stretch the extremes are kept, and where it begins and ends, so that what rests is drawn
    at rest.

    Returns
    -------
    The indices, or a slice of everything if the series is short enough.
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
    """Return a sentence that says so if so many samples are too many to be drawn one by one.

    Parameters
    ----------
    samples
        Of the longest series of a drawing.
    """
    if samples <= MOST_POINTS:
        return ""
    return (
        f" Of {samples} samples each line shows at most {MOST_POINTS}, half of them where it "
        "changes most."
    )


def _edges(known: Float[np.ndarray, " n"], stretches: int) -> Int[np.ndarray, " e"]:
    """Part a long series: half of the stretches are of one length, half are where it changes most.

    Parameters
    ----------
    known
        The series, NaN where there is none.
    stretches
        How many at most.
    """
    n, half = known.size, stretches // 2
    fine = np.linspace(0, n, min(n, _FINER * stretches) + 1).astype(np.int64)
    change = np.fmax.reduceat(known, fine[:-1]) - np.fmin.reduceat(known, fine[:-1])
    change = np.where(np.isnan(change), 0.0, change)
    # What every stretch has is noise, and no reason to look closer
    excess = np.maximum(change - np.median(change), 0.0)
    even = np.linspace(0, n, stretches - half + 1)
    if not np.any(excess):
        return even.astype(np.int64)
    # The root lets a small motion beside a large one have its share
    share = np.concatenate(([0.0], np.cumsum(np.sqrt(excess))))
    dense = np.interp(np.linspace(0.0, share[-1], half + 1), share, fine)
    return np.unique(np.concatenate((even, dense)).astype(np.int64))


def line(
    x: Float[np.ndarray, " n"],
    y: Float[np.ndarray, " n"],
    *,
    name: str,
    colour: str,
    dash: str = "solid",
    width: float = 1.8,
    row: int = 1,
) -> Trace:
    """Return a series to draw, thinned if it is long."""
    chosen = thin(y)
    trace: Trace = {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": numbers(x[chosen]),
        "y": numbers(y[chosen]),
        "line": {"color": colour, "dash": dash, "width": width},
    }
    if row > 1:
        trace["yaxis"] = f"y{row}"
    return trace


def band(
    x: Float[np.ndarray, " n"],
    low: Float[np.ndarray, " n"],
    high: Float[np.ndarray, " n"],
    *,
    name: str,
) -> list[Trace]:
    """Shade between two curves; where either is not finite the shading is interrupted."""
    finite = np.isfinite(low) & np.isfinite(high) & np.isfinite(x)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], finite.astype(np.int8), [0]))))
    traces: list[Trace] = []
    for start, stop in edges.reshape(-1, 2).tolist():
        stride = max(1, math.ceil((stop - start) / MOST_POINTS))
        there = np.unique(np.append(np.arange(start, stop, stride), stop - 1))
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "name": name,
                "x": numbers(np.concatenate((x[there], x[there[::-1]]))),
                "y": numbers(np.concatenate((low[there], high[there[::-1]]))),
                "fill": "toself",
                "fillcolor": BAND,
                "line": {"width": 0, "color": BAND},
                "hoverinfo": "skip",
            }
        )
    return traces


def key(traces: Iterable[Trace]) -> str:
    """Return the key of a drawing as HTML: a sample of each line with its name, every name once."""
    samples: dict[str, str] = {}
    for trace in traces:
        if trace["name"] not in samples:
            samples[trace["name"]] = _sample(trace)
    if len(samples) < 2:
        return ""
    items = "".join(
        f'<li><svg width="30" height="12" aria-hidden="true">{sample}</svg>{html.escape(name)}</li>'
        for name, sample in samples.items()
    )
    return f'<ul class="key">{items}</ul>\n'


def _sample(trace: Trace) -> str:
    if "fill" in trace:
        return f'<rect x="1" y="1" width="28" height="10" fill="{trace["fillcolor"]}"/>'
    if trace["mode"] == "markers":
        colour = trace["marker"]["color"]
        dots = ((6, 8), (14, 4), (22, 7))
        return "".join(f'<circle cx="{x}" cy="{y}" r="2" fill="{colour}"/>' for x, y in dots)
    look = trace["line"]
    dash = {"dash": ' stroke-dasharray="7 4"', "dot": ' stroke-dasharray="2 3"'}
    return (
        f'<line x1="1" y1="6" x2="29" y2="6" stroke="{look["color"]}" '
        f'stroke-width="{look["width"]}"{dash.get(look.get("dash", ""), "")}/>'
    )


def axis_title(quantity: str, kind: AxisKind) -> str:
    """Return an axis label: the quantity in words, its symbol and its unit."""
    return f"{QUANTITIES[quantity].name} {symbol(quantity)} [{unit_text(unit_of(quantity, kind))}]"


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
        "zerolinecolor": _FRAME,
        "zerolinewidth": 1,
        "linecolor": _FRAME,
        "ticks": "outside",
        "tickcolor": _FRAME,
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
