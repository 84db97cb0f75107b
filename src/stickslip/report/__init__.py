"""Pages of finished results: they draw, and compute nothing."""

from stickslip.report.comparison_page import write_comparison_page
from stickslip.report.page import write_report
from stickslip.report.positioning_page import write_positioning_page

__all__ = [
    "write_comparison_page",
    "write_positioning_page",
    "write_report",
]
