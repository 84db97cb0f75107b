"""The recorder records what the controller estimates and leaves the run as it is."""

from dataclasses import replace

import numpy as np
import pytest
from pulse_runs import PulseRun, run_pulses

from stickslip.control import PulseAmplitudeWidthController, RestDetection
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import PositioningOutcome
from stickslip.simulation import simulate_closed_loop

T = 0.01
PLANT = SingleMass(
    mass=150.0,
    friction=CoulombViscousFriction.symmetric(
        coulomb_friction=100.0, viscous_friction=700.0, static_friction=130.0
    ),
)
CONTROLLER = replace(
    PulseAmplitudeWidthController.from_friction(
        mass=150.0,
        coulomb_friction=80.0,
        pulse_effort=300.0,
        sampling_time=T,
        target=0.01,
        tolerance=2e-5,
        rest=RestDetection(samples=1, spread=0.0, speed=0.0),
    ),
    longest_width=0.03,
)


@pytest.fixture(scope="module")
def done() -> PulseRun:
    return run_pulses(PLANT, CONTROLLER, sampling_time=T, duration=1.5)


def test_the_run_is_that_of_the_compiled_loop_to_the_last_bit(done: PulseRun) -> None:
    compiled = simulate_closed_loop(PLANT, CONTROLLER, sampling_time=T, samples=150)
    np.testing.assert_array_equal(done.run.log.effort, compiled.log.effort)
    np.testing.assert_array_equal(done.run.motion.position, compiled.motion.position)
    np.testing.assert_array_equal(done.run.controller_state, compiled.controller_state)


def test_every_pulse_is_kept_once_and_is_in_the_efforts(done: PulseRun) -> None:
    assert len(done.pulses) == CONTROLLER.pulse_count(done.run.controller_state) == 10
    assert done.outcome is PositioningOutcome.REACHED
    expected = np.zeros_like(done.run.log.effort)
    for pulse in done.pulses:
        ((effort, width),) = pulse.levels
        start = round(pulse.time / T)
        expected[start : start + round(width / T)] = effort
    np.testing.assert_array_equal(done.run.log.effort, expected)


def test_displacements_add_up_to_where_the_axis_rests(done: PulseRun) -> None:
    moved = sum(pulse.achieved_displacement for pulse in done.pulses)
    assert moved == pytest.approx(float(done.run.motion.position[-1]), rel=1e-12)
    errors = [pulse.error for pulse in done.pulses]
    np.testing.assert_allclose(
        np.diff(errors), [-p.achieved_displacement for p in done.pulses][:-1]
    )


def test_estimates_begin_with_the_first_guess_and_end_with_the_last(done: PulseRun) -> None:
    assert done.estimate_times[0] == 0.0
    assert done.estimate_times.size == len(done.pulses) + 1
    assert np.all(np.diff(done.estimate_times) > 0.0)
    assert done.estimates["coulomb_friction"][0] == pytest.approx(80.0)
    for name, value in CONTROLLER.estimates(done.run.controller_state).items():
        assert done.estimates[name][-1] == value
        assert done.estimates[name].shape == done.estimate_times.shape


def test_a_run_too_short_for_an_outcome_has_no_pulse() -> None:
    short = run_pulses(PLANT, CONTROLLER, sampling_time=T, duration=2 * T)
    assert short.pulses == ()
    assert short.outcome is PositioningOutcome.MOVING
    assert short.estimate_times.tolist() == [0.0]
