from functools import cache

import numpy as np
import pytest
from refusals import refuses

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.simulation import Sensors, simulate

LAW = CoulombViscousFriction.symmetric(coulomb_friction=0.1, viscous_friction=0.1)
ARM = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=LAW)
EFFORT = np.repeat([1.0, -1.0, 0.5, 0.0], 1000)


@cache
def motion():
    return simulate(ARM, EFFORT, sampling_time=0.01)


def test_ideal_sensors_show_the_truth():
    log = Sensors().measure(motion())
    np.testing.assert_array_equal(log.measured_position, motion().position)
    np.testing.assert_array_equal(log.measured_velocity, motion().velocity)
    np.testing.assert_array_equal(log.measured_load_position, motion().load_position)
    np.testing.assert_array_equal(log.measured_load_velocity, motion().load_velocity)
    np.testing.assert_array_equal(log.effort[:-1], EFFORT)
    assert log.effort[-1] == EFFORT[-1]
    assert log.source is None
    assert len(log) == EFFORT.size + 1


def test_noise_is_white_gaussian_and_of_the_given_size():
    sensors = Sensors(position_noise=0.005, velocity_noise=0.05)
    log = sensors.measure(motion(), np.random.default_rng(0))
    n = len(log)
    for shown, truth, sigma in (
        (log.measured_position, motion().position, 0.005),
        (log.measured_velocity, motion().velocity, 0.05),
        (log.measured_load_position, motion().load_position, 0.005),
        (log.measured_load_velocity, motion().load_velocity, 0.05),
    ):
        noise = (shown - truth) / sigma
        # five standard errors of the mean, of the deviation and of the first autocorrelation
        assert abs(noise.mean()) < 5 / np.sqrt(n)
        assert abs(noise.std() - 1) < 5 / np.sqrt(2 * n)
        assert abs(np.mean(noise[1:] * noise[:-1])) < 5 / np.sqrt(n)


def test_an_encoder_shows_whole_steps():
    step = 1e-3
    log = Sensors(encoder_step=step).measure(motion())
    counts = log.measured_position / step
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    assert np.abs(log.measured_position - motion().position).max() <= step / 2 * (1 + 1e-9)


def test_velocity_from_encoder_differences():
    log = Sensors(encoder_step=1e-3, velocity="differences").measure(motion())
    np.testing.assert_array_equal(log.measured_velocity[1:], np.diff(log.measured_position) / 0.01)
    assert log.measured_velocity[0] == 0.0
    assert Sensors(velocity="none").measure(motion()).measured_velocity is None


@pytest.mark.parametrize("delay", [1, 3, 10_000])
def test_delay_shifts_every_channel_by_whole_samples(delay):
    late = Sensors(delay=delay).measure(motion())
    at = np.maximum(np.arange(len(late)) - delay, 0)
    np.testing.assert_array_equal(late.measured_position, motion().position[at])
    np.testing.assert_array_equal(late.measured_load_velocity, motion().load_velocity[at])


def test_a_load_without_sensors_and_a_rigid_axis_have_no_load_columns():
    assert Sensors(load=False).measure(motion()).measured_load_position is None
    rigid = simulate(SingleMass(mass=1.0, friction=LAW, kind="rotary"), [1.0], sampling_time=0.1)
    log = Sensors().measure(rigid)
    assert log.measured_load_position is None
    assert log.kind == "rotary"


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"position_noise": -1.0}, "negative"),
        ({"velocity_noise": float("nan")}, "not_finite"),
        ({"encoder_step": -0.1}, "negative"),
        ({"delay": -1}, "not_whole"),
        (
            {"velocity_noise": 0.1, "velocity": "differences"},
            "noise_without_velocity",
        ),
        ({"velocity_noise": 0.1, "velocity": "none"}, "noise_without_velocity"),
    ],
)
def test_refuses_impossible_sensors(options, code):
    with refuses(code, of=options):
        Sensors(**options)


def test_noise_needs_a_generator():
    with refuses("no_generator"):
        Sensors(position_noise=0.1).measure(motion())
