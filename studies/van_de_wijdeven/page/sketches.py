"""Drawings of systems, made of lines and letters."""

from typing import TYPE_CHECKING, Any

from stickslip.presentation.drawing import BLUE, GREY, INK, PALE, VERMILION
from studies.van_de_wijdeven.records import Sketch

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LETTERS = 15  # points
_GROUND = (0.6, 9.4)  # from left to right; the drawing is 10 wide, as all lengths here
_MASS = (3.6, 1.0, 2.8, 1.5)  # left, bottom, width, height
_HATCHING = 0.22


def draw_sketch(axes: "Axes", sketch: Sketch) -> None:
    """Draw a system into empty axes, whose frame is taken away."""
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.set_xlim(0.0, 10.0)
    axes.set_ylim(-0.3, 4.0)
    match sketch:
        case "mass with friction":
            _mass_with_friction(axes)


def _mass_with_friction(axes: "Axes") -> None:
    """Draw a mass on the ground, pushed by u against friction f and a damper c, and its x."""
    from matplotlib.patches import FancyBboxPatch

    left, bottom, width, height = _MASS
    right, middle = left + width, bottom + 0.5 * height
    _ground(axes, bottom)
    axes.add_patch(
        FancyBboxPatch(
            (left, bottom + 0.06),
            width,
            height,
            boxstyle="round,pad=0,rounding_size=0.12",
            facecolor="#e8eef4",
            edgecolor=INK,
            linewidth=1.6,
            zorder=3,
        )
    )
    axes.text(left + 0.5 * width, middle, "$m$", fontsize=_LETTERS, ha="center", va="center")
    _arrow(axes, (right + 0.1, middle), (right + 1.6, middle), BLUE)
    axes.text(right + 1.75, middle, "$u$", fontsize=_LETTERS, color=BLUE, va="center")
    _arrow(axes, (left + 1.0, bottom - 0.34), (left - 0.5, bottom - 0.34), VERMILION)
    axes.text(
        left - 0.65,
        bottom - 0.36,
        "$f$",
        fontsize=_LETTERS,
        color=VERMILION,
        ha="right",
        va="center",
    )
    _damper(axes, 0.6, left, middle)
    axes.text(0.5 * (0.6 + left), middle + 0.62, "$c$", fontsize=_LETTERS, ha="center")
    above = bottom + height + 0.06
    axes.plot([left + 0.5 * width] * 2, [above, above + 0.75], color=GREY, lw=1.0)
    _arrow(axes, (left + 0.5 * width, above + 0.55), (left + 0.5 * width + 1.3, above + 0.55), INK)
    axes.text(left + 0.5 * width + 1.45, above + 0.55, "$x$", fontsize=_LETTERS, va="center")


def _ground(axes: "Axes", height: float) -> None:
    start, end = _GROUND
    axes.plot([start, end], [height, height], color=INK, lw=1.4, zorder=2)
    place = start + _HATCHING
    while place <= end:
        axes.plot([place - _HATCHING, place], [height - _HATCHING, height], color=PALE, lw=0.9)
        place += _HATCHING


def _damper(axes: "Axes", wall: float, end: float, height: float) -> None:
    """Draw a damper between a wall and the mass."""
    cup, piston, half = wall + 0.9, wall + 1.45, 0.3
    look: dict[str, Any] = {"color": INK, "lw": 1.4, "solid_capstyle": "butt"}
    axes.plot([wall, wall], [height - 0.75, height + 0.75], **look)
    for k in range(8):
        low = height - 0.75 + k * 1.5 / 8
        axes.plot([wall - 0.2, wall], [low, low + 0.2], color=PALE, lw=0.9)
    axes.plot([wall, cup], [height, height], **look)
    axes.plot(
        [cup + 1.0, cup, cup, cup + 1.0],
        [height + half, height + half, height - half, height - half],
        **look,
    )
    axes.plot([piston, piston], [height - half + 0.06, height + half - 0.06], **look)
    axes.plot([piston, end], [height, height], **look)


def _arrow(axes: "Axes", start: tuple[float, float], end: tuple[float, float], colour: str) -> None:
    axes.annotate(
        "",
        xy=end,
        xytext=start,
        arrowprops={
            "arrowstyle": "-|>,head_width=0.28,head_length=0.6",
            "color": colour,
            "linewidth": 1.8,
            "shrinkA": 0.0,
            "shrinkB": 0.0,
        },
        zorder=4,
    )
