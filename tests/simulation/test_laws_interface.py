"""Plants whose friction law is not affine behind the interface of all plants."""

import dataclasses
from dataclasses import dataclass

import numpy as np
import pytest
from law_plants import DAHL, LAWS, LUGRE, STRIBECK, plant_of, random_plant
from numpy.random import default_rng

from stickslip.compiled import compiled
from stickslip.friction import CoulombViscousFriction, FrictionLaw
from stickslip.plants import SingleMass
from stickslip.records import EventBudgetError, InputError
from stickslip.simulation import (
    PlantStepper,
    Sensors,
    simulate,
    simulate_batch,
    simulate_closed_loop,
)

SAME = dict.fromkeys(LAWS, 1e-9)  # of the largest value: what errors of 1e-11 a step add up to
SAME["elasto-plastic"] = 1e-7  # its alpha has kinks in its slope, where steps are less accurate
CASES = [(name, arm) for name in LAWS for arm in (False, True)]
T = 1e-3


def efforts(seed, count=40):
    return np.repeat(default_rng(seed).uniform(-3.0, 3.0, count), 10)


def signals(motion):
    pairs = [motion.position, motion.velocity, motion.load_position, motion.load_velocity]
    return [signal for signal in [*pairs, motion.bristle_deflection] if signal is not None]


@pytest.mark.parametrize(("name", "arm"), CASES)
@pytest.mark.parametrize("seed", range(6))
def test_one_sample_of_t_equals_sixteen_of_a_sixteenth(name, arm, seed):
    rng = default_rng([seed, len(name), arm])
    plant = random_plant(rng, name, arm=arm)
    step = 10.0 ** rng.uniform(-3.5, -1.5)
    effort = np.repeat(rng.uniform(-5.0, 5.0, 40), 5)
    motion = simulate(plant, effort, sampling_time=step)
    finer = simulate(plant, np.repeat(effort, 16), sampling_time=step / 16)
    for signal, reference in zip(signals(motion), signals(finer), strict=True):
        assert np.abs(signal - reference[::16]).max() <= SAME[name] * np.abs(reference).max()


@pytest.mark.parametrize(("name", "arm"), CASES)
def test_steps_batch_and_run_are_the_same_to_the_last_bit(name, arm):
    plant, effort = plant_of(LAWS[name], arm=arm), efforts(1)
    start = (0.1, -0.01, 0.09, 0.02)[: 4 if arm else 2]
    motion = simulate(plant, effort, sampling_time=T, initial_state=start)
    stepper = PlantStepper(plant, sampling_time=T)
    state, outputs = stepper.init(start), [start]
    for u in effort:
        state, output = stepper.step(state, float(u))
        outputs.append(output)
    stepped = np.array(outputs).T
    np.testing.assert_array_equal(stepped[0], motion.position)
    np.testing.assert_array_equal(stepped[1], motion.velocity)
    both, starts = np.stack([effort, -effort]), np.array([start])
    batch = simulate_batch(plant, both, sampling_time=T, initial_states=starts, store_every=5)
    np.testing.assert_array_equal(batch.position[0], motion.position[::5])
    np.testing.assert_array_equal(batch.velocity[0], motion.velocity[::5])
    if arm:
        np.testing.assert_array_equal(stepped[3], motion.load_velocity)
        np.testing.assert_array_equal(batch.load_position[0], motion.load_position[::5])


@compiled()
def spring(state: float, sample) -> tuple[float, float]:
    return state, 50.0 * (0.1 - sample.measured_position) - 5.0 * sample.measured_velocity


@dataclass(frozen=True)
class Spring:
    """A controller of a spring and a damper, compiled or not."""

    jitted: bool

    @property
    def step(self):
        return spring if self.jitted else spring.py_func

    def init(self) -> float:
        return 0.0


@pytest.mark.parametrize(("name", "arm"), CASES)
def test_closed_loop_compiled_and_not(name, arm):
    plant = plant_of(LAWS[name], arm=arm)
    runs = [
        simulate_closed_loop(plant, Spring(jitted), sampling_time=T, samples=300, sensors=Sensors())
        for jitted in (True, False)
    ]
    np.testing.assert_array_equal(runs[0].motion.position, runs[1].motion.position)
    np.testing.assert_array_equal(runs[0].log.measured_position, runs[0].motion.position)
    assert (runs[0].log.measured_load_position is not None) == arm
    assert runs[0].motion.position[-1] > 0.05


@pytest.mark.parametrize(("name", "arm"), CASES)
def test_mirrored_plant_moves_the_other_way(name, arm):
    plant = random_plant(default_rng([3, arm]), name, arm=arm)
    mirrored = dataclasses.replace(plant, friction=plant.friction.mirrored())
    motion = simulate(plant, efforts(2), sampling_time=T)
    other = simulate(mirrored, -efforts(2), sampling_time=T)
    for signal, mirror in zip(signals(motion), signals(other), strict=True):
        np.testing.assert_array_equal(signal, -mirror)
    np.testing.assert_array_equal(motion.event_mode, -other.event_mode)


@pytest.mark.parametrize("name", LAWS)
def test_events_are_where_the_velocity_changes_its_sign(name):
    time = np.arange(2000) * T
    motion = simulate(
        plant_of(LAWS[name], arm=False), 3.0 * np.sin(2 * np.pi * time), sampling_time=T
    )
    moving = np.sign(motion.velocity[np.abs(motion.velocity) > 1e-3])
    turns = int(np.count_nonzero(np.diff(moving)))
    modes = motion.event_mode[motion.event_mode != 0]
    assert np.count_nonzero(np.diff(modes)) >= turns > 2
    for at, mode in zip(motion.event_time[1:], motion.event_mode[1:], strict=True):
        k = int(at / T)
        if mode != 0 and k + 2 < motion.velocity.size:
            assert mode * motion.velocity[k + 1] > 0.0
    assert (motion.bristle_deflection is None) == (name == "Stribeck")
    assert not motion.any_grazing


@pytest.mark.parametrize("arm", [False, True])
@pytest.mark.parametrize("law", [STRIBECK, LUGRE], ids=["Stribeck", "LuGre"])
def test_step_ends_in_nan_and_raises_nothing(law, arm):
    stepper = PlantStepper(plant_of(law, arm=arm), sampling_time=T)
    for effort in (np.nan, np.inf, 1e308):
        state, _ = stepper.step(stepper.init(), effort)
        state, _ = stepper.step(state, effort)
        assert np.isnan(state[-1])
        state, _ = stepper.step(state, 0.0)
        assert np.isnan(state[-1])


def test_refusals():
    plant = plant_of(LUGRE, arm=True)
    with pytest.raises(InputError, match="too large for floating-point numbers"):
        simulate(plant, np.full(5, 1e308), sampling_time=10.0)
    with pytest.raises(EventBudgetError, match="more than 3 events or steps in the sample at 0 s"):
        simulate(plant, np.array([3.0]), sampling_time=0.1, event_budget=3)
    with pytest.raises(EventBudgetError, match="of trajectory 1"):
        simulate_batch(plant, np.array([[0.0], [3.0]]), sampling_time=0.1, event_budget=3)
    exact = CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=0.1)
    mixed = [SingleMass(mass=1.0, friction=exact), SingleMass(mass=1.0, friction=DAHL)]
    with pytest.raises(InputError, match="not all of the same class"):
        simulate_batch(mixed, np.zeros(1), sampling_time=0.1)


def test_refuses_a_law_it_does_not_know():
    @dataclass(frozen=True)
    class Other:
        offset: float = 0.0
        affine: bool = False
        sliding: FrictionLaw = STRIBECK
        bristles: None = None

        def breakaway(self):
            return 1.0, 1.0

        def friction(self, velocity):
            return np.zeros_like(velocity)

        def mirrored(self):
            return self

    with pytest.raises(InputError, match="the friction law Other cannot be simulated"):
        simulate(SingleMass(mass=1.0, friction=Other()), np.zeros(1), sampling_time=0.1)


def test_refuses_a_plant_it_does_not_know():
    class Other(SingleMass):
        """Without kernels of its own."""

    with pytest.raises(InputError, match="no kernels for the plant Other"):
        simulate(Other(mass=1.0, friction=STRIBECK), np.zeros(1), sampling_time=0.1)


@pytest.mark.usefixtures("without_shape_checks")
@pytest.mark.parametrize("static", [0.0, 1e-9])
@pytest.mark.parametrize("side", ["positive", "negative"])
def test_refuses_static_friction_that_no_stribeck_velocity_joins_to_coulomb_friction(side, static):
    sliding = dataclasses.replace(
        CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=0.4),
        **{f"static_friction_{side}": 1.0 + static},
    )
    plant = SingleMass(mass=1.0, friction=dataclasses.replace(LUGRE, sliding=sliding))
    if not static:
        assert simulate(plant, np.full(9, 2.0), sampling_time=T).position[-1] > 0.0
        return
    with pytest.raises(InputError, match="needs a Stribeck velocity"):
        simulate(plant, np.zeros(1), sampling_time=T)
