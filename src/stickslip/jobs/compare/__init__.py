"""Estimators side by side: on one log, or over many runs of a simulated scenario."""

from stickslip.jobs.compare.log import compare_log
from stickslip.jobs.compare.study import compare_scenario

__all__ = ["compare_log", "compare_scenario"]
