"""Figures and tables of any result, as its page shows them."""

from stickslip.presentation.comparison import comparison_page
from stickslip.presentation.figures.drawing import Plot
from stickslip.presentation.identification import identification_page
from stickslip.presentation.page import Page, plots_on
from stickslip.presentation.positioning import positioning_page
from stickslip.records import EstimatorComparison, EstimatorStudy, Identification, Positioning

__all__ = ["figures_of"]

Result = Identification | EstimatorComparison | EstimatorStudy | Positioning


def figures_of(result: Result) -> dict[str, Plot]:
    """Return every figure of a result, as on its page, by the anchor that it has there.

    Parameters
    ----------
    result
        Of `stickslip.identify`, `stickslip.compare_log`, `stickslip.compare_scenario` or
        `stickslip.position`.

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
    return {each.anchor: each for each in plots_on(_page(result).sections)}


def _page(result: Result) -> Page:
    match result:
        case Identification():
            return identification_page(result)
        case Positioning():
            return positioning_page(result)
        case _:
            return comparison_page(result)
