"""Finished results as tables, figures, pages and words for a terminal; nothing is computed."""

from stickslip.presentation.drawing import Plot
from stickslip.presentation.results import figures_of, write_report
from stickslip.presentation.table import Cell, Column, Table

__all__ = ["Cell", "Column", "Plot", "Table", "figures_of", "write_report"]
