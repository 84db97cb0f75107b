"""Readers: any log of a motion axis to an `AxisLog` in SI units, and back to a file."""

from stickslip.logs.reading import log_from_frame, read_log
from stickslip.logs.schema import AxisSchema, LogSchema, read_schema

__all__ = [
    "AxisSchema",
    "LogSchema",
    "log_from_frame",
    "read_log",
    "read_schema",
]
