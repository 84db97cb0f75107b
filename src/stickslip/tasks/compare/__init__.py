"""Estimators side by side: on one log, or over many runs of a simulated scenario."""

from stickslip.tasks.compare.log import compare_log
from stickslip.tasks.compare.study import compare_scenario

__all__ = ["compare_log", "compare_scenario"]
