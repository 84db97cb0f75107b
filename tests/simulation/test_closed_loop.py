from types import SimpleNamespace

import numpy as np
import pytest
from refusals import refuses

from stickslip.compiled import compiled
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.records import EventBudgetError, SensorSample
from stickslip.simulation import Sensors, simulate_closed_loop

LAW = CoulombViscousFriction.symmetric(
    coulomb_friction=0.1, viscous_friction=0.05, static_friction=0.12
)
ARM = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=LAW)
MASS = SingleMass(mass=1.0, friction=LAW)
NOISY = Sensors(position_noise=1e-3, velocity_noise=1e-2, encoder_step=1e-4, delay=2)
DIFFERENCES = Sensors(encoder_step=1e-4, velocity="differences", delay=1, load=False)


both_loops = pytest.mark.parametrize("make", [compiled(cached=False), lambda step: step])


def pd_step(state, sample):
    return state, 2.0 * (0.5 - sample.measured_position) - 1.5 * sample.measured_velocity


def controller(step):
    return SimpleNamespace(init=lambda: (0.0,), step=step)


def test_a_controller_gets_delayed_and_noisy_samples_only():
    seen = []

    def step(state, sample):
        seen.append(sample)
        return state, 0.3

    run = simulate_closed_loop(
        ARM,
        controller(step),
        sampling_time=0.01,
        samples=50,
        sensors=NOISY,
        generator=np.random.default_rng(3),
    )
    assert all(isinstance(sample, SensorSample) for sample in seen)
    assert len(seen) == 50
    np.testing.assert_array_equal(
        [sample.measured_position for sample in seen], run.log.measured_position[:-1]
    )
    np.testing.assert_array_equal([sample.time for sample in seen], run.log.time[:-1])
    assert not np.isin(run.motion.position[1:], [sample.measured_position for sample in seen]).any()


def test_without_a_load_sensor_the_channel_is_nan():
    samples = []

    def step(state, sample):
        samples.append(sample)
        return state, 0.0

    simulate_closed_loop(MASS, controller(step), sampling_time=0.01, samples=3)
    simulate_closed_loop(ARM, controller(step), sampling_time=0.01, samples=3, sensors=DIFFERENCES)
    assert np.isnan([sample.measured_load_position for sample in samples]).all()
    assert np.isnan([sample.measured_load_velocity for sample in samples]).all()


@both_loops
def test_an_effort_that_is_not_finite_is_an_error_with_its_time(make):
    def step(state, sample):
        return state, np.inf if sample.time > 0.045 else 0.0

    with refuses("controller_effort_not_finite", time=0.05, sample=5):
        simulate_closed_loop(MASS, controller(make(step)), sampling_time=0.01, samples=10)


@pytest.mark.parametrize("plant", [MASS, ARM], ids=["mass", "arm"])
@both_loops
def test_a_motion_that_overflows_is_an_error_with_its_sample(plant, make):
    def step(state, sample):
        return state, 1e308

    with refuses("motion_overflows", where="sample 1"):
        simulate_closed_loop(plant, controller(make(step)), sampling_time=100.0, samples=10)


@both_loops
def test_too_many_events_are_an_error_with_their_time(make):
    free = CoulombViscousFriction.symmetric(coulomb_friction=0.0, viscous_friction=0.0)
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1e4, friction=free)

    def step(state, sample):
        return state, 0.0

    with refuses("event_budget", EventBudgetError, time=0.0, event_budget=50):
        simulate_closed_loop(
            arm,
            controller(make(step)),
            sampling_time=10.0,
            samples=3,
            initial_state=(0.0, 1.0, 0.0, -1.0),
            event_budget=50,
        )


@pytest.mark.parametrize(
    ("what", "missing"),
    [(object(), "init"), (SimpleNamespace(init=lambda: 0), "step")],
)
def test_refuses_what_is_no_controller(what, missing):
    with refuses("no_controller", method=missing):
        simulate_closed_loop(MASS, what, sampling_time=0.01, samples=5)


@pytest.mark.parametrize("own", [0.005, np.float64(0.02), 1])
def test_refuses_a_controller_for_another_sampling_time(own):
    which = SimpleNamespace(init=lambda: (0.0,), step=pd_step, sampling_time=own)
    with refuses("other_sampling_time", own=float(own), sampling_time=0.01):
        simulate_closed_loop(MASS, which, sampling_time=0.01, samples=5)
    which.sampling_time = 0.1**2  # 0.01 but for rounding
    assert simulate_closed_loop(MASS, which, sampling_time=0.01, samples=5).log.effort.any()


def test_refuses_a_run_of_nothing():
    with refuses("not_whole", name="samples", value=0):
        simulate_closed_loop(MASS, controller(pd_step), sampling_time=0.01, samples=0)
