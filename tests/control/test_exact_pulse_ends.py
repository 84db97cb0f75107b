"""The exact pulse controller ends, whatever the axis does, and says why."""

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from exact_pulses import CONTROLLER, ENCODER, PLANT, SAMPLE_NOISE, T, symmetric
from hypothesis import given, settings
from hypothesis import strategies as st
from laws import uneven
from pulse_runs import run_pulses
from slow_cases import quick_where

from stickslip.control import RestDetection
from stickslip.control.pulses import kernel as pulse
from stickslip.plants import SingleMass
from stickslip.records import PositioningOutcome, SensorSample
from stickslip.simulation import PlantStepper, Sensors

REACHED, STOPPED = PositioningOutcome.REACHED, PositioningOutcome.STOPPED


def most_pulses(controller, first_error):
    """Return how many pulses there may be: so many halvings, twice max_idle_pulses before each."""
    halvings = math.ceil(math.log2(max(first_error / controller.tolerance, 2.0)))
    return 2 * controller.max_idle_pulses * halvings


def lived(controller, plants, samples, *, step=0.0, noise=0.0, push=None, seed=0):
    """Run on a plant that is another one after every pulse; ``push`` (sample, position)."""
    rng = np.random.default_rng(seed)
    make = iter(plants)
    stepper = PlantStepper(next(make), sampling_time=T)
    plant_state, (x, v) = stepper.init(), (0.0, 0.0)
    state, fired = controller.init(), 0.0
    efforts, positions = [], []
    for k in range(samples):
        if push is not None and k == push[0]:
            x, v = push[1], 0.0
            plant_state = stepper.init((x, v))
        shown = x + noise * rng.standard_normal()
        if step > 0.0:
            shown = step * round(shown / step)
        state, effort = controller.step(state, SensorSample(k * T, shown, v, math.nan, math.nan))
        if pulse.head(state).pulses != fired:
            fired = pulse.head(state).pulses
            stepper = PlantStepper(next(make), sampling_time=T)
        plant_state, (x, v) = stepper.step(plant_state, effort)
        efforts.append(effort)
        positions.append(x)
    return np.array(efforts), np.array(positions), state


def unsteady(share, seed, *, mass=150.0):
    """Yield axes whose friction is drawn anew for every pulse."""
    rng = np.random.default_rng(seed)
    while True:
        fc = 100.0 * (1.0 + share * rng.uniform(-1.0, 1.0, 2))
        fs = fc * rng.uniform(1.05, 1.5, 2)
        yield SingleMass(
            mass=mass,
            friction=uneven(coulomb=fc, static=fs, viscous=(700.0, 700.0)),
        )


def assert_ended(controller, efforts, state, *, first_error=0.01):
    """Check that it has ended, reported so, and stayed silent for the last half of the time."""
    outcome = controller.outcome(state)
    assert outcome in (REACHED, STOPPED)
    assert (controller.why(state) is None) is (outcome is REACHED)
    assert controller.pulse_count(state) <= most_pulses(controller, first_error)
    assert not efforts[efforts.size // 2 :].any()


@pytest.mark.parametrize(
    ("max_idle_pulses", "tolerance", "share"),
    quick_where(
        lambda _, tolerance, share: (tolerance, share) in {(2e-5, 0.05), (1e-9, 0.3)},
        product([2, 10], [2e-5, 1e-6, 1e-9], [0.05, 0.15, 0.3]),
    ),
)
def test_it_ends_even_if_friction_is_another_at_every_pulse(share, tolerance, max_idle_pulses):
    controller = replace(CONTROLLER, tolerance=tolerance, max_idle_pulses=max_idle_pulses)
    for seed in range(4):
        efforts, _, state = lived(controller, unsteady(share, seed), 4000, seed=seed)
        assert_ended(controller, efforts, state)


@pytest.mark.parametrize("share", [0.05, 0.3])
def test_it_ends_on_an_encoder_too(share):
    controller = replace(
        CONTROLLER, tolerance=2e-6, rest=ENCODER, position_noise=SAMPLE_NOISE, target=0.005
    )
    for seed in range(4):
        efforts, _, state = lived(
            controller, unsteady(share, seed), 4000, step=1e-6, noise=1e-6, seed=seed
        )
        assert_ended(controller, efforts, state, first_error=0.005)


@pytest.mark.parametrize(("coulomb", "static"), [(1000.0, 1000.0), (100.0, 300.1), (250.0, 301.0)])
def test_what_cannot_be_moved_is_given_up(coulomb, static):
    plant = SingleMass(mass=150.0, friction=symmetric(coulomb, static, 0.0))
    for target in (0.01, 2e-6):
        controller = replace(CONTROLLER, target=target)
        run = run_pulses(plant, controller, sampling_time=T, duration=5.0)
        assert run.outcome is STOPPED
        assert len(run.pulses) == controller.max_idle_pulses
        assert (
            controller.why(run.run.controller_state)
            == "none of the last pulses has freed the axis: it is blocked, or a sensor is frozen"
        )
        assert not run.run.motion.position.any()
        assert not run.run.motion.commanded_effort[250:].any()
        strongest = np.abs(run.run.motion.commanded_effort).max()
        assert strongest == pytest.approx(300.0, rel=1e-3)


def test_an_encoder_coarser_than_the_tolerance_ends_it():
    rest = RestDetection.for_encoder(resolution=1e-4, samples=10)
    controller = replace(
        CONTROLLER, target=0.01005, tolerance=1e-6, rest=rest, position_noise=1e-4 / math.sqrt(12)
    )
    sensors = Sensors(encoder_step=1e-4, velocity="none")
    run = run_pulses(PLANT, controller, sampling_time=T, duration=60.0, sensors=sensors)
    assert run.outcome is STOPPED
    assert controller.why(run.run.controller_state) is not None
    assert len(run.pulses) <= most_pulses(controller, 0.01)
    assert not run.run.motion.commanded_effort[3000:].any()
    assert abs(run.run.motion.position[-1] - 0.01005) < 2e-4


def test_a_nanometre_is_reached_where_friction_repeats_exactly():
    controller = replace(CONTROLLER, tolerance=1e-9)
    run = run_pulses(PLANT, controller, sampling_time=T, duration=5.0)
    assert run.outcome is REACHED
    assert abs(run.run.motion.position[-1] - 0.01) <= 1e-9


def test_inside_the_tolerance_nothing_is_fired():
    for target in (0.0, 0.999e-6, -0.999e-6):
        controller = replace(CONTROLLER, target=target)
        run = run_pulses(PLANT, controller, sampling_time=T, duration=1.0)
        assert run.outcome is REACHED
        assert not run.run.motion.commanded_effort.any()


@pytest.mark.parametrize("to", [0.0, 0.013, -0.02])
def test_pushed_away_it_begins_anew(to):
    controller = replace(CONTROLLER, tolerance=1.9e-5, rest=ENCODER, position_noise=SAMPLE_NOISE)
    plants = iter(lambda: PLANT, None)
    efforts, positions, state = lived(
        controller, plants, 600, step=1e-6, noise=1e-6, push=(300, to)
    )
    assert abs(positions[299] - 0.01) < 2e-5
    assert efforts[300:].any()
    assert controller.outcome(state) is REACHED
    assert abs(positions[-1] - 0.01) < 2e-5


def test_pushed_away_after_it_has_given_up_it_tries_again():
    plant = SingleMass(mass=150.0, friction=symmetric(250.0, 301.0, 0.0))
    plants = iter([plant] * 11 + [PLANT] * 20)
    efforts, positions, state = lived(CONTROLLER, plants, 900, push=(400, 0.002))
    assert not efforts[200:400].any()
    assert efforts[400:].any()
    assert CONTROLLER.outcome(state) is REACHED
    assert abs(positions[-1] - 0.01) < 1e-6


@pytest.mark.parametrize("moment", [3, 8, 20, 200])
def test_another_target_is_taken_up_at_rest_or_after_the_pulse(moment):
    stepper = PlantStepper(PLANT, sampling_time=T)
    plant_state, (x, v) = stepper.init(), (0.0, 0.0)
    state, efforts = CONTROLLER.init(), []
    for k in range(600):
        if k == moment:
            state = CONTROLLER.retargeted(state, -0.005)
            assert CONTROLLER.outcome(state) is PositioningOutcome.MOVING
        state, effort = CONTROLLER.step(state, SensorSample(k * T, x, v, math.nan, math.nan))
        plant_state, (x, v) = stepper.step(plant_state, effort)
        efforts.append(effort)
    assert CONTROLLER.outcome(state) is REACHED
    assert abs(x + 0.005) < 1e-6
    assert efforts[0] > 0.0
    if moment < 4:
        assert set(efforts[:5]) == {efforts[0]}  # the pulse is finished
    if moment == 200:
        assert not any(efforts[100:200])
        assert efforts[200] < 0.0


@settings(max_examples=80)
@given(
    ratios=st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=12),
    max_idle_pulses=st.integers(1, 10),
)
def test_it_ends_whatever_its_pulses_do(ratios, max_idle_pulses):
    assert_ended_against(ratios, max_idle_pulses)


@pytest.mark.parametrize(
    "ratios",
    [[0.99], [0.999999], [1.0], [-1.0], [-0.99], [0.5], [2.0, 0.6, 0.6], [-3.0, 0.3], [0.51]],
)
def test_it_ends_though_its_pulses_bring_it_nearer_all_the_time(ratios):
    assert_ended_against(ratios, 10)


def assert_ended_against(ratios, max_idle_pulses):
    """Let every pulse change the error by a factor, in turn, and count the pulses."""
    controller = replace(CONTROLLER, max_idle_pulses=max_idle_pulses)
    state, x, k, fired = controller.init(), 0.0, 0, 0
    bound = most_pulses(controller, 0.01)
    while fired <= bound:
        state, effort = controller.step(state, SensorSample(k * T, x, 0.0, math.nan, math.nan))
        k += 1
        if effort == 0.0:
            break
        aim = 0.01 - (0.01 - x) * ratios[fired % len(ratios)]
        fired += 1
        while effort != 0.0 and pulse.head(state).phase == pulse.PULSING:
            x += 0.3 * (aim - x)
            sample = SensorSample(k * T, x, 0.1, math.nan, math.nan)
            state, effort = controller.step(state, sample)
            k += 1
        x = aim
    assert fired <= bound
    assert controller.outcome(state) in (REACHED, STOPPED)
    assert (controller.why(state) is None) is (controller.outcome(state) is REACHED)
    for _ in range(50):
        state, effort = controller.step(state, SensorSample(k * T, x, 0.0, math.nan, math.nan))
        assert effort == 0.0
