"""What a controller is built for: the axis, the task, the sensors and the first guesses."""

from dataclasses import dataclass

from stickslip.records import AxisKind
from stickslip.scenario.axis import Axis
from stickslip.scenario.guess import GuessTable
from stickslip.scenario.task import SensorsTable, TaskTable

__all__ = ["Setup"]

_STILL = 0.01
"""Share of the tolerance: an axis on bristles that moves no farther rests."""


@dataclass(frozen=True, kw_only=True)
class Setup:
    """All tables of a positioning task but that of the controller.

    Attributes
    ----------
    axis, task, sensors, guess
        The tables.
    """

    axis: Axis
    task: TaskTable
    sensors: SensorsTable
    guess: GuessTable

    @property
    def kind(self) -> AxisKind:
        """``"linear"`` or ``"rotary"``."""
        return self.axis.kind

    @property
    def still(self) -> float:
        """How far an axis that rests may move [m or rad]; on bristles nothing rests exactly."""
        return _STILL * self.task.tolerance if self.axis.bristles else 0.0
