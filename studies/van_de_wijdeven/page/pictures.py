"""Figures of a reproduction as pictures; what is drawn was computed before."""

import io
import re
from typing import TYPE_CHECKING, Any, Literal

from stickslip.presentation.drawing import BLUE, GREY, INK, ORANGE, PINK, VERMILION
from studies.van_de_wijdeven.page.sketches import draw_sketch
from studies.van_de_wijdeven.records import CurveRole, Panel, ReproducedFigure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DOTS_PER_INCH = 160
_WIDTH = 9.0  # inches, as all sizes here
_SINGLE_HEIGHT = 3.6
_ROW_HEIGHT = 1.75
_SKETCH_HEIGHT = 2.9
_HEAD = 0.45
_ALONE = 0.9  # width of a line that has a panel for itself [points]
_STEPS = 1.2  # the same of a staircase, which does not fill its panel

_SYMBOL = re.compile(r"\b([A-Za-z])(\u0302?)(?:_([a-z]+\d?(?:,max)?|\d))?(?!\w)")

_STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",  # the one font that comes with the library
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": GREY,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e5e7eb",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8,
}

# Lines that share a panel differ in dash as well, as in the source, whose second line is dotted: a
# grey print can be read.
_LOOKS: dict[CurveRole, dict[str, Any]] = {
    "truth": {"color": INK, "lw": 1.0, "ls": (0, (5, 3)), "zorder": 3},
    "first": {"color": BLUE, "lw": 1.6},
    "second": {"color": VERMILION, "lw": 1.5, "ls": (0, (1, 1.3))},
    "third": {"color": ORANGE, "lw": 1.4, "ls": "-."},
    "fourth": {"color": PINK, "lw": 1.4, "ls": ":"},
}


def picture(figure: ReproducedFigure) -> bytes:
    """Return a figure as PNG; the same figure gives the same bytes."""
    # Loaded here, as it takes half a second.
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows = -(-len(figure.panels) // figure.columns)
    height = _SINGLE_HEIGHT if rows == 1 else _HEAD + rows * _ROW_HEIGHT
    if figure.sketch is not None:
        height = _SKETCH_HEIGHT
    with rc_context(_STYLE):
        drawn = Figure(figsize=(_WIDTH, height), dpi=_DOTS_PER_INCH, layout="constrained")
        drawn.suptitle(
            _typeset(f"Figure {figure.number}: {figure.title}"),
            x=0.01,
            ha="left",
            fontsize=10,
            fontweight="bold",
        )
        if figure.sketch is not None:
            draw_sketch(drawn.subplots(), figure.sketch)
        elif figure.panels:
            _draw_panels(drawn, figure, rows)
        written = io.BytesIO()
        # No date and no version inside.
        FigureCanvasAgg(drawn).print_png(written, metadata={"Software": None})
    return written.getvalue()


def _draw_panels(drawn: "Figure", figure: ReproducedFigure, rows: int) -> None:
    """Draw the panels into their places, row by row."""
    axes = drawn.subplots(rows, figure.columns, squeeze=False)
    # One legend for all where panels have several lines and no room for it
    shared = figure.columns > 1 and rows > 1 and any(len(each.curves) > 1 for each in figure.panels)
    for k, panel in enumerate(figure.panels):
        row, column = divmod(k, figure.columns)
        lowest = row == rows - 1 or panel.x_label != figure.panels[k + figure.columns].x_label
        _draw(
            axes[row, column],
            panel,
            x_label=lowest,
            legend="none" if shared else "above" if figure.columns == 1 else "inside",
        )
    if shared:
        lines = {line.get_label(): line for each in axes.flat for line in each.get_lines()}
        drawn.legend(lines.values(), lines.keys(), loc="outside upper right", ncols=len(lines))


def _draw(
    axes: "Axes", panel: Panel, *, x_label: bool, legend: Literal["above", "inside", "none"]
) -> None:
    for curve in panel.curves:
        look = dict(_LOOKS[curve.role])
        if len(panel.curves) == 1:
            look |= {"lw": _STEPS if curve.staircase else _ALONE, "ls": "-"}
        drawn = "steps-post" if curve.staircase else "default"
        axes.plot(curve.x, curve.y, label=_typeset(curve.label), drawstyle=drawn, **look)
    axes.set_title(_typeset(panel.title))
    axes.set_ylabel(_typeset(panel.y_label))
    if x_label:
        axes.set_xlabel(_typeset(panel.x_label))
    axes.margins(x=0.01)
    if panel.y_range is not None:
        axes.set_ylim(*panel.y_range)
    if panel.y_ticks:
        axes.set_yticks(range(len(panel.y_ticks)), panel.y_ticks)
    if len({curve.label for curve in panel.curves}) > 1:
        if legend == "above":  # above the panel, beside its title, where there is room for it
            axes.legend(
                ncols=len(panel.curves),
                loc="lower right",
                bbox_to_anchor=(1.0, 0.99),
                borderaxespad=0.0,
            )
        elif legend == "inside":
            axes.legend(loc="best")


def _typeset(text: str) -> str:
    """Return text with the indices of its symbols set low, and hats above their letters."""
    return _SYMBOL.sub(_symbol, text)


def _symbol(found: re.Match[str]) -> str:
    letter, hat, index = found.groups()
    if not (hat or index):
        return found[0]
    letter = rf"\hat{{{letter}}}" if hat else letter
    return f"${letter}_{{{index}}}$" if index else f"${letter}$"
