"""The page that shows an identification: it draws finished results and computes nothing."""

from stickslip.report.page import write_report

__all__ = ["write_report"]
