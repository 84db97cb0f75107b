"""The smallest scenario of every controller of the registries."""

from typing import Any

from stickslip.records import SensorSample
from stickslip.scenario import (
    ARM_CONTROLLERS,
    AXES,
    AXIS_CONTROLLERS,
    Controller,
    GuessTable,
    Scenario,
    SensorsTable,
    TaskTable,
    Variants,
    table_from,
)

AXIS: dict[str, Any] = {
    "mass": 150.0,
    "coulomb_friction": 100.0,
    "viscous_friction": 700.0,
    "static_friction": 130.0,
}
ARM: dict[str, Any] = {
    "mass": 1.0,
    "load_mass": 1.0,
    "stiffness": 1.0,
    "coulomb_friction": 0.15,
    "viscous_friction": 0.1,
}
GAINS = {"position_gain": 1e4, "velocity_gain": 1e3}
PID = {**GAINS, "integral_gain": 1e4}
# What a method needs beside the effort limit
NEEDED: dict[str, dict[str, Any]] = {
    "pd": GAINS,
    "pid": PID,
    "pid-dither": {**PID, "dither_amplitude": 20.0, "dither_frequency": 20.0},
    "pid-reset": {**PID, "reset_law": "coulomb", "reset_speed": 1e-4},
}
METHODS = [
    *((AXIS_CONTROLLERS, method) for method in AXIS_CONTROLLERS.models),
    *((ARM_CONTROLLERS, method) for method in ARM_CONTROLLERS.models),
]


def scenario(variants: Variants[Controller], method: str) -> Scenario:
    """Return the smallest scenario of a method."""
    arm = variants is ARM_CONTROLLERS
    limit = {"method": method, "effort_limit": 1.0 if arm else 300.0}
    task = (1.0, 1e-3, 24.0, 0.05) if arm else (0.05, 1e-4, 2.0, 0.01)
    table = table_from(variants, limit | NEEDED.get(method, {}), name="controller", kind="linear")
    guesses = {"mass": 150.0, "coulomb_friction": 80.0, "viscous_friction": 500.0}
    known = {} if arm else {n: v for n, v in guesses.items() if n in table.used()}
    return Scenario(
        axis=table_from(AXES, ARM if arm else AXIS, name="axis", kind="linear"),
        task=TaskTable(target=task[0], tolerance=task[1], duration=task[2], sampling_time=task[3]),
        sensors=SensorsTable(),
        controller=table,
        guess=GuessTable(**known),
    )


class Interpreted:
    """A controller whose loop is not compiled, which would take longer than a short run."""

    def __init__(self, controller: Any) -> None:
        self.init, self._step = controller.init, controller.step

    def step(self, state: Any, sample: SensorSample) -> Any:
        return self._step(state, sample)
