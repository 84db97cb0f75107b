"""The page and the figures of any result."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from stickslip.errors import check_class
from stickslip.presentation.axes import axes_page
from stickslip.presentation.comparison import comparison_page, study_page
from stickslip.presentation.drawing import Plot
from stickslip.presentation.identification import identification_page
from stickslip.presentation.page import Page, plots_on, write_page
from stickslip.presentation.positioning.page import positioning_page
from stickslip.records import (
    AxesIdentification,
    EstimatorComparison,
    EstimatorStudy,
    Identification,
    Positioning,
)

Result = Identification | AxesIdentification | EstimatorComparison | EstimatorStudy | Positioning
"""Results of `identify`, `identify_axes`, `compare_log`, `compare_scenario` and `position`."""

PAGES: dict[type, Callable[[Any], Page]] = {
    Identification: identification_page,
    AxesIdentification: axes_page,
    EstimatorComparison: comparison_page,
    EstimatorStudy: study_page,
    Positioning: positioning_page,
}
"""The page of each kind of result."""


def write_report(result: Result, path: Path | str) -> Path:
    """Write a result as one HTML page that works offline, on paper and on a small screen.

    The page holds everything it needs and fetches nothing. It appears under its name only once it
    is complete.

    Parameters
    ----------
    result
        Of `stickslip.identify`, `stickslip.identify_axes`, `stickslip.compare_log`,
        `stickslip.compare_scenario` or `stickslip.position`; nothing is computed from it but the
        figures.
    path
        The HTML file to write (``.html`` or ``.htm``), which is returned; an existing one is
        replaced.

    Raises
    ------
    InputError
        If it is no result of these, the path has another suffix, or nothing can be written there.
    """
    return write_page(page_of(result), path)


def figures_of(result: Result) -> dict[str, Plot]:
    """Return every figure of a result, as on its page, by the anchor that it has there.

    Examples
    --------
    >>> import numpy as np
    >>> from stickslip import AxisLog, identify
    >>> time = np.arange(0, 5, 0.002)
    >>> log = AxisLog(name="stage", kind="linear", time=time, measured_position=np.sin(time),
    ...               effort=np.sign(np.cos(time)) - np.sin(time))
    >>> figures = figures_of(identify(log, inertia=1.0))
    >>> figures["curve-plot"].to_plotly()["layout"]["xaxis"]["title"]["text"]
    'velocity <i>v</i> [m/s]'
    >>> figures["curve-plot"].to_matplotlib().savefig("friction.png")  # doctest: +SKIP
    """
    return {each.anchor: each for each in plots_on(page_of(result).sections)}


def page_of(result: Result) -> Page:
    """Return the page of a result; an InputError for anything else."""
    check_class("result", result, *PAGES)
    page = next(page for kind, page in PAGES.items() if isinstance(result, kind))
    return page(result)
