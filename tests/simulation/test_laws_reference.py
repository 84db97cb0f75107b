"""Plants whose friction law is not affine, against SciPy, closed forms and the exact simulator."""

import dataclasses

import numpy as np
import pytest
from integrated_laws import with_bristles, with_stiction
from law_plants import DAHL, LAWS, LUGRE, PLASTIC, STRIBECK, plant_of, random_law, random_plant
from numpy.random import default_rng

from stickslip.friction import CoulombViscousFriction, StribeckFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.simulation import simulate
from stickslip.simulation.kernels.law_step import STAGES, law_fields, rosenbrock_step
from stickslip.simulation.plant_kernels import kernel_model

AGAINST_SCIPY = 2e-8  # of the largest value: SciPy steps over the kinks at reversals
EXACT = 1e-10  # of the largest value: what steps to 1e-11 add up to
CLOSED_FORM = 1e-9  # of the largest deflection
BRISTLES = [name for name, law in LAWS.items() if law.bristles is not None]
STICKING = [name for name in LAWS if name not in BRISTLES]


def close(found, reference, tolerance):
    assert np.abs(found - reference).max() <= tolerance * np.abs(reference).max()


def steps_of_effort(rng, count, largest):
    """Efforts that change every few samples."""
    return np.repeat(rng.uniform(-largest, largest, count), 3)


@pytest.mark.parametrize("arm", [False, True])
@pytest.mark.parametrize("name", BRISTLES)
def test_bristles_agree_with_scipy(name, arm):
    rng = default_rng([len(name), arm])
    plant, T = random_plant(rng, name, arm=arm), 2e-3
    effort = steps_of_effort(rng, 8, 4.0)
    reference = with_bristles(plant, effort, T)
    motion = simulate(plant, effort, sampling_time=T)
    close(motion.position, reference[:, 0], AGAINST_SCIPY)
    close(motion.velocity, reference[:, 1], AGAINST_SCIPY)
    close(motion.bristle_deflection, reference[:, 2], AGAINST_SCIPY)
    if arm:
        close(motion.load_position, reference[:, 3], AGAINST_SCIPY)
        close(motion.load_velocity, reference[:, 4], AGAINST_SCIPY)


@pytest.mark.parametrize("arm", [False, True])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", STICKING)
def test_a_law_that_sticks_agrees_with_scipy(name, seed, arm):
    rng = default_rng([seed, arm])
    plant, T = random_plant(rng, name, arm=arm), 0.02
    effort = steps_of_effort(rng, 8, 4.0)
    reference, changes = with_stiction(plant, effort, T)
    motion = simulate(plant, effort, sampling_time=T)
    assert motion.event_count == changes >= 2
    close(motion.position, reference[:, 0], EXACT)
    close(motion.velocity, reference[:, 1], EXACT)
    if arm:
        close(motion.load_position, reference[:, 2], EXACT)
        close(motion.load_velocity, reference[:, 3], EXACT)


@pytest.mark.parametrize("arm", [False, True])
@pytest.mark.parametrize("seed", range(15))
def test_stribeck_without_a_step_is_the_exact_simulator(seed, arm):
    rng = default_rng([seed, arm])
    law = random_law(rng, "Stribeck")
    assert isinstance(law, StribeckFriction)
    values = {
        name: getattr(law, name.replace("static", "coulomb"))
        for name in CoulombViscousFriction.__dataclass_fields__
    }
    exact = CoulombViscousFriction(**values)
    affine = StribeckFriction(**values, stribeck_velocity=law.stribeck_velocity, shape=law.shape)
    plant = SingleMass(mass=1.3, friction=exact)
    if arm:
        plant = FlexibleArm(mass_1=1.3, mass_2=0.7, stiffness=50.0, friction=exact)
    effort = steps_of_effort(rng, 30, 4.0)
    T = 10.0 ** rng.uniform(-3.0, -1.0)
    motion = simulate(plant, effort, sampling_time=T)
    other = simulate(dataclasses.replace(plant, friction=affine), effort, sampling_time=T)
    close(other.position, motion.position, EXACT)
    close(other.velocity, motion.velocity, EXACT)
    np.testing.assert_array_equal(other.event_mode, motion.event_mode)
    np.testing.assert_allclose(other.event_time, motion.event_time, atol=EXACT * motion.time[-1])
    np.testing.assert_array_equal(other.stuck, motion.stuck)


@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_dahl_follows_its_closed_form_between_reversals(exponent):
    # dF/dx = sigma (1 - s F/fc)^i: with q = 1 - s F/fc, q decays as exp(-sigma s dx/fc) for i = 1,
    # and 1/q grows by sigma s dx/fc for i = 2; whatever the velocities
    law = dataclasses.replace(DAHL, exponent=exponent)
    rng = default_rng(1)
    effort = 1.5 * np.sin(2 * np.pi * 5.0 * np.arange(2000) * 1e-3) + rng.normal(0.0, 0.1, 2000)
    motion = simulate(SingleMass(mass=1.0, friction=law), effort, sampling_time=1e-3)
    one_way = np.ones(2000, dtype=bool)
    one_way[np.floor(motion.event_time / 1e-3).astype(int)] = False
    s = np.sign(motion.velocity[:-1])
    one_way &= s == np.sign(motion.velocity[1:])
    assert np.count_nonzero(one_way) > 1500
    q = 1.0 - s * law.bristle_stiffness * motion.bristle_deflection[:-1]
    way = law.bristle_stiffness * s * np.diff(motion.position)
    after = q * np.exp(-way) if exponent == 1.0 else 1.0 / (1.0 / q + way)
    expected = s * (1.0 - after)
    found = law.bristle_stiffness * motion.bristle_deflection[1:]
    np.testing.assert_allclose(found[one_way], expected[one_way], atol=CLOSED_FORM)


@pytest.mark.parametrize("law", [LUGRE, PLASTIC, STRIBECK], ids=["LuGre", "elasto-plastic", "Str"])
@pytest.mark.parametrize("effort", [-3.0, 1.6, 2.0])
def test_steady_motion_is_on_the_stribeck_curve(law, effort):
    motion = simulate(plant_of(law, arm=False), np.full(400, effort), sampling_time=0.1)
    velocity = motion.velocity[-1]
    assert velocity * effort > 0
    assert law.friction([velocity])[0] == pytest.approx(
        effort, rel=1e-6
    )  # e^-16 of the start is left


def test_the_method_is_of_order_five():
    plant = plant_of(dataclasses.replace(LUGRE, bristle_stiffness=1e3), arm=True)
    m = law_fields(kernel_model(plant, 1e-2, 1000))
    work, start = np.empty((STAGES + 1, 5)), np.array([0.0, 2e-3, 1e-4, 0.0, 0.01])

    def after(steps):
        y, new = start.copy(), np.empty(5)
        for _ in range(steps):
            rosenbrock_step(m, 1.0, 8.0, y, 4e-3 / steps, work, new)
            y[:] = new
        return y

    reference = after(4096)
    scale = np.array([m.typical_v, m.typical_v, m.typical_z, 1e-3, 1e-3])
    errors = [np.linalg.norm((after(n) - reference) / scale) for n in (16, 32, 64)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 4.7), (orders, errors)
