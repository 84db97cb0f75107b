"""The contract of every friction law of the registry, on every plant of theirs."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from law_plants import random_law
from numpy.random import default_rng
from scipy.optimize import brentq

from stickslip.friction import CoulombViscousFriction, FrictionLaw
from stickslip.friction.registry import LAWS
from stickslip.plants.registry import PLANTS
from stickslip.scenario import AXES
from stickslip.simulation import simulate

STEADY = 1e-6  # relative, after 30 times the slowest time constant, of errors 1e-9 a step
CREEP = 1e-4  # m: some bends of the bristles, which swing without damping in Dahl's law
SLOPE = 1e-6  # of a central difference at speeds where the Stribeck effect is gone
speeds = st.floats(1e-9, 1e3).flatmap(lambda v: st.sampled_from([v, -v]))


def law_of(name: str, seed: int = 0) -> FrictionLaw:
    """Return a law of random values that differ in both directions, with an offset."""
    rng = default_rng(seed)
    if name == "coulomb":
        forward, backward, *viscous = rng.uniform(0.5, 2.0, 4)
        return CoulombViscousFriction(
            coulomb_friction_positive=forward,
            coulomb_friction_negative=backward,
            static_friction_positive=1.3 * forward,
            static_friction_negative=1.1 * backward,
            viscous_friction_positive=viscous[0],
            viscous_friction_negative=viscous[1],
            offset=float(rng.normal(scale=0.2)),
        )
    names = {"stribeck": "Stribeck", "dahl": "Dahl", "lugre": "LuGre"}
    return random_law(rng, names.get(name, name))


def force(law: FrictionLaw, velocity: float) -> float:
    """Return the friction at one velocity."""
    return float(law.friction([velocity])[0])


def plant_of(name: str, law: FrictionLaw):
    """Return a plant of the registry with every mass 1 kg and a spring of 50 N/m."""
    parameters = dict.fromkeys(PLANTS[name].parameter_names, 1.0)
    if "stiffness" in parameters:
        parameters["stiffness"] = 50.0
    return PLANTS[name](**parameters, friction=law)


def test_every_law_has_a_table_in_scenarios():
    assert set(AXES.models) == set(LAWS)


@pytest.mark.parametrize("name", LAWS)
def test_law_is_a_frozen_record(name):
    law = law_of(name)
    assert type(law) is LAWS[name]
    assert isinstance(law, FrictionLaw)
    assert hash(law) == hash(law_of(name))
    with pytest.raises(dataclasses.FrozenInstanceError):
        law.offset = 1.0


@pytest.mark.parametrize("name", LAWS)
@given(velocity=speeds, seed=st.integers(0, 20))
def test_friction_opposes_motion_and_mirrors(name, velocity, seed):
    law = law_of(name, seed)
    opposing = force(law, velocity)
    assert opposing * velocity > 0.0
    mirrored = law.mirrored()
    assert force(mirrored, -velocity) == -opposing
    assert mirrored.offset == -law.offset
    assert mirrored.breakaway() == law.breakaway()[::-1]
    assert mirrored.mirrored() == law


@pytest.mark.parametrize("name", LAWS)
def test_friction_at_rest_when_motion_begins_and_at_high_speed(name):
    law = law_of(name)
    assert force(law, 0.0) == 0.0
    assert law.friction(np.ones((2, 3))).shape == (2, 3)
    forward, backward = law.breakaway()
    assert 0.0 < force(law, 1e-15) <= forward + 1e-9
    assert 0.0 < -force(law, -1e-15) <= backward + 1e-9
    for sign, side in ((1.0, "positive"), (-1.0, "negative")):
        v, h = 3.0 * sign, 1e-3
        slope = (force(law, v + h) - force(law, v - h)) / (2.0 * h)
        viscous = getattr(law.sliding, f"viscous_friction_{side}")
        assert slope == pytest.approx(viscous, rel=SLOPE)


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("name", LAWS)
def test_simulated_axis_settles_at_the_speed_at_which_friction_equals_the_effort(name, plant):
    law = law_of(name)
    effort = law.offset + 2.0 * max(law.breakaway())
    motion = simulate(plant_of(plant, law), np.full(6000, effort), sampling_time=0.05)
    speed = brentq(lambda v: force(law, v) + law.offset - effort, 0.1, 1e3)
    assert motion.velocity[-1] == pytest.approx(speed, rel=STEADY)
    if motion.load_velocity is not None:
        assert motion.load_velocity[-1] == pytest.approx(speed, rel=STEADY)


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("name", LAWS)
def test_simulated_axis_rests_below_the_breakaway_force(name, plant):
    law = law_of(name)
    forward = law.breakaway()[0]
    ramp = forward * np.linspace(0.0, 1.0, 400)
    held, freed = (
        simulate(plant_of(plant, law), law.offset + part * ramp, sampling_time=0.01)
        for part in (0.8, 1.5)
    )
    if law.bristles is None:
        assert not held.position.any()
    assert np.abs(held.position).max() <= CREEP
    assert (law.bristles is None) == (held.bristle_deflection is None)
    assert freed.position[-1] > 100.0 * CREEP
