"""The pulse controllers on an axis that MuJoCo moves, whose friction holds truly."""

from types import ModuleType

import numpy as np
import pytest
from mujoco_example import mujoco_example

from stickslip import CoulombViscousFriction, SingleMass, simulate

MUJOCO_TOLERANCE = 2e-6
"""Of positions after pulses of some mm [m]: its steps are of 1 ms, its friction yields a little.
Found was 6.6e-7."""

SENSOR_MARGIN = 2e-6
"""By which the true position may be off more than the mean of 5 measured ones [m]: 4 standard
deviations."""

STARTS = (-0.018, -0.004, 0.0006, 0.01)
"""Off the target [m], as far as on the random axes of the comparison."""


@pytest.fixture(scope="module")
def example() -> ModuleType:
    return mujoco_example("05_pulses_on_a_mujoco_axis")


def test_friction_yields_as_it_comes_and_holds_as_it_is_set(example: ModuleType) -> None:
    assert example.creep(example.MuJoCoAxis(stiff="", noslip="")) > 0.03
    assert 1e-6 < example.creep(example.MuJoCoAxis(noslip="")) < 1e-5
    assert example.creep(example.MuJoCoAxis()) == 0.0


def test_pulses_move_the_axis_as_the_exact_simulator_says(example: ModuleType) -> None:
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=example.COULOMB, viscous_friction=example.VISCOUS
    )
    efforts = [300.0] * 5 + [0.0] * 30 + [105.0] * 2 + [0.0] * 30 + [-200.0] * 3 + [0.0] * 30
    motion = simulate(SingleMass(mass=example.MASS, friction=law), efforts, sampling_time=example.T)
    axis = example.MuJoCoAxis()
    places = [axis.position]
    for effort in efforts:
        axis.push(effort, example.T)
        places.append(axis.position)
    assert np.abs(np.array(places) - motion.position).max() < MUJOCO_TOLERANCE


def test_it_breaks_away_at_the_coulomb_friction(example: ModuleType) -> None:
    axis = example.MuJoCoAxis()
    axis.push(0.999 * example.COULOMB, 1.0)
    assert axis.position == 0.0
    axis.push(1.001 * example.COULOMB, 1.0)
    assert axis.position > 0.0


@pytest.mark.parametrize("name", ["PAPWC", "exact"])
@pytest.mark.parametrize("start", STARTS)
def test_pulses_land_within_the_tolerance(example: ModuleType, name: str, start: float) -> None:
    axis = example.MuJoCoAxis()
    axis.place(start)
    controller = example.controllers()[name]
    state = example.run(axis, controller, seed=5)
    assert controller.outcome(state).value == "reached"
    assert abs(axis.position) < example.TOLERANCE + SENSOR_MARGIN
    if name == "exact":
        assert controller.pulse_count(state) <= 3
        found = controller.estimates(state)["coulomb_friction_positive" if start < 0
                                            else "coulomb_friction_negative"]  # fmt: skip
        assert found == pytest.approx(example.COULOMB, rel=0.03)


def test_pulses_of_one_effort_go_to_and_fro(example: ModuleType) -> None:
    axis = example.MuJoCoAxis()
    axis.place(example.START)
    controller = example.controllers()["PWC"]
    state = example.run(axis, controller, seed=1)
    assert controller.outcome(state).value == "moving"
    assert controller.pulse_count(state) > 20
    assert abs(axis.position) > example.TOLERANCE
