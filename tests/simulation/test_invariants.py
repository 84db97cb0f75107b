"""Invariants of every plant, effort and sampling time."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from law_plants import stored_energy
from laws import uneven
from numpy.random import default_rng

from stickslip.plants import FlexibleArm, SingleMass
from stickslip.simulation import simulate

EXACT = 1e-13  # of the largest value in a run: what rounding may do
NEAR_GRAZE = 1e-10  # the same where an unflagged near-graze may amplify rounding by up to 1e5
EXAMPLES = settings(max_examples=60, deadline=None)


def draw(seed, *, arm, static=True, offset=True):
    """A random plant, sampling time, initial state and effort."""
    rng = default_rng(seed)
    fc = rng.uniform(0.0, 0.6, 2)
    fs = fc * rng.choice([1.0, 1.3], 2) if static else fc
    law = uneven(
        coulomb=fc,
        static=fs,
        viscous=(rng.choice([0.0, 1e-9, 0.05, 1.0]), rng.choice([0.0, 1e-7, 0.2, 0.7])),
        offset=rng.uniform(-0.2, 0.2) if offset else 0.0,
    )
    T = 10.0 ** rng.uniform(-3.0, 0.3)
    effort = np.repeat(rng.uniform(-1.2, 1.2, 12), rng.integers(1, 9))
    if arm:
        m1, m2, ks = rng.uniform(0.3, 3.0, 3)
        plant = FlexibleArm(mass_1=m1, mass_2=m2, stiffness=ks, friction=law)
        return plant, T, tuple(rng.uniform(-0.5, 0.5, 4).tolist()), effort
    return SingleMass(mass=rng.uniform(0.3, 3.0), friction=law), T, (0.1, -0.2), effort


def signals(motion):
    """Every signal of a motion, with the scale its errors are measured by."""
    pairs = [motion.position, motion.velocity, motion.load_position, motion.load_velocity]
    return [(signal, np.abs(signal).max()) for signal in pairs if signal is not None]


def agree(motion, other, every=1, tolerance=EXACT):
    if motion.any_grazing or other.any_grazing:
        assume(False)
    for (signal, scale), (reference, _) in zip(signals(motion), signals(other), strict=True):
        assert np.abs(signal - reference[::every]).max() <= tolerance * scale


def resting_samples(motion):
    """The samples in which the (first) mass rests from begin to end."""
    events = np.diff(np.searchsorted(motion.event_time, motion.time))
    return np.flatnonzero(motion.stuck[:-1] & motion.stuck[1:] & (events == 0))


SEEDS = st.integers(0, 2**32 - 1)


@pytest.mark.parametrize("arm", [False, True])
@given(seed=SEEDS)
@EXAMPLES
def test_one_sample_of_t_equals_two_of_half_t(seed, arm):
    plant, T, state, effort = draw(seed, arm=arm)
    whole = simulate(plant, effort, sampling_time=T, initial_state=state)
    halves = simulate(plant, np.repeat(effort, 2), sampling_time=T / 2, initial_state=state)
    agree(whole, halves, 2, NEAR_GRAZE)


@pytest.mark.slow
@pytest.mark.parametrize("arm", [False, True])
def test_a_sample_equals_sixty_four_short_ones_in_thousands_of_cases(arm):
    worst = []
    for seed in range(1000):
        plant, T, state, effort = draw(seed, arm=arm)
        coarse = simulate(plant, effort, sampling_time=T, initial_state=state)
        fine = simulate(plant, np.repeat(effort, 64), sampling_time=T / 64, initial_state=state)
        if coarse.any_grazing or fine.any_grazing:
            continue
        assert coarse.event_count == fine.event_count
        np.testing.assert_array_equal(coarse.event_mode, fine.event_mode)
        errors = [
            np.abs(signal - reference[::64]).max() / scale
            for (signal, scale), (reference, _) in zip(signals(coarse), signals(fine), strict=True)
        ]
        worst.append(max(errors))
    assert len(worst) > 990
    assert max(worst) <= EXACT


@pytest.mark.parametrize("arm", [False, True])
@given(seed=SEEDS)
@EXAMPLES
def test_the_mirrored_axis_moves_as_the_mirror_image(seed, arm):
    plant, T, state, effort = draw(seed, arm=arm)
    mirrored = replace(plant, friction=plant.friction.mirrored())
    motion = simulate(plant, effort, sampling_time=T, initial_state=state)
    image = simulate(
        mirrored, -effort, sampling_time=T, initial_state=tuple(-value for value in state)
    )
    for (signal, _), (reference, _) in zip(signals(motion), signals(image), strict=True):
        np.testing.assert_array_equal(signal, -reference)
    np.testing.assert_array_equal(motion.event_mode, -image.event_mode)
    np.testing.assert_array_equal(motion.event_time, image.event_time)


@pytest.mark.parametrize("arm", [False, True])
@given(seed=SEEDS)
@EXAMPLES
def test_the_position_is_bitwise_constant_while_stuck(seed, arm):
    plant, T, state, effort = draw(seed, arm=arm)
    motion = simulate(plant, effort, sampling_time=T, initial_state=state)
    for k in resting_samples(motion):
        assert motion.position[k] == motion.position[k + 1]
        assert motion.velocity[k] == 0.0


@given(seed=SEEDS)
@EXAMPLES
def test_no_force_within_the_static_friction_ever_moves_a_mass(seed):
    plant, T, _, _ = draw(seed, arm=False)
    law = plant.friction
    rng = default_rng(seed)
    low, high = law.offset - law.static_friction_negative, law.offset + law.static_friction_positive
    effort = rng.uniform(low, high, 50)
    within = (effort - law.offset >= -law.static_friction_negative) & (
        effort - law.offset <= law.static_friction_positive
    )
    motion = simulate(plant, effort[within], sampling_time=T, initial_state=(0.3, 0.0))
    assert np.all(motion.position == 0.3)
    assert motion.event_count == 0


@given(seed=SEEDS, tension=st.floats(0.0, 0.999))
@EXAMPLES
def test_no_swing_of_the_load_within_the_static_friction_moves_the_first_mass(seed, tension):
    plant, T, _, _ = draw(seed, arm=True, offset=False)
    reach = plant.friction.breakaway()
    amplitude = tension * min(reach) / plant.stiffness
    motion = simulate(
        plant, np.zeros(200), sampling_time=T, initial_state=(0.25, 0.0, 0.25 + amplitude, 0.0)
    )
    assert np.all(motion.position == 0.25)
    energy = stored_energy(plant, motion)
    assert np.ptp(energy) <= EXACT * 10 * (energy[0] + 1e-300) + 1e-16 * plant.stiffness * amplitude


@given(seed=SEEDS)
@EXAMPLES
def test_the_first_mass_breaks_away_at_the_static_friction_and_not_before(seed):
    plant, T, state, effort = draw(seed, arm=True)
    motion = simulate(plant, effort, sampling_time=T, initial_state=state)
    law = plant.friction
    for k in resting_samples(motion):
        spring = plant.stiffness * (motion.position - motion.load_position)[k : k + 2]
        force = effort[k] - law.offset - spring
        assert np.all(force <= law.static_friction_positive + 1e-12)
        assert np.all(force >= -law.static_friction_negative - 1e-12)


@given(seed=SEEDS, shift=st.floats(-1e3, 1e3))
@EXAMPLES
def test_only_distances_matter(seed, shift):
    plant, T, state, effort = draw(seed, arm=True)
    motion = simulate(plant, effort, sampling_time=T, initial_state=state)
    x1, v1, x2, v2 = state
    moved = simulate(plant, effort, sampling_time=T, initial_state=(x1 + shift, v1, x2 + shift, v2))
    assume(not motion.any_grazing and not moved.any_grazing)
    # The shifted positions are themselves rounded; nothing else may be lost
    tolerance = NEAR_GRAZE * (1.0 + abs(shift))
    np.testing.assert_allclose(moved.position - shift, motion.position, atol=tolerance, rtol=0)
    np.testing.assert_allclose(moved.velocity, motion.velocity, atol=tolerance, rtol=0)
