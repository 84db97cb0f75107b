"""Finished results as tables, figures, pages and words for a terminal; nothing is computed."""

from stickslip.presentation.comparison import write_comparison_page
from stickslip.presentation.figures.drawing import Plot
from stickslip.presentation.identification import write_report
from stickslip.presentation.positioning import write_positioning_page
from stickslip.presentation.results import figures_of
from stickslip.presentation.table import Cell, Column, Table

__all__ = [
    "Cell",
    "Column",
    "Plot",
    "Table",
    "figures_of",
    "write_comparison_page",
    "write_positioning_page",
    "write_report",
]
