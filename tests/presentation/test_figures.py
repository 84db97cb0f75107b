"""The figures of a result are drawn by matplotlib from the same numbers as by plotly."""

import numpy as np

from stickslip.presentation import Plot, figures_of
from stickslip.presentation import drawing as draw
from stickslip.records import Identification


def test_every_trace_is_drawn_in_its_panel(identification: Identification) -> None:
    for plot in figures_of(identification).values():
        drawn = plot.to_matplotlib()
        assert len(drawn.axes) == sum(key.startswith("yaxis") for key in plot.layout)
        lines = [line for ax in drawn.axes for line in ax.get_lines()]
        shades = [shade for ax in drawn.axes for shade in ax.patches]
        assert len(lines) + len(shades) == len(plot.traces)


def test_a_line_holds_the_values_of_the_record(identification: Identification) -> None:
    drawn = figures_of(identification)["energy-plot"].to_matplotlib()
    (line,) = (each for each in drawn.axes[0].get_lines() if each.get_label() == "kinetic")
    np.testing.assert_allclose(line.get_xdata(), identification.energy.time, rtol=1e-6)
    np.testing.assert_allclose(line.get_ydata(), identification.energy.kinetic, rtol=1e-6)
    assert drawn.axes[0].get_ylabel() == "energy $E$ [J]"


def test_plotly_takes_plain_types(identification: Identification) -> None:
    data = figures_of(identification)["curve-plot"].to_plotly()
    assert set(data) == {"data", "layout"}
    assert all(
        isinstance(each, list) for trace in data["data"] for each in (trace["x"], trace["y"])
    )


def test_categories_stand_in_the_order_of_the_page() -> None:
    names = ["first", "second", "third"]
    points = [
        draw.markers([x], [name], name, {"color": "#000000", "size": 8, "symbol": "x"})
        for x, name in ((1.0, "third"), (2.0, "first"), (3.0, "second"))
    ]
    across = draw.axis("", type="category", categoryarray=names[::-1])
    made = draw.layout(x=draw.axis("x [m]"), y=[across])
    plot = Plot(anchor="a", alternative="", traces=points, layout=made, height=200)
    (ax,) = plot.to_matplotlib().axes
    assert [each.get_text() for each in ax.get_yticklabels()][::-1] == names
