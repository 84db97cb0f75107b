"""What a person asks for: identify a log, position an axis, see a demonstration, find data."""

from stickslip.estimation.base import EstimationTask
from stickslip.estimation.registry import ESTIMATORS
from stickslip.jobs.compare import compare_log, compare_scenario
from stickslip.jobs.demo import Demonstration, demonstrate
from stickslip.jobs.effort_file import write_effort
from stickslip.jobs.excite import excite
from stickslip.jobs.identify import identify
from stickslip.jobs.json_file import json_text, write_json
from stickslip.jobs.position import ScenarioFile, position, read_scenario
from stickslip.jobs.reproduce import (
    Reproduced,
    reproduce_conjunction,
    reproduce_part_a,
    reproduce_part_b,
)
from stickslip.logs import AxisSchema, find_benchmark
from stickslip.report import write_comparison_page, write_positioning_page, write_report

__all__ = [
    "ESTIMATORS",
    "AxisSchema",
    "Demonstration",
    "EstimationTask",
    "Reproduced",
    "ScenarioFile",
    "compare_log",
    "compare_scenario",
    "demonstrate",
    "excite",
    "find_benchmark",
    "identify",
    "json_text",
    "position",
    "read_scenario",
    "reproduce_conjunction",
    "reproduce_part_a",
    "reproduce_part_b",
    "write_comparison_page",
    "write_effort",
    "write_json",
    "write_positioning_page",
    "write_report",
]
