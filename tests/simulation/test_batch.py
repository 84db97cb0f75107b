import numpy as np
import pytest

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.records import InputError
from stickslip.simulation import PlantStepper, simulate, simulate_batch

LAW = CoulombViscousFriction(
    coulomb_friction_positive=0.1,
    coulomb_friction_negative=0.15,
    static_friction_positive=0.13,
    static_friction_negative=0.15,
    viscous_friction_positive=0.05,
    viscous_friction_negative=0.02,
    offset=0.01,
)
ARM = FlexibleArm(mass_1=1.0, mass_2=0.8, stiffness=2.0, friction=LAW)
MASS = SingleMass(mass=1.0, friction=LAW)
EFFORTS = np.repeat(np.random.default_rng(3).uniform(-0.5, 0.5, (37, 25)), 20, axis=1)


def assert_same(motion, batch, row, every):
    """A trajectory of a batch is that of `simulate`, to the last bit."""
    pick = slice(None, None, every) if every else slice(-1, None)
    np.testing.assert_array_equal(motion.time[pick], batch.time)
    for name in ("position", "velocity", "load_position", "load_velocity"):
        alone, together = getattr(motion, name), getattr(batch, name)
        if alone is None:
            assert together is None
        else:
            np.testing.assert_array_equal(alone[pick], together[row])


@pytest.mark.parametrize("plant", [MASS, ARM], ids=["mass", "arm"])
@pytest.mark.parametrize("sampling_time", [0.01, 0.25, 2.0])
@pytest.mark.parametrize(("every", "threads"), [(None, 1), (1, 2), (50, 3)])
def test_a_batch_equals_single_runs_to_the_bit(plant, sampling_time, every, threads):
    batch = simulate_batch(
        plant, EFFORTS, sampling_time=sampling_time, store_every=every, threads=threads
    )
    for row, effort in enumerate(EFFORTS):
        motion = simulate(plant, effort, sampling_time=sampling_time)
        assert_same(motion, batch, row, every)


def test_every_trajectory_may_have_its_own_plant_and_state():
    plants = [
        FlexibleArm(mass_1=1.0 + 0.1 * i, mass_2=1.0, stiffness=1.0 + i, friction=LAW)
        for i in range(20)
    ]
    states = np.random.default_rng(4).uniform(-0.3, 0.3, (20, 4))
    batch = simulate_batch(
        plants, EFFORTS[0], sampling_time=0.1, initial_states=states, store_every=100
    )
    for row, (plant, state) in enumerate(zip(plants, states, strict=True)):
        motion = simulate(plant, EFFORTS[0], sampling_time=0.1, initial_state=tuple(state.tolist()))
        assert_same(motion, batch, row, 100)


@pytest.mark.parametrize("plant", [MASS, ARM], ids=["mass", "arm"])
@pytest.mark.parametrize("sampling_time", [0.01, 0.25, 2.0])
def test_single_steps_equal_a_run_to_the_bit(plant, sampling_time):
    stepper = PlantStepper(plant, sampling_time=sampling_time)
    motion = simulate(plant, EFFORTS[1], sampling_time=sampling_time)
    state = stepper.init()
    for k, effort in enumerate(EFFORTS[1]):
        state, output = stepper.step(state, float(effort))
        assert output[0] == motion.position[k + 1]
        assert output[1] == motion.velocity[k + 1]
        if plant is ARM:
            assert output[2:] == (motion.load_position[k + 1], motion.load_velocity[k + 1])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"commanded_efforts": EFFORTS * np.nan}, "is nan N in trajectory 0 at sample 0"),
        ({"commanded_efforts": np.zeros((2, 3, 4))}, "3 dimensions"),
        ({"plants": [ARM, MASS]}, "not all of the same class"),
        ({"plants": []}, "not all of the same class"),
        ({"plants": [ARM] * 3}, "plants holds 3 trajectories where the batch has 37"),
        ({"initial_states": np.zeros((2, 4))}, "initial_states holds 2 trajectories"),
        ({"initial_states": np.zeros((1, 2))}, "has 2 values, the plant's has 4"),
        ({"store_every": 0}, "store_every is 0"),
        ({"store_every": 501}, "store_every is 501 samples, the efforts have 500"),
        ({"threads": 0}, "threads is 0"),
        ({"sampling_time": -1.0}, "sampling time is -1 s"),
    ],
)
def test_refuses_what_does_not_fit_together(options, message):
    arguments = {"plants": ARM, "commanded_efforts": EFFORTS, "sampling_time": 0.1} | options
    plants, efforts = arguments.pop("plants"), arguments.pop("commanded_efforts")
    with pytest.raises(InputError, match=message):
        simulate_batch(plants, efforts, **arguments)
