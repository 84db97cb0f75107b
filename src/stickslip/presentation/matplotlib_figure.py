"""A figure drawn with matplotlib, from the traces and the layout that plotly takes."""

import re
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from stickslip.presentation.drawing import Plot, Trace

_PIXELS = 100.0  # an inch
_WIDTH = 8.0  # [inch]
_DASHES = {"solid": "-", "dash": "--", "dot": ":"}
_MARKERS = {"circle": "o", "x": "x", "diamond": "D"}
_RGBA = re.compile(r"rgba\((\d+), (\d+), (\d+), ([\d.]+)\)")


def drawn(plot: "Plot") -> "Figure":
    """Return a figure as matplotlib draws it: panels below each other, with a legend on top."""
    from matplotlib.figure import Figure

    settings = plot.layout
    panels = [key for key in settings if key.startswith("yaxis")]
    made = Figure(figsize=(_WIDTH, plot.height / _PIXELS + 0.6), layout="constrained")
    axes: list[Axes] = list(made.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0])
    places = {f"y{key.removeprefix('yaxis')}": ax for key, ax in zip(panels, axes, strict=True)}
    for key, ax in zip(panels, axes, strict=True):
        if settings[key].get("type") == "category":
            ax.yaxis.update_units(settings[key]["categoryarray"])
    for trace in plot.traces:
        _add(places[trace.get("yaxis", "y")], trace)
    for key, ax in zip(panels, axes, strict=True):
        _set(ax, "y", settings[key])
        ax.grid(color="#e5e7eb")
        ax.set_axisbelow(True)
        for shape in settings.get("shapes", ()):
            ax.axvspan(shape["x0"], shape["x1"], **_shape(shape))
    _set(axes[-1], "x", settings["xaxis"])
    names = {
        name: handle
        for ax in axes
        for handle, name in zip(*ax.get_legend_handles_labels(), strict=True)
    }
    if len(names) > 1:
        made.legend(names.values(), names.keys(), loc="outside upper center", ncols=4, fontsize=8)
    if plot.heading:
        axes[0].set_title(plot.heading, loc="left", fontsize=10)
    return made


def _add(ax: "Axes", trace: "Trace") -> None:
    x = np.array(trace["x"], dtype=np.float64)
    y = trace["y"] if any(isinstance(each, str) for each in trace["y"]) else _floats(trace["y"])
    if "fill" in trace:
        ax.fill(x, y, color=_colour(trace["fillcolor"]), label=trace["name"], linewidth=0)
        return
    look = trace.get("line", {})
    point = trace.get("marker", {})
    shown: dict[str, Any] = {"label": trace["name"]}
    if "lines" in trace["mode"]:
        stepped = look.get("shape") == "hv"
        shown |= {"color": look["color"], "linestyle": _DASHES[look.get("dash", "solid")]}
        shown |= {"linewidth": look["width"], "drawstyle": "steps-post" if stepped else "default"}
    else:
        shown |= {"color": point["color"], "linestyle": "none"}
    if "markers" in trace["mode"]:
        shown |= {"marker": _MARKERS[point.get("symbol", "circle")], "markersize": point["size"]}
        shown |= {"alpha": point.get("opacity", 1.0)}
    error = trace.get("error_x")
    if error is None:
        ax.plot(x, y, **shown)
    else:
        reach = np.vstack([_floats(error["arrayminus"]), _floats(error["array"])])
        ax.errorbar(x, y, xerr=reach, **shown)


def _set(ax: "Axes", which: str, settings: dict[str, Any]) -> None:
    """Set label, scale and range of one axis."""
    ax.set(**{f"{which}label": _mathtext(settings["title"]["text"])})
    ends = settings.get("range")
    if settings.get("type") == "log":
        ax.set(**{f"{which}scale": "log"})
        ends = None if ends is None else [10.0**end for end in ends]
    if ends is not None:
        ax.set(**{f"{which}lim": ends})


def _shape(shape: dict[str, Any]) -> dict[str, Any]:
    """Return how a band or a line behind the curves looks."""
    if shape["type"] == "rect":
        return {"color": shape["fillcolor"], "linewidth": 0, "zorder": 0}
    look = shape["line"]
    line = {"edgecolor": look["color"], "linewidth": look["width"]}
    return {**line, "linestyle": _DASHES[look["dash"]], "fill": False}


def _floats(values: Any) -> Any:
    return np.array(values, dtype=np.float64)


def _colour(text: str) -> Any:
    found = _RGBA.fullmatch(text)
    if found is None:
        return text
    return (*(int(each) / 255 for each in found.groups()[:3]), float(found[4]))


def _mathtext(html: str) -> str:
    """Return a label with its symbols as matplotlib's mathematical text."""
    html = re.sub(r"<i>(.*?)</i>", r"$\1$", html)
    html = re.sub(r"\$<sub>(.*?)</sub>", r"_{\1}$", html)
    return re.sub(r"\$<sup>(.*?)</sup>", r"^{\1}$", html).replace("−", "-")
