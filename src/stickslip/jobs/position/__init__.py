"""A positioning task from a scenario file: read it, run it, judge it."""

from stickslip.jobs.position.run import position

__all__ = ["position"]
