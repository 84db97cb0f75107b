"""The longest step of every guarded controller along a whole move."""

from dataclasses import fields, replace
from pathlib import Path
from time import perf_counter
from typing import Any

from rich.progress import Progress

from benchmarks.measuring import Comparison, Row, Target
from stickslip.control import TrackedBeside
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
from stickslip.simulation import simulate_closed_loop

_REPEATED = 5
"""Times that every step is taken; the shortest counts, as the machine has other work."""
_AXIS_LIMIT, _ARM_LIMIT = 200.0, 1000.0
"""Goals [us]."""
_PLANNING = 0.5  # time for a plan beside the loop [s]
_AXIS = {
    "mass": 150.0,
    "coulomb_friction": 100.0,
    "viscous_friction": 700.0,
    "static_friction": 130.0,
}
_ARM = {
    "mass": 1.0,
    "load_mass": 1.0,
    "stiffness": 1.0,
    "coulomb_friction": 0.15,
    "viscous_friction": 0.1,
}
_GAINS = {"position_gain": 1e4, "velocity_gain": 1e3, "integral_gain": 1e4}


def _scenario(variants: Variants[Controller], method: str) -> Scenario:
    arm = variants is ARM_CONTROLLERS
    given: dict[str, Any] = {"method": method, "effort_limit": 1.0 if arm else 300.0}
    if method == "pid":
        given |= _GAINS
    guesses = {"mass": 150.0, "coulomb_friction": 80.0, "viscous_friction": 500.0}
    target, duration, T = (1.0, 40.0, 0.02) if arm else (0.05, 2.0, 0.001)
    return Scenario(
        axis=table_from(AXES, _ARM if arm else _AXIS, name="axis", kind="linear"),
        task=TaskTable(target=target, tolerance=1e-4, duration=duration, sampling_time=T),
        sensors=SensorsTable(),
        controller=table_from(variants, given, name="controller", kind="linear"),
        guess=GuessTable.model_validate({} if arm or method == "pid" else guesses),
    )


class _Timed:
    """A controller that times its steps."""

    def __init__(self, controller: Any) -> None:
        self._controller = controller
        self.times: list[tuple[float, bool]] = []  # seconds, and whether a plan was made

    def init(self) -> Any:
        return self._controller.init()

    def step(self, state: Any, sample: SensorSample) -> Any:
        begun = perf_counter()
        after, effort = self._controller.step(state, sample)
        shortest = perf_counter() - begun
        for _ in range(_REPEATED - 1):
            begun = perf_counter()
            after, effort = self._controller.step(state, sample)
            shortest = min(shortest, perf_counter() - begun)
        flights = [len(getattr(each.inner, "flights", ())) for each in (state, after)]
        ends = getattr(after.inner, "phases", ())[-1:] != getattr(state.inner, "phases", ())[-1:]
        self.times.append((shortest, flights[0] != flights[1] or (ends and flights[1] > 0)))
        return after, effort


def _beside(controller: Any) -> TrackedBeside:
    settings: dict[str, Any] = {
        each.name: getattr(controller, each.name) for each in fields(controller)
    }
    settings.update(plans_inside=False, planning_time=_PLANNING)
    return TrackedBeside(**settings)


def compare(progress: Progress) -> list[Comparison]:
    """Time each step of a move."""
    asked = [
        (AXIS_CONTROLLERS, "precise", _AXIS_LIMIT),
        (AXIS_CONTROLLERS, "profile", _AXIS_LIMIT),
        (AXIS_CONTROLLERS, "exact", _AXIS_LIMIT),
        (AXIS_CONTROLLERS, "landing", _AXIS_LIMIT),
        (AXIS_CONTROLLERS, "pid", _AXIS_LIMIT),
        (ARM_CONTROLLERS, "landing", _ARM_LIMIT),
        (ARM_CONTROLLERS, "tracked", _ARM_LIMIT),
        (ARM_CONTROLLERS, "feedback", _ARM_LIMIT),
    ]
    task = progress.add_task("longest steps", total=len(asked))
    rows: list[Row] = []
    targets: list[Target] = []
    for variants, method, limit in asked:
        scenario = _scenario(variants, method)
        guarded = scenario.build(Path()).guarded
        if method == "tracked":  # its plans are made beside the loop, and count no less
            guarded = replace(guarded, controller=_beside(guarded.controller))
        guarded.warm_up()
        timed = _Timed(guarded)
        simulate_closed_loop(
            scenario.axis.build(),
            timed,
            sampling_time=scenario.task.sampling_time,
            samples=scenario.task.samples,
        )
        name = f"{method}, {variants.where}"
        beside = method == "tracked"
        steps = sorted(seconds for seconds, plans in timed.times if beside or not plans)
        for which, seconds in (("median", steps[len(steps) // 2]), ("longest", steps[-1])):
            rows.append(
                Row(name=f"{name}: {which} step", nanoseconds=1e9 * seconds, error=None, ours=True)
            )
        plans = [seconds for seconds, planned in timed.times if planned]
        if plans and not beside:
            rows.append(
                Row(
                    name=f"{name}: longest plan",
                    nanoseconds=1e9 * max(plans),
                    error=None,
                    ours=True,
                )
            )
        targets.append(
            Target(text=f"longest step, {name} [µs]", measured=1e6 * steps[-1], limit=limit)
        )
        progress.advance(task)
    return [
        Comparison(
            title="A step of a guarded controller from Python, without those that make a plan",
            item="step",
            error_name=None,
            rows=tuple(rows),
            targets=tuple(targets),
        )
    ]
