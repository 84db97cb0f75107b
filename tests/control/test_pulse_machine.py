"""Common part of all pulse controllers, tested with pulse width control."""

import math
import os
import subprocess
import sys
from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from refusals import refuses

from stickslip.control import (
    ExactPulseController,
    PulseAmplitudeWidthController,
    PulseWidthController,
    RestDetection,
)
from stickslip.control.pulses import kernel as pulse
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import PositioningOutcome, SensorSample
from stickslip.simulation import simulate_closed_loop

FULL = 300.0
WIDTH = 3  # samples; what an error of 0.01 asks for with this gain
CONTROLLER = PulseWidthController(
    sampling_time=0.01,
    target=0.01,
    tolerance=1e-3,
    rest=RestDetection(samples=1, spread=0.0, speed=0.0),
    pulse_effort=FULL,
    first_gain=0.01 / 0.03**2,
)


GUESS = CoulombViscousFriction.symmetric(coulomb_friction=80.0, viscous_friction=500.0)
CONTROLLERS = {
    "pwc": CONTROLLER,
    "papwc": PulseAmplitudeWidthController.from_friction(
        mass=150.0, coulomb_friction=80.0, pulse_effort=FULL, sampling_time=0.01, target=0.01,
        tolerance=1e-3, rest=CONTROLLER.rest,
    ),
    "exact": ExactPulseController(
        sampling_time=0.01, target=0.01, tolerance=1e-5, rest=CONTROLLER.rest, effort_limit=FULL,
        mass=150.0, friction=GUESS,
    ),
}  # fmt: skip


def played(controller, positions, velocities=None, state=None):
    """Feed samples to a controller; return the efforts and its state after each sample."""
    state = controller.init() if state is None else state
    velocities = [0.0] * len(positions) if velocities is None else velocities
    efforts, states = [], []
    for k, (x, v) in enumerate(zip(positions, velocities, strict=True)):
        sample = SensorSample(0.01 * k, x, v, math.nan, math.nan)
        state, effort = controller.step(state, sample)
        efforts.append(effort)
        states.append(state)
    return efforts, states


def test_a_pulse_fires_in_the_very_sample_in_which_the_axis_has_stuck():
    efforts, _ = played(CONTROLLER, [0.0] * 6, [0.5, 0.1, 0.0, 3.0, 4.0, 3.0])
    assert efforts == [0.0, 0.0, FULL, FULL, FULL, 0.0]


def test_nothing_fires_while_the_axis_moves():
    speed = 1e-4  # 20 samples of it are twice a hundredth of the tolerance
    efforts, states = played(CONTROLLER, [speed * 0.01 * k for k in range(50)], [speed] * 50)
    assert set(efforts) == {0.0}
    assert CONTROLLER.outcome(states[-1]) is PositioningOutcome.MOVING


def test_a_position_that_hardly_changes_is_a_rest_whatever_the_velocity_shows():
    for creep, offset in ((0.0, 1e-6), (2e-5, 2e-5)):
        positions = [creep * 0.01 * k for k in range(20)]
        efforts, states = played(CONTROLLER, positions, [offset] * 20)
        assert set(efforts[:-1]) == {0.0}
        assert efforts[-1] == FULL
        assert CONTROLLER.outcome(states[-1]) is PositioningOutcome.MOVING


def test_a_rest_lasts_longer_than_a_slow_axis_takes_for_an_encoder_step():
    # 0.1 kg and 0.1 N: the last step of 1 mm takes sqrt(2 * 1e-3 / 1) = 45 ms, at 1 kHz
    controller = ExactPulseController(
        sampling_time=1e-3, target=0.0, tolerance=2e-3, effort_limit=1.0, mass=0.1,
        friction=CoulombViscousFriction.symmetric(coulomb_friction=0.1, viscous_friction=0.0),
        rest=RestDetection.for_encoder(resolution=1e-3, samples=10),
    )  # fmt: skip
    state, reached = controller.init(), []
    for k in range(600):
        # A pulse to 2 cm, and friction that stops the axis behind it after 0.2 s
        t = max(0.2 - 1e-3 * max(k - 20, 0), 0.0)
        x = -0.02 if k < 20 else -0.5 * t**2
        seen = 1e-3 * round(x / 1e-3)
        sample = SensorSample(1e-3 * k, seen, math.nan, math.nan, math.nan)
        state, _ = controller.step(state, sample)
        reached.append(controller.outcome(state) is PositioningOutcome.REACHED)
    first = reached.index(True)
    assert first >= 220  # not before it has stopped


def test_the_displacement_of_a_pulse_is_from_rest_to_rest():
    positions = [0.0, 0.001, 0.003, 0.005, 0.006, 0.006]
    velocities = [0.0, 0.1, 0.2, 0.2, 0.1, 0.0]
    efforts, states = played(CONTROLLER, positions, velocities)
    assert efforts[:5] == [FULL, FULL, FULL, 0.0, 0.0]
    assert [CONTROLLER.pulse_count(s) for s in states] == [0, 0, 0, 0, 0, 1]
    assert CONTROLLER.last_pulse(states[4]) is None
    pulse = CONTROLLER.last_pulse(states[5])
    assert pulse is not None
    assert pulse.time == 0.0
    assert pulse.levels == ((FULL, 0.03),)
    assert pulse.error == 0.01
    assert pulse.predicted_displacement == pytest.approx(0.01)
    assert pulse.achieved_displacement == 0.006
    assert pulse.moved
    assert efforts[5] == FULL  # it is known now, and the next pulse fires at once


def test_inside_the_tolerance_it_is_silent_until_the_axis_is_pushed_out():
    positions = [0.0095] * 4 + [0.0092, 0.004, 0.004]
    velocities = [0.0] * 4 + [0.0, -0.3, 0.0]
    efforts, states = played(CONTROLLER, positions, velocities)
    assert efforts == [0.0] * 6 + [FULL]
    outcomes = [CONTROLLER.outcome(s) for s in states]
    assert outcomes == [PositioningOutcome.REACHED] * 6 + [PositioningOutcome.MOVING]
    assert CONTROLLER.pulse_count(states[-1]) == 0


def test_what_pushes_the_axis_out_is_not_learned_from():
    _, states = played(CONTROLLER, [0.0095, 0.004, 0.002], [0.0, 0.0, 0.0])
    assert CONTROLLER.estimates(states[-1]) == CONTROLLER.estimates(CONTROLLER.init())


def test_the_axis_is_watched_to_its_tolerance_and_not_beyond():
    inside = 0.01 - 0.999 * CONTROLLER.tolerance
    outside = 0.01 - 1.001 * CONTROLLER.tolerance
    assert played(CONTROLLER, [inside])[0] == [0.0]
    assert played(CONTROLLER, [outside])[0] == [FULL]


def test_a_new_target_waits_for_the_pulse_on_its_way():
    _, states = played(CONTROLLER, [0.0, 0.001], [0.0, 0.1])
    state = CONTROLLER.retargeted(states[-1], -0.01)
    efforts, states = played(
        CONTROLLER, [0.003, 0.005, 0.006, 0.006], [0.2, 0.2, 0.1, 0.0], state=state
    )
    assert efforts == [FULL, 0.0, 0.0, -FULL]
    pulse = CONTROLLER.last_pulse(states[-1])
    assert pulse is not None
    assert (pulse.error, pulse.achieved_displacement) == (0.01, 0.006)


def test_a_new_target_wakes_it_where_it_rests():
    _, states = played(CONTROLLER, [0.0095])
    state = CONTROLLER.retargeted(states[-1], 0.5)
    assert CONTROLLER.outcome(state) is PositioningOutcome.MOVING
    assert played(CONTROLLER, [0.0095], state=state)[0] == [FULL]
    with refuses("not_finite", name="target"):
        CONTROLLER.retargeted(state, math.inf)


def test_a_pulse_that_moved_nothing_is_not_learned_from_and_it_stops():
    efforts, states = played(CONTROLLER, [0.0] * 30)
    assert efforts == [FULL] * (3 * WIDTH) + [0.0] * (30 - 3 * WIDTH)
    assert CONTROLLER.outcome(states[-1]) is PositioningOutcome.STOPPED
    assert CONTROLLER.pulse_count(states[-1]) == 3
    pulse = CONTROLLER.last_pulse(states[-1])
    assert pulse is not None
    assert not pulse.moved
    assert CONTROLLER.estimates(states[-1]) == CONTROLLER.estimates(CONTROLLER.init())
    # Pushed elsewhere it tries again
    assert played(CONTROLLER, [0.003], state=states[-1])[0] == [FULL]


def test_without_a_limit_it_repeats_the_pulse_as_printed():
    efforts, states = played(replace(CONTROLLER, max_idle_pulses=None), [0.0] * 300)
    assert efforts == [FULL] * 300
    assert CONTROLLER.pulse_count(states[-1]) == 99


@pytest.mark.parametrize("motion", [0.0009, 0.0011])
def test_a_motion_that_the_sensors_cannot_tell_from_none_is_none(motion):
    rest = RestDetection(samples=1, spread=0.5, speed=0.0, least_motion=0.001)
    controller = replace(CONTROLLER, rest=rest)
    _, states = played(controller, [0.0] * 3 + [motion])
    pulse = controller.last_pulse(states[-1])
    assert pulse is not None
    assert pulse.moved is (motion > 0.001)


def test_rest_is_a_window_within_the_spread_and_its_position_the_mean():
    controller = replace(CONTROLLER, rest=RestDetection(samples=3, spread=1e-4))
    positions = [0.001, 0.0005, 0.0, 2e-5, 1e-4, 3e-5]
    efforts, states = played(controller, positions, [math.nan] * 6)
    assert efforts == [0.0] * 4 + [FULL, FULL]
    _, states = played(controller, [0.0] * 4, state=states[-1])
    pulse = controller.last_pulse(states[-1])
    assert pulse is not None
    assert pulse.error == pytest.approx(0.01 - (0.0 + 2e-5 + 1e-4) / 3)


def test_only_samples_from_the_end_of_a_pulse_on_count():
    # Still for the length of the window during the pulse, moving after it
    controller = replace(CONTROLLER, rest=RestDetection(samples=2, spread=0.0))
    positions = [0.0, 0.0, 0.0, 0.0, 0.002, 0.003, 0.004, 0.004]
    efforts, states = played(controller, positions)
    assert efforts == [0.0, FULL, FULL, FULL, 0.0, 0.0, 0.0, FULL]
    pulse = controller.last_pulse(states[-1])
    assert pulse is not None
    assert pulse.achieved_displacement == 0.004


def test_late_sensors_are_waited_for():
    # Two samples late: just after the pulse they still show the axis before it
    late = replace(CONTROLLER, rest=RestDetection(samples=1, spread=0.0, speed=0.0, delay=2))
    positions = [0.0, 0.0, 0.0, 0.0, 0.0, 0.004, 0.005]
    velocities = [0.0, 0.0, 0.0, 0.0, 0.0, 0.3, 0.0]
    efforts, states = played(late, positions, velocities)
    assert efforts == [FULL] * 3 + [0.0] * 3 + [FULL]
    pulse = late.last_pulse(states[-1])
    assert pulse is not None
    assert pulse.achieved_displacement == 0.005


@pytest.mark.parametrize(
    ("position", "velocity"), [(math.nan, 0.0), (math.inf, 0.0), (0.0, math.nan)]
)
@pytest.mark.parametrize("method", CONTROLLERS)
def test_a_sample_that_cannot_be_used_changes_nothing(method, position, velocity):
    controller = CONTROLLERS[method]
    for before in (controller.init(), played(controller, [0.0])[1][-1]):
        kept = before.copy()
        efforts, states = played(controller, [position], [velocity], state=before)
        assert math.isnan(efforts[0])
        assert np.array_equal(states[0], kept, equal_nan=True)
        assert np.array_equal(before, kept, equal_nan=True)


@pytest.mark.parametrize("method", CONTROLLERS)
def test_a_step_leaves_the_state_it_was_given(method):
    state = CONTROLLERS[method].init()
    kept = state.copy()
    played(CONTROLLERS[method], [0.0] * 3, state=state)
    assert np.array_equal(state, kept, equal_nan=True)


def final_states(method):
    """Return the states after a log, and after a loop that is compiled as a whole."""
    controller = CONTROLLERS[method]
    positions = np.repeat(np.random.default_rng(4).uniform(-0.01, 0.02, 40), 6)
    friction = CoulombViscousFriction.symmetric(
        coulomb_friction=100.0, static_friction=130.0, viscous_friction=700.0
    )
    run = simulate_closed_loop(
        SingleMass(mass=150.0, friction=friction), controller, sampling_time=0.01, samples=200
    )
    return played(controller, positions.tolist())[1][-1], run.controller_state


@pytest.mark.slow
@pytest.mark.parametrize("method", CONTROLLERS)
def test_interpreted_it_does_the_same_to_the_last_bit(method):
    code = f"""
import sys
from test_pulse_machine import final_states
sys.stdout.write(" ".join(state.tobytes().hex() for state in final_states({method!r})))
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={
            **os.environ,
            "NUMBA_DISABLE_JIT": "1",
            "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path]),
        },
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == [state.tobytes().hex() for state in final_states(method)]


@pytest.mark.parametrize(
    ("settings", "code"),
    [
        ({"sampling_time": 0.0}, "not_positive"),
        ({"tolerance": 0.0}, "not_positive"),
        ({"tolerance": -1e-5}, "not_positive"),
        ({"target": math.nan}, "not_finite"),
        ({"kind": "angular"}, "not_a_choice"),
        ({"rest": 3}, "wrong_type"),
    ],
)
def test_impossible_settings_are_refused(settings, code, without_shape_checks):
    with refuses(code, of=settings):
        replace(CONTROLLER, **settings)


@pytest.mark.parametrize(
    ("settings", "code"),
    [
        ({"samples": 0, "speed": 0.0}, "not_whole"),
        ({"samples": 1}, "not_whole"),
        ({"samples": 2.5}, "not_whole"),
        ({"spread": -1e-6}, "negative"),
        ({"speed": -1.0}, "negative"),
        ({"least_motion": -1.0}, "negative"),
        ({"delay": -1}, "not_whole"),
    ],
)
def test_impossible_rest_is_refused(settings, code, without_shape_checks):
    with refuses(code, of=settings):
        RestDetection(**{"samples": 5, "spread": 1e-6, **settings})


@pytest.mark.parametrize(
    ("settings", "code"),
    [
        ({"resolution": 0.0}, "not_positive"),
        ({"noise": -1.0}, "negative"),
        ({"samples": 1}, "not_whole"),
        ({"samples": 0}, "not_whole"),
    ],
)
def test_impossible_encoders_are_refused(settings, code):
    with refuses(code, of=settings):
        RestDetection.for_encoder(**{"resolution": 1e-6, "samples": 20, **settings})


@pytest.mark.parametrize("noise", [0.0, 0.3e-6, 1e-6, 5e-6])
@pytest.mark.parametrize("samples", [2, 20])
def test_an_encoder_at_rest_is_found_at_rest_and_not_moved(noise, samples):
    step, windows = 1e-6, 20_000
    rest = RestDetection.for_encoder(resolution=step, noise=noise, samples=samples)
    rng = np.random.default_rng(samples)
    truth = rng.uniform(0.0, step, (windows, 1))
    read = step * np.rint((truth + noise * rng.standard_normal((windows, samples))) / step)
    missed = int(np.sum(np.ptp(read, axis=1) > rest.spread * (1 + 1e-9)))
    # One in a thousand, and six standard deviations of that count
    assert missed <= 1e-3 * windows + 6.0 * math.sqrt(1e-3 * windows)
    again = step * np.rint((truth + noise * rng.standard_normal((windows, samples))) / step)
    difference = np.abs(read.mean(axis=1) - again.mean(axis=1))
    assert rest.least_motion is not None
    assert difference.max() <= rest.least_motion  # expected to fail 0.02 times in all of these


@pytest.mark.parametrize(
    "state",
    [np.zeros(3), np.zeros(500), np.r_[CONTROLLER.init(), 0.0], CONTROLLER.init()[:-1]],
    ids=["short", "long", "one more", "one less"],
)
def test_a_vector_that_is_no_state_is_refused(state):
    with pytest.raises(ValueError, match="begin with the one of init"):
        CONTROLLER.step(state, SensorSample(0.0, 0.0, 0.0, math.nan, math.nan))


@pytest.mark.parametrize(("method", "other"), [*permutations(CONTROLLERS, 2)])
def test_a_state_or_experience_of_another_method_is_refused(method, other):
    controller, state = CONTROLLERS[method], CONTROLLERS[other].init()
    with pytest.raises(ValueError, match="not a state of this controller's method"):
        played(controller, [0.0], state=state)
    with refuses("learned_otherwise", own=other, needed=method):
        controller.resumed(CONTROLLERS[other].learned(state))


@pytest.mark.parametrize("method", CONTROLLERS)
def test_experience_of_another_axis_or_size_is_refused(method):
    controller = CONTROLLERS[method]
    learned = controller.learned(controller.init())
    with refuses("learned_otherwise", own="rotary"):
        controller.resumed(replace(learned, kind="rotary"))
    with refuses("covariance_shape"):
        controller.resumed(replace(learned, covariance=np.eye(4)))


def test_a_longer_trace_is_kept_more_coarsely():
    moving = [0.001 * k for k in range(1, 1001)]
    _, states = played(CONTROLLER, [0.0, *moving], [0.0] + [1.0] * 1000)
    for k, state in enumerate(states):
        count, stride = int(pulse.head(state).position_count), int(pulse.head(state).stride)
        assert count <= pulse.TRACE_SIZE
        assert k - stride < (count - 1) * stride <= k
        kept = pulse.head(state).positions[:count]
        np.testing.assert_array_equal(kept, [0.0, *moving][: k + 1 : stride])
