"""Scenarios: strict models of the TOML files of tasks and studies, and what is built of them.

The key ``law`` of ``[axis]`` and the key ``method`` of ``[controller]`` choose the model of the
table; unknown and misplaced keys are errors.
"""

from stickslip.scenario.axis import AXES, Axis
from stickslip.scenario.controllers import ARM_CONTROLLERS, AXIS_CONTROLLERS
from stickslip.scenario.controllers.base import Controller
from stickslip.scenario.guess import GuessTable, estimate_in
from stickslip.scenario.scenario import Scenario, ScenarioFile, read_scenario
from stickslip.scenario.study import FileInput, SineInput, StudyFile, check_runs, read_study
from stickslip.scenario.table import Read, Table, Variants, table_from
from stickslip.scenario.task import SensorsTable, TaskTable

__all__ = [
    "ARM_CONTROLLERS",
    "AXES",
    "AXIS_CONTROLLERS",
    "Axis",
    "Controller",
    "FileInput",
    "GuessTable",
    "Read",
    "Scenario",
    "ScenarioFile",
    "SensorsTable",
    "SineInput",
    "StudyFile",
    "Table",
    "TaskTable",
    "Variants",
    "check_runs",
    "estimate_in",
    "read_scenario",
    "read_study",
    "table_from",
]
