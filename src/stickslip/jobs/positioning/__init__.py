"""A positioning task from a scenario file: run it, judge it."""

from stickslip.jobs.positioning.run import position
from stickslip.scenario import ScenarioFile, read_scenario

__all__ = ["ScenarioFile", "position", "read_scenario"]
