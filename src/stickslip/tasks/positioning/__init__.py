"""A positioning task from a scenario file: run it, judge it."""

from stickslip.scenario import ScenarioFile, read_scenario
from stickslip.tasks.positioning.run import position

__all__ = ["ScenarioFile", "position", "read_scenario"]
