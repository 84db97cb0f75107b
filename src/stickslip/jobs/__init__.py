"""What a person asks for: identify a log, see a demonstration, find benchmark data."""

from stickslip.jobs.demo import Demonstration, demonstrate
from stickslip.jobs.identify import identify
from stickslip.jobs.json_file import json_text, write_json
from stickslip.logs import AxisSchema, find_benchmark
from stickslip.report import write_report

__all__ = [
    "AxisSchema",
    "Demonstration",
    "demonstrate",
    "find_benchmark",
    "identify",
    "json_text",
    "write_json",
    "write_report",
]
