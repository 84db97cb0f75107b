"""The input energy is what is stored and what friction dissipates, to rounding."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from law_plants import stored_energy
from laws import uneven
from numpy.random import default_rng

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.simulation import simulate

ROUNDING = 1e-13  # of all the energy that went in and out
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)  # exact to rounding on pieces this smooth


def random_run(seed, *, arm):
    rng = default_rng(seed)
    fc = rng.uniform(0.05, 0.5, 2)
    law = uneven(
        coulomb=fc,
        static=(fc[0] * 1.2, fc[1]),
        viscous=(rng.uniform(0.0, 0.5), rng.uniform(0.0, 0.5)),
        offset=rng.uniform(-0.1, 0.1),
    )
    effort = rng.uniform(-1.5, 1.5, 10)
    T = rng.uniform(0.05, 0.8)
    if arm:
        plant = FlexibleArm(mass_1=1.0, mass_2=rng.uniform(0.3, 3.0), stiffness=1.5, friction=law)
        return plant, effort, T, tuple(rng.uniform(-0.3, 0.3, 4).tolist())
    return SingleMass(mass=1.3, friction=law), effort, T, (0.0, 0.4)


def velocity_at(plant, state, effort, times):
    """Velocities within a sample, each by one sample of its own length."""
    return np.array(
        [
            simulate(plant, [effort], sampling_time=t, initial_state=state).velocity[-1]
            for t in times
        ]
    )


def dissipated(plant, motion):
    """Friction's energy by Gauss quadrature of (fc + c |v|) |v| between all events."""
    law = plant.friction
    total = 0.0
    for k, effort in enumerate(motion.commanded_effort):
        start, stop = motion.time[k], motion.time[k] + motion.sampling_time
        inside = (motion.event_time > start) & (motion.event_time < stop)
        breaks = np.concatenate(([start], motion.event_time[inside], [stop]))
        state = [motion.position[k], motion.velocity[k]]
        if motion.load_position is not None:
            state += [motion.load_position[k], motion.load_velocity[k]]
        for a, b in pairwise(breaks):
            times = 0.5 * (b - a) * (NODES + 1.0) + (a - start)
            if b - a < 1e-12:
                continue
            v = velocity_at(plant, tuple(map(float, state)), effort, times)
            power = law.friction(v) * v
            total += 0.5 * (b - a) * float(WEIGHTS @ power)
    return total


@pytest.mark.parametrize("arm", [False, True])
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_input_energy_is_stored_plus_dissipated(seed, arm):
    plant, effort, T, state = random_run(seed, arm=arm)
    motion = simulate(plant, effort, sampling_time=T, initial_state=state)
    steps = np.diff(motion.position)
    given_in = (effort - plant.friction.offset) * steps  # exact under zero-order hold
    energy = stored_energy(plant, motion)
    lost = dissipated(plant, motion)
    balance = given_in.sum() - (energy[-1] - energy[0]) - lost
    scale = np.abs(given_in).sum() + energy.max() + lost
    assert lost > 0.0
    assert abs(balance) <= ROUNDING * scale


@pytest.mark.parametrize("arm", [False, True])
def test_without_viscous_friction_the_loss_is_force_times_path(arm):
    """Every reversal found, also inside a sample: the path is then known from the events."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.2, viscous_friction=0.0)
    effort = default_rng(5).uniform(-1.0, 1.0, 400)
    if arm:
        plant = FlexibleArm(mass_1=0.3, mass_2=1.0, stiffness=4.0, friction=law)
    else:
        plant = SingleMass(mass=0.3, friction=law)
    motion = simulate(plant, effort, sampling_time=0.5)
    fine = simulate(plant, np.repeat(effort, 256), sampling_time=0.5 / 256)
    energy = stored_energy(plant, motion)
    given_in = float(effort @ np.diff(motion.position))
    loss = given_in - energy[-1]
    path = float(np.abs(np.diff(fine.position)).sum())
    # A reversal inside one of the short samples hides some of the path: second order in its length
    assert 0.2 * path == pytest.approx(loss, rel=2e-4)
    assert 0.2 * path <= loss


def test_a_frictionless_arm_keeps_its_energy_over_a_million_samples():
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.0, viscous_friction=0.0)
    arm = FlexibleArm(mass_1=1.0, mass_2=2.0, stiffness=3.0, friction=law)
    motion = simulate(
        arm, np.zeros(1_000_000), sampling_time=0.01, initial_state=(0.0, 0.5, 0.4, -0.3)
    )
    energy = stored_energy(arm, motion)
    momentum = 1.0 * motion.velocity + 2.0 * motion.load_velocity
    assert np.ptp(energy) <= 1e-12 * energy[0]
    assert np.ptp(momentum) <= 1e-14
