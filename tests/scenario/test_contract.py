"""The contract of every controller, law and table of a scenario, over their registries."""

from math import isfinite, nan
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from refusals import refuses
from small_scenarios import AXIS, METHODS, Interpreted, scenario

from stickslip.control import PositionController
from stickslip.records import PositioningOutcome, SensorSample
from stickslip.scenario import (
    ARM_CONTROLLERS,
    AXES,
    AXIS_CONTROLLERS,
    Controller,
    FileInput,
    GuessTable,
    Scenario,
    SensorsTable,
    SineInput,
    Table,
    TaskTable,
    Variants,
    table_from,
)
from stickslip.simulation import ClosedLoopRun, simulate_closed_loop

LAW_KEYS: dict[str, Any] = {
    "stribeck_velocity": 0.01,
    "shape": "exponential",
    "bristle_stiffness": 2e7,
    "bristle_damping": 1e4,
    "elastic_deflection": 1e-6,
}
IDS = [f"{variants.where}: {method}" for variants, method in METHODS]
MODELS: list[type[Table]] = [
    *AXES.models.values(),
    *AXIS_CONTROLLERS.models.values(),
    *ARM_CONTROLLERS.models.values(),
    TaskTable,
    SensorsTable,
    GuessTable,
    SineInput,
    FileInput,
]
FOLDER = Path()
LEFT = 0.5  # of the distance to the target, after a run of any controller
EVERY_METHOD = pytest.mark.parametrize(("variants", "method"), METHODS, ids=IDS)


def task_run(asked: Scenario, controller: Any) -> ClosedLoopRun[Any]:
    """Run a controller, step by step in the interpreter, for the task of a scenario."""
    return simulate_closed_loop(
        asked.axis.build(),
        Interpreted(controller),
        sampling_time=asked.task.sampling_time,
        samples=asked.task.samples,
    )


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.__name__)
def test_each_key_is_declared_with_a_meaning(model: type[Table]) -> None:
    assert list(model.declared()) == list(model.model_fields)
    for name, key in model.declared().items():
        assert key.meaning, name
        assert key.meaning[-1] != ".", name


@EVERY_METHOD
def test_a_controller_answers_about_its_state(variants: Variants[Controller], method: str) -> None:
    asked = scenario(variants, method)
    controller: Any = asked.build(FOLDER).controller
    assert isinstance(controller, PositionController)
    run = task_run(asked, controller)
    assert np.max(np.abs(run.log.effort)) <= asked.controller.effort_limit
    target = asked.task.all_targets[0]
    assert abs(target - run.motion.position[-1]) < LEFT * abs(target)
    for state in (controller.init(), run.controller_state):
        outcome = controller.outcome(state)
        assert outcome is None or isinstance(outcome, PositioningOutcome)
        assert controller.why(state) is None or outcome is PositioningOutcome.STOPPED
        estimates = controller.estimates(state)
        assert all(isfinite(value) for value in estimates.values())
        assert set(controller.deviations(state)) <= set(estimates)
        assert (controller.last_pulse(state) is None) == (controller.pulse_count(state) == 0)
    assert not controller.phases(controller.init())


@EVERY_METHOD
def test_a_sample_without_a_position_changes_nothing(
    variants: Variants[Controller], method: str
) -> None:
    controller: Any = scenario(variants, method).build(FOLDER).controller
    before = controller.init()
    after, effort = controller.step(before, SensorSample(0.0, nan, nan, nan, nan))
    assert np.isnan(effort)
    if isinstance(before, np.ndarray):
        np.testing.assert_array_equal(after, before)
    else:
        assert after is before or after == before


@EVERY_METHOD
def test_another_target_is_approached(variants: Variants[Controller], method: str) -> None:
    asked = scenario(variants, method)
    controller: Any = asked.build(FOLDER).controller
    if type(controller).retargeted is PositionController.retargeted:
        assert method == "feedback"  # its reference holds the targets
        return
    target = -asked.task.all_targets[0]
    state = controller.retargeted(controller.init(), target)
    run = task_run(asked, SimpleNamespace(init=lambda: state, step=controller.step))
    assert abs(target - run.motion.position[-1]) < LEFT * abs(target)


@EVERY_METHOD
def test_what_was_learned_is_where_the_next_run_begins(
    variants: Variants[Controller], method: str
) -> None:
    asked = scenario(variants, method)
    controller: Any = asked.build(FOLDER).controller
    assert asked.controller.learns == (type(controller).learned is not PositionController.learned)
    if not asked.controller.learns:
        assert controller.learned(controller.init()) is None
        return
    run = task_run(asked, controller)
    learned = controller.learned(run.controller_state)
    assert set(asked.controller.learned_names) <= set(learned.values)
    again: Any = asked.build(FOLDER, learned).controller
    began = again.estimates(again.init())
    for name, value in learned.values.items():
        if name in began and name != "static_friction":  # an arm keeps its ratio to Coulomb
            assert began[name] == pytest.approx(value, rel=1e-12), name


@EVERY_METHOD
def test_a_key_of_another_method_is_refused_with_its_users(
    variants: Variants[Controller], method: str
) -> None:
    own = variants.models[method]
    for other, model in variants.models.items():
        for name in set(model.model_fields) - set(own.model_fields):
            values = {"method": method, "effort_limit": 300.0, name: 1}
            code = "unused_key"
            with refuses(code, where="[controller]", name=name, tag_value=method) as caught:
                table_from(variants, values, name="controller", kind="linear")
            assert other in caught.value.quantities["users"]


@pytest.mark.parametrize("law", AXES.models)
def test_a_law_takes_its_keys_and_no_others(law: str) -> None:
    model = AXES.models[law]
    body = {n: v for n, v in AXIS.items() if law != "dahl" or n != "static_friction"}
    own = {name: value for name, value in LAW_KEYS.items() if name in model.model_fields}
    axis = table_from(AXES, {**body, "law": law, **own}, name="axis", kind="linear")
    assert type(axis) is model
    assert {name: axis.shown("linear")[name][0] for name in own} == own
    for name in set(LAW_KEYS) - set(own):
        values = {**body, "law": law, **own, name: LAW_KEYS[name]}
        with refuses("unused_key", tag="law", tag_value=law):
            table_from(AXES, values, name="axis", kind="linear")
    for name in own:
        if model.model_fields[name].is_required():
            values = {**body, "law": law, **{n: v for n, v in own.items() if n != name}}
            with refuses("missing_key", name=name, tag_value=law, particular=True):
                table_from(AXES, values, name="axis", kind="linear")
