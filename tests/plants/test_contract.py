"""The contract of every plant of the registry."""

import dataclasses

import numpy as np
import pytest

from stickslip.friction import CoulombViscousFriction
from stickslip.plants.registry import PLANTS
from stickslip.simulation import PlantStepper, sensitivity_names, simulate

FREE = CoulombViscousFriction.symmetric(coulomb_friction=0.0, viscous_friction=0.0)
MOMENTUM = 1e-12  # relative: rounding of some hundred samples


def plant_of(name, **change):
    values = {each: 1.5 + k for k, each in enumerate(PLANTS[name].parameter_names)}
    return PLANTS[name](**(values | {"friction": FREE} | change))


@pytest.mark.parametrize("name", PLANTS)
def test_plant_is_a_frozen_record_with_the_named_parameters(name):
    plant = plant_of(name)
    fields = {each.name for each in dataclasses.fields(plant)}
    assert fields == {*plant.parameter_names, "friction", "kind"}
    assert plant.flexible == ("stiffness" in plant.parameter_names)
    assert plant.kind == "linear"
    with pytest.raises(dataclasses.FrozenInstanceError):
        plant.friction = FREE


@pytest.mark.parametrize("name", PLANTS)
def test_state_has_the_named_values(name):
    plant = plant_of(name)
    start = tuple(0.1 * (k + 1) for k in range(len(plant.state_names)))
    motion = simulate(plant, [0.0], sampling_time=0.01, initial_state=start)
    assert tuple(float(getattr(motion, each)[0]) for each in plant.state_names) == start
    stepper = PlantStepper(plant, sampling_time=0.01)
    _, output = stepper.step(stepper.init(start), 0.0)
    assert len(output) == len(plant.state_names)
    structure = sensitivity_names(plant)[: len(plant.parameter_names)]
    assert structure == plant.parameter_names


@pytest.mark.parametrize("name", PLANTS)
def test_momentum_without_friction_is_the_impulse_of_the_effort(name):
    plant = plant_of(name)
    effort = np.sin(np.arange(300) * 0.1)
    motion = simulate(plant, effort, sampling_time=0.01)
    masses = [getattr(plant, each) for each in plant.parameter_names if each.startswith("mass")]
    signals = (motion.velocity, motion.load_velocity)
    momentum = sum(m * v for m, v in zip(masses, signals, strict=False))
    impulse = np.concatenate([[0.0], np.cumsum(effort) * 0.01])
    np.testing.assert_allclose(momentum, impulse, rtol=0, atol=MOMENTUM * np.abs(impulse).max())
