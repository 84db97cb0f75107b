"""A positioning task from a scenario file: read it, run it, judge it."""

from stickslip.jobs.positioning.run import position
from stickslip.jobs.positioning.scenario import ScenarioFile, read_scenario

__all__ = ["ScenarioFile", "position", "read_scenario"]
