"""Every way to simulate gives the same numbers, for every friction law on every plant."""

import dataclasses
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from law_plants import DAHL, LAWS, LUGRE, STRIBECK, plant_of, random_plant
from laws import uneven
from numpy.random import default_rng
from refusals import refuses

from stickslip.compiled import compiled
from stickslip.friction import CoulombViscousFriction, FrictionLaw
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.records import EventBudgetError
from stickslip.simulation import (
    PlantStepper,
    Sensors,
    simulate,
    simulate_batch,
    simulate_closed_loop,
)

SAME = dict.fromkeys(LAWS, 1e-9)  # of the largest value: what errors of 1e-11 a step add up to
SAME["elasto-plastic"] = 1e-7  # its alpha has kinks in its slope, where steps are less accurate
INTEGRATED = [(name, arm) for name in LAWS for arm in (False, True)]
AFFINE = uneven(coulomb=(0.1, 0.15), static=(0.13, 0.15), viscous=(0.05, 0.02), offset=0.01)
ARM = FlexibleArm(mass_1=1.0, mass_2=0.8, stiffness=2.0, friction=AFFINE)
MASS = SingleMass(mass=1.0, friction=AFFINE)
T = 1e-3
PLANTS = [
    *((plant, step, 0.5) for plant in (MASS, ARM) for step in (0.01, 0.25, 2.0)),
    *((plant_of(LAWS[name], arm=arm), T, 3.0) for name, arm in INTEGRATED),
]
"""With a sampling time and the largest effort."""

NAMES = ("position", "velocity", "load_position", "load_velocity")
plants = pytest.mark.parametrize(("plant", "step", "largest"), PLANTS)
integrated = pytest.mark.parametrize(("name", "arm"), INTEGRATED)


def efforts(seed, count=40, largest=3.0):
    return np.repeat(default_rng(seed).uniform(-largest, largest, count), 10)


def signals(motion):
    found = [getattr(motion, name) for name in (*NAMES, "bristle_deflection")]
    return [signal for signal in found if signal is not None]


def assert_same(motion, batch, row, every):
    """A trajectory of a batch is that of `simulate`, to the last bit."""
    pick = slice(None, None, every) if every else slice(-1, None)
    np.testing.assert_allclose(motion.time[pick], batch.time, rtol=1e-15)
    for name in NAMES:
        alone, together = getattr(motion, name), getattr(batch, name)
        assert (alone is None) == (together is None)
        if alone is not None:
            np.testing.assert_array_equal(alone[pick], together[row])


@plants
def test_single_steps_equal_a_run_to_the_bit(plant, step, largest):
    effort = efforts(1, largest=largest)
    start = (0.1, -0.01, 0.09, 0.02)[: 4 if plant.flexible else 2]
    motion = simulate(plant, effort, sampling_time=step, initial_state=start)
    stepper = PlantStepper(plant, sampling_time=step)
    state, outputs = stepper.init(start), [start]
    for u in effort:
        state, output = stepper.step(state, float(u))
        outputs.append(output)
    for name, stepped in zip(NAMES, np.array(outputs).T, strict=False):
        np.testing.assert_array_equal(stepped, getattr(motion, name))


@plants
@pytest.mark.parametrize(
    ("every", "threads"),
    [(50, 3), *(pytest.param(*case, marks=pytest.mark.slow) for case in ((None, 1), (1, 2)))],
)
def test_a_batch_equals_single_runs_to_the_bit(plant, step, largest, every, threads):
    many = np.stack(
        [efforts(seed, 20, largest) for seed in range(37 if plant in (MASS, ARM) else 3)]
    )
    batch = simulate_batch(plant, many, sampling_time=step, store_every=every, threads=threads)
    for row, effort in enumerate(many):
        assert_same(simulate(plant, effort, sampling_time=step), batch, row, every)


def test_every_trajectory_of_a_batch_may_have_its_own_plant_and_state():
    arms = [dataclasses.replace(ARM, mass_1=1.0 + 0.1 * i, stiffness=1.0 + i) for i in range(20)]
    states = default_rng(4).uniform(-0.3, 0.3, (20, 4))
    effort = efforts(3, largest=0.5)
    batch = simulate_batch(arms, effort, sampling_time=0.1, initial_states=states, store_every=100)
    for row, (plant, state) in enumerate(zip(arms, states, strict=True)):
        motion = simulate(plant, effort, sampling_time=0.1, initial_state=tuple(state.tolist()))
        assert_same(motion, batch, row, 100)


@compiled()
def pd_step(state, sample):
    """A PD controller with an integrator, so that its state matters."""
    error = 0.1 - sample.measured_position
    total = state[0] + 0.01 * error
    return (total,), 50.0 * error + 0.5 * total - 5.0 * sample.measured_velocity


@pytest.mark.parametrize(
    "sensors",
    [
        Sensors(),
        Sensors(position_noise=1e-3, velocity_noise=1e-2, encoder_step=1e-4, delay=2),
        Sensors(encoder_step=1e-4, velocity="differences", delay=1, load=False),
    ],
    ids=["ideal", "noisy", "differences"],
)
@pytest.mark.parametrize(
    "plant", [MASS, ARM, *(plant_of(LAWS[name], arm=arm) for name, arm in INTEGRATED)]
)
def test_closed_loops_agree_to_the_bit_and_log_what_sensors_record(plant, sensors):
    runs = [
        simulate_closed_loop(
            plant,
            SimpleNamespace(init=lambda: (0.0,), step=step),
            sampling_time=T,
            samples=300,
            sensors=sensors,
            generator=default_rng(1),
        )
        for step in (pd_step, pd_step.py_func)
    ]
    assert runs[0].controller_state == runs[1].controller_state
    log = sensors.measure(runs[0].motion, default_rng(1))
    for run in runs:
        np.testing.assert_array_equal(run.motion.position, runs[0].motion.position)
        np.testing.assert_array_equal(run.log.time, log.time)
        np.testing.assert_array_equal(run.log.effort, log.effort)
        for name in NAMES:
            expected, found = (getattr(each, f"measured_{name}") for each in (log, run.log))
            assert (expected is None) == (found is None)
            if expected is not None:
                np.testing.assert_array_equal(found, expected)
    assert runs[0].motion.position[-1] > 0.05


@integrated
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


@integrated
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
    effort = 3.0 * np.sin(2 * np.pi * T * np.arange(2000))
    motion = simulate(plant_of(LAWS[name], arm=False), effort, sampling_time=T)
    moving = np.sign(motion.velocity[np.abs(motion.velocity) > 1e-3])
    turns = int(np.count_nonzero(np.diff(moving)))
    modes = motion.event_mode[motion.event_mode != 0]
    assert np.count_nonzero(np.diff(modes)) >= turns > 2
    for at, mode in zip(motion.event_time[1:], motion.event_mode[1:], strict=True):
        k = int(at / T)
        if mode != 0 and k + 2 < motion.velocity.size:
            assert mode * motion.velocity[k + 1] > 0.0
    assert not motion.any_grazing


EFFORTS = np.zeros((37, 500))


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"commanded_efforts": EFFORTS * np.nan}, "effort_not_finite"),
        ({"commanded_efforts": np.zeros((2, 3, 4))}, "efforts_not_a_matrix"),
        ({"plants": [ARM, MASS]}, "mixed_batch"),
        ({"plants": [MASS, dataclasses.replace(MASS, friction=DAHL)]}, "mixed_batch"),
        ({"plants": []}, "mixed_batch"),
        ({"plants": [ARM] * 3}, "unequal_batch"),
        ({"initial_states": np.zeros((2, 4))}, "unequal_batch"),
        ({"initial_states": np.zeros((1, 2))}, "wrong_length"),
        ({"store_every": 0}, "out_of_range"),
        ({"store_every": 501}, "out_of_range"),
        ({"threads": 0}, "not_whole"),
        ({"sampling_time": -1.0}, "not_positive"),
    ],
)
def test_a_batch_rejects_what_does_not_fit_together(options, code):
    arguments = {"plants": ARM, "commanded_efforts": EFFORTS, "sampling_time": 0.1} | options
    of, what = arguments.pop("plants"), arguments.pop("commanded_efforts")
    with refuses(code):
        simulate_batch(of, what, **arguments)


def test_a_step_budget_and_the_range_of_floats_are_limits():
    plant = plant_of(LUGRE, arm=True)
    with refuses("motion_overflows"):
        simulate(plant, np.full(5, 1e308), sampling_time=10.0)
    with refuses("event_budget", EventBudgetError, event_budget=3, time=0.0):
        simulate(plant, np.array([3.0]), sampling_time=0.1, event_budget=3)
    with refuses("event_budget", EventBudgetError, where="trajectory 1"):
        simulate_batch(plant, np.array([[0.0], [3.0]]), sampling_time=0.1, event_budget=3)


def test_rejects_a_law_it_does_not_know():
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

    with refuses("law_not_simulated", law="Other"):
        simulate(SingleMass(mass=1.0, friction=Other()), np.zeros(1), sampling_time=0.1)


def test_rejects_a_plant_it_does_not_know():
    class Other(SingleMass):
        """Without kernels of its own."""

    with refuses("plant_not_simulated", plant="Other"):
        simulate(Other(mass=1.0, friction=STRIBECK), np.zeros(1), sampling_time=0.1)


@pytest.mark.usefixtures("without_shape_checks")
@pytest.mark.parametrize("static", [0.0, 1e-9])
@pytest.mark.parametrize("side", ["positive", "negative"])
def test_static_friction_needs_a_stribeck_velocity_to_join_it_to_coulomb_friction(side, static):
    sliding = dataclasses.replace(
        CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=0.4),
        **{f"static_friction_{side}": 1.0 + static},
    )
    plant = SingleMass(mass=1.0, friction=dataclasses.replace(LUGRE, sliding=sliding))
    if not static:
        assert simulate(plant, np.full(9, 2.0), sampling_time=T).position[-1] > 0.0
        return
    with refuses("static_friction_without_stribeck"):
        simulate(plant, np.zeros(1), sampling_time=T)
