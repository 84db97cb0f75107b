"""The exact pulse controller: what it fires, on what sensors it works, and what it refuses."""

import math
from dataclasses import replace

import numpy as np
import pytest
from exact_pulses import (
    CONTROLLER,
    ENCODER,
    ENCODER_ONLY,
    GUESS,
    IDEAL,
    PLANT,
    SAMPLE_NOISE,
    T,
    controller_for,
    driven,
    symmetric,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from pulse_runs import run_pulses
from random_axes import random_axes
from refusals import refuses

from stickslip.control import ExactPulseController, RestDetection
from stickslip.control.pulses import exact_state as at
from stickslip.planning import PulseLaw
from stickslip.plants import SingleMass
from stickslip.records import PositioningOutcome
from stickslip.simulation import Sensors, simulate_closed_loop

REACHED = PositioningOutcome.REACHED


# Planning


def test_the_first_pulse_aims_short_and_as_short_as_it_is_unsure():
    def first(**settings):
        controller = replace(CONTROLLER, friction=PLANT.friction, **settings)
        pulses = run_pulses(PLANT, controller, sampling_time=T, duration=0.5).pulses
        return pulses[0].predicted_displacement

    sure = first(mass_uncertainty=0.0, friction_uncertainty=0.0, asymmetry=0.0)
    assert sure == pytest.approx(0.01, rel=1e-4)
    aims = [first(friction_uncertainty=u) for u in (0.1, 0.2, 0.5, 1.0)]
    assert sure > aims[0] > aims[1] > aims[2] > aims[3] > 0.0
    assert first(mass_uncertainty=0.5) < first(mass_uncertainty=0.05)


@pytest.mark.parametrize("target", [0.01, -0.003, 2e-4])
def test_a_pulse_lasts_the_fewest_whole_samples_that_the_limit_allows(target):
    controller = replace(
        CONTROLLER,
        target=target,
        friction=PLANT.friction,
        mass_uncertainty=0.0,
        friction_uncertainty=0.0,
        asymmetry=0.0,
    )
    first = run_pulses(PLANT, controller, sampling_time=T, duration=1.0).pulses[0]
    law = PulseLaw(
        mass=150.0, coulomb_friction=100.0, viscous_friction=700.0, static_friction=130.0
    )
    ((effort, width),) = first.levels
    fewest = math.ceil(float(law.width_for(abs(target), effort=300.0)) / T)
    assert width == pytest.approx(fewest * T)
    expected = float(law.effort_for(abs(first.predicted_displacement), width=width))
    assert abs(effort) == pytest.approx(expected, rel=1e-9)
    assert math.copysign(1.0, effort) == math.copysign(1.0, target)


def test_what_lies_below_the_smallest_step_is_reached_by_a_step_beyond_and_back():
    # The smallest one-sided step, 0.1 mm, is five times the tolerance
    law = PulseLaw(mass=75.0, coulomb_friction=200.0, viscous_friction=700.0, static_friction=300.0)
    smallest = float(law.smallest_displacement(T))
    assert smallest == pytest.approx(1e-4, rel=0.1)  # without viscous friction 0.1 mm
    plant = SingleMass(mass=75.0, friction=symmetric(200.0, 300.0, 700.0))
    for guess in (200.0, 150.0, 299.0):
        for target in np.linspace(0.21, 0.7, 8) * smallest:
            controller = replace(
                CONTROLLER,
                mass=75.0,
                friction=symmetric(guess, 300.0, 500.0),
                effort_limit=600.0,
                target=float(target),
                tolerance=1.9e-5,
                rest=ENCODER,
                position_noise=SAMPLE_NOISE,
            )
            run = run_pulses(
                plant,
                controller,
                sampling_time=T,
                duration=3.0,
                sensors=ENCODER_ONLY,
                generator=np.random.default_rng(2),
            )
            assert run.outcome is REACHED
            assert abs(run.run.motion.position[-1] - target) < 2e-5
            efforts = [each.levels[0][0] for each in run.pulses]
            assert max(efforts) > 0.0 > min(efforts)
            assert len(run.pulses) <= 8


@pytest.mark.parametrize("static", [290.0, 299.0, 299.999])
@pytest.mark.parametrize("share", [1.0, 0.98, 0.33])
def test_a_breakaway_guessed_far_too_high_is_not_taken_as_true_for_ever(static, share):
    # As high as the limit: none of the pulses that it allows is small
    controller = replace(CONTROLLER, friction=symmetric(share * static, static, 500.0))
    run = run_pulses(PLANT, controller, sampling_time=T, duration=20.0)
    assert run.outcome is REACHED
    assert len(run.pulses) <= 10
    # By the first guess, hardly any force is left to move it, and a first pulse made to cover the
    # whole way with that would throw it fifteen times as far
    assert run.run.motion.position.max() < 0.02


@pytest.mark.parametrize(("coulomb", "static"), [(100.0, 280.0), (150.0, 280.0), (200.0, 280.0)])
def test_the_gaps_between_whole_samples_are_avoided(coulomb, static):
    # The breakaway is near the limit: n samples cause displacements near n^2 times that of one
    plant = SingleMass(mass=150.0, friction=symmetric(coulomb, static, 700.0))
    for target in np.linspace(5e-5, 3e-3, 20):
        controller = replace(
            CONTROLLER,
            target=float(target),
            tolerance=1e-5,
            friction=symmetric(0.9 * coulomb, static, 500.0),
        )
        run = simulate_closed_loop(plant, controller, sampling_time=T, samples=1000)
        assert controller.outcome(run.controller_state) is REACHED
        assert controller.pulse_count(run.controller_state) <= 15


def test_no_pulse_is_longer_than_allowed():
    controller = replace(CONTROLLER, longest_width=0.0299999)
    run = run_pulses(PLANT, controller, sampling_time=T, duration=10.0)
    assert run.outcome is REACHED
    widths = [each.levels[0][1] for each in run.pulses]
    assert max(widths) == pytest.approx(0.02)
    assert [each.levels[0][0] for each in run.pulses][1] == 300.0


@settings(max_examples=60)
@given(
    seed=st.integers(0, 2**31),
    limit=st.floats(1.0001, 4.0),
    uncertain=st.floats(0.0, 3.0),
    tolerance=st.floats(1e-9, 1e-3),
)
def test_the_effort_stays_within_its_limit_and_the_estimates_positive(
    seed, limit, uncertain, tolerance
):
    (axis,) = random_axes(np.random.default_rng(seed), 1)
    most = limit * axis.guessed_friction.static_friction_positive
    controller = controller_for(
        axis, effort_limit=most, friction_uncertainty=uncertain, tolerance=tolerance
    )
    run = simulate_closed_loop(
        axis.plant,
        controller,
        sampling_time=T,
        samples=1000,
        sensors=ENCODER_ONLY,
        generator=np.random.default_rng(seed),
    )
    assert np.abs(run.motion.commanded_effort).max() <= most
    assert all(
        math.isfinite(value) and value > 0.0
        for value in controller.estimates(run.controller_state).values()
    )


# Sensors


def test_ideal_sensors_bring_it_to_where_the_law_is_trusted():
    worst = 0.0
    for axis in random_axes(np.random.default_rng(21), 60):
        controller = controller_for(axis, rest=IDEAL, position_noise=0.0, tolerance=1e-7)
        run = simulate_closed_loop(axis.plant, controller, sampling_time=T, samples=1000)
        assert controller.outcome(run.controller_state) is REACHED
        worst = max(worst, abs(axis.start_error - run.motion.position[-1]))
    assert worst <= 1e-7


def test_a_fine_encoder_is_used_to_its_resolution():
    step = 1e-8
    errors = []
    for axis in random_axes(np.random.default_rng(22), 60):
        controller = controller_for(
            axis,
            rest=RestDetection.for_encoder(resolution=step, samples=10),
            position_noise=step / math.sqrt(12.0),
            tolerance=1.5 * step,
        )
        sensors = Sensors(encoder_step=step, velocity="none")
        run = driven(axis, controller, samples=1500, sensors=sensors)
        errors.append(abs(axis.start_error - run.motion.position[-1]))
        if controller.outcome(run.controller_state) is REACHED:
            assert errors[-1] <= 2.0 * step  # half a step is not seen
    assert np.median(errors) <= 2.0 * step
    assert np.mean(np.array(errors) <= 2.0 * step) >= 0.9


@pytest.mark.parametrize("delay", [1, 2, 5])
def test_late_sensors(delay):
    rest = RestDetection.for_encoder(resolution=1e-6, noise=1e-6, samples=10, delay=delay)
    sensors = replace(ENCODER_ONLY, delay=delay)
    pulses = []
    for axis in random_axes(np.random.default_rng(23), 40):
        run = driven(axis, controller_for(axis, rest=rest), sensors=sensors)
        assert abs(axis.start_error - run.motion.position[-1]) <= 2e-5
        pulses.append(controller_for(axis).pulse_count(run.controller_state))
    assert np.median(pulses) <= 3


def test_a_fast_loop_sees_all_of_a_long_pulse():
    # At 1 kHz a pulse and its coasting last hundreds of samples, of which 64 are kept
    pulses = []
    for axis in random_axes(np.random.default_rng(24), 30):
        run = driven(axis, controller_for(axis, sampling_time=0.001), samples=6000)
        assert abs(axis.start_error - run.motion.position[-1]) <= 2e-5
        pulses.append(controller_for(axis).pulse_count(run.controller_state))
    assert np.median(pulses) <= 3


def test_a_rotary_axis():
    plant = SingleMass(mass=0.02, friction=symmetric(0.5, 0.65, 0.05), kind="rotary")
    controller = ExactPulseController(
        sampling_time=0.002,
        target=-0.3,
        tolerance=1e-4,
        kind="rotary",
        rest=RestDetection.for_encoder(resolution=2e-5, samples=10),
        position_noise=2e-5 / math.sqrt(12.0),
        effort_limit=1.5,
        mass=0.019,
        friction=symmetric(0.35, 0.4, 0.03),
    )
    run = run_pulses(
        plant,
        controller,
        sampling_time=0.002,
        duration=4.0,
        sensors=Sensors(encoder_step=2e-5, velocity="none"),
    )
    assert run.outcome is REACHED
    assert abs(run.run.motion.position[-1] + 0.3) < 1.3e-4
    assert controller.learned(run.run.controller_state).kind == "rotary"


def test_random_axes_end_within_the_tolerance_by_few_pulses():
    # 300 of 300 shows with 95 % confidence that at least 99 % do
    errors, pulses = [], []
    for axis in random_axes(np.random.default_rng(7), 300):
        controller = controller_for(axis)
        run = driven(axis, controller, samples=1500)
        assert controller.outcome(run.controller_state) is REACHED
        assert np.abs(run.motion.commanded_effort).max() <= axis.effort_limit
        assert not run.motion.commanded_effort[1000:].any()
        errors.append(abs(axis.start_error - run.motion.position[-1]))
        pulses.append(controller.pulse_count(run.controller_state))
    assert max(errors) <= 2e-5
    assert np.median(pulses) <= 3
    assert max(pulses) <= 10


def test_guesses_far_off_cost_pulses_but_not_the_target():
    pulses = []
    rng = np.random.default_rng(8)
    for axis in random_axes(rng, 60):
        wrong = 3.0 ** rng.uniform(-1.0, 1.0)
        truth = axis.plant.friction
        coulomb = min(wrong * truth.coulomb_friction_positive, 0.95 * axis.effort_limit)
        controller = controller_for(
            axis,
            friction=symmetric(coulomb, coulomb, wrong * truth.viscous_friction_positive),
            mass=axis.plant.mass * rng.uniform(0.7, 1.3),
        )
        run = driven(axis, controller, samples=2000)
        assert abs(axis.start_error - run.motion.position[-1]) <= 2e-5
        pulses.append(controller.pulse_count(run.controller_state))
    assert np.median(pulses) <= 4


@pytest.mark.parametrize(
    "settings",
    [
        {"friction": symmetric(80.0, 80.0, 0.0)},
        {"friction_uncertainty": 0.0, "asymmetry": 0.0, "mass_uncertainty": 0.0},
        {"mass_uncertainty": 0.0},
        {"friction_uncertainty": 1e3},
        {"friction_uncertainty": 1e3, "mass_uncertainty": 1e3, "asymmetry": 1e3},
        {"asymmetry": 0.0},
        {"position_noise": 1e-3},
        {"position_noise": 0.0},
    ],
)
def test_odd_first_beliefs_still_lead_to_the_target(settings):
    changed = {"tolerance": 1.9e-5, "rest": ENCODER, "position_noise": SAMPLE_NOISE, **settings}
    controller = replace(CONTROLLER, **changed)
    run = run_pulses(
        PLANT,
        controller,
        sampling_time=T,
        duration=10.0,
        sensors=ENCODER_ONLY,
        generator=np.random.default_rng(1),
    )
    assert run.outcome is REACHED
    assert len(run.pulses) <= 15
    assert np.isfinite(at.own_fields(run.run.controller_state).values).all()


# Bad input


@pytest.mark.parametrize(
    ("wrong", "code"),
    [
        ({"effort_limit": 0.0}, "not_positive"),
        ({"effort_limit": math.inf}, "not_finite"),
        ({"effort_limit": 80.0}, "effort_below_breakaway"),
        ({"mass": -1.0}, "not_positive"),
        ({"mass": math.nan}, "not_finite"),
        ({"mass_uncertainty": -0.1}, "negative"),
        ({"friction_uncertainty": math.nan}, "not_finite"),
        ({"asymmetry": math.inf}, "not_finite"),
        ({"position_noise": -1e-6}, "negative"),
        ({"longest_width": 0.009}, "pulse_below_sample"),
        ({"max_idle_pulses": 0}, "not_whole"),
        ({"max_idle_pulses": None}, "not_whole"),
        ({"max_idle_pulses": 2.5}, "not_whole"),
        ({"friction": 100.0}, "wrong_type"),
        ({"friction": symmetric(0.0, 10.0, 1.0)}, "pulse_never_ends"),
        ({"friction": replace(GUESS, offset=90.0)}, "pulse_never_ends"),
        ({"friction": symmetric(80.0, 310.0, 1.0), "kind": "rotary"}, "effort_below_breakaway"),
    ],
)
def test_impossible_settings_are_refused(wrong, code, without_shape_checks):
    with refuses(code, of=(*wrong, "effort_limit")):
        replace(CONTROLLER, **wrong)
