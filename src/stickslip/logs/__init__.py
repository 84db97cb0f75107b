"""Readers: any log of a motion axis to an `AxisLog` in SI units, and back to a file."""

from stickslip.logs.benchmarks import find_benchmark
from stickslip.logs.reading import log_from_frame, read_axes, read_log
from stickslip.logs.schema import AxisSchema, LogSchema, read_schema
from stickslip.logs.writing import write_csv

__all__ = [
    "AxisSchema",
    "LogSchema",
    "find_benchmark",
    "log_from_frame",
    "read_axes",
    "read_log",
    "read_schema",
    "write_csv",
]
