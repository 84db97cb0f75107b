"""The guard of every controller: limits, lost samples, faults of sensors, and loads."""

from dataclasses import replace
from functools import partial
from math import inf, isfinite, nan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from faulty_runs import faulty_run
from simple_controllers import Push, T, interrupted_kernel, pid_controller
from small_scenarios import METHODS, Interpreted, scenario

from stickslip.control import (
    ExactPulseController,
    GuardedController,
    GuardedState,
    Limits,
    PreciseController,
    RestDetection,
    SensorErrors,
)
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import InputError, PositioningOutcome, SensorSample
from stickslip.scenario import ARM_CONTROLLERS, AXIS_CONTROLLERS
from stickslip.simulation import simulate_closed_loop

RUNS = 12  # of each method; the study of positioning with faults has 100 000 on a plant
LIMIT, MASS = 300.0, 150.0
LAW = CoulombViscousFriction.symmetric(
    coulomb_friction=100.0, static_friction=130.0, viscous_friction=700.0
)
AXIS = SingleMass(mass=MASS, friction=LAW)
LIMITS = Limits.for_task(
    mass=MASS, effort_limit=LIMIT, sampling_time=T, places=(0.0, 0.05), duration=2.0
)
NONE = SensorSample(0.0, nan, nan, nan, nan)


def pulses(**changes: Any) -> ExactPulseController:
    settings: dict[str, Any] = {
        "sampling_time": T,
        "target": 0.05,
        "tolerance": 1e-5,
        "rest": RestDetection(samples=2, spread=1e-7),
        "effort_limit": LIMIT,
        "mass": MASS,
        "friction": LAW,
        **changes,
    }
    return ExactPulseController(**settings)


pid = partial(
    pid_controller,
    target=0.05,
    position_gain=1e4,
    integral_gain=0.0,
    velocity_gain=1e3,
    effort_limit=10.0 * LIMIT,
)


class Failing(Push):
    """One whose step raises an error far away."""

    def step(self, state: None, sample: SensorSample) -> tuple[None, float]:
        if sample.measured_position > 1e6:
            raise ZeroDivisionError("far away")
        return super().step(state, sample)


class Terminated(KeyboardInterrupt):
    """A request to terminate, as the command line takes it."""


class Interrupted(Push):
    """One that is interrupted in a compiled step."""

    def step(self, state: None, sample: SensorSample) -> tuple[None, float]:
        interrupted_kernel(Terminated)
        return super().step(state, sample)


def guarded(controller: Any, **limits: Any) -> GuardedController:
    return GuardedController(controller=controller, limits=replace(LIMITS, **limits))


def moved(guard: GuardedController, seconds: float, plant: SingleMass = AXIS) -> Any:
    return simulate_closed_loop(
        plant, guard, sampling_time=T, samples=round(seconds / T), initial_state=(0.0, 0.0)
    )


@pytest.mark.parametrize(("variants", "method"), METHODS)
def test_no_sample_gives_an_effort_beyond_the_limit_or_an_error(variants: Any, method: str) -> None:
    guard = scenario(variants, method).build(Path()).guarded
    for seed in range(RUNS):
        faulty_run(guard, np.random.default_rng(seed), 80)


@pytest.mark.parametrize(("variants", "method"), METHODS)
def test_a_guard_does_not_change_a_run_without_faults(variants: Any, method: str) -> None:
    asked = scenario(variants, method)
    built = asked.build(Path())
    runs = [
        simulate_closed_loop(
            asked.axis.build(),
            controller,
            sampling_time=asked.task.sampling_time,
            samples=asked.task.samples,
        )
        for controller in (Interpreted(built.controller), built.guarded)
    ]
    np.testing.assert_array_equal(runs[1].motion.position, runs[0].motion.position)
    inner, guard = built.controller, built.guarded
    for answer in ("outcome", "why", "estimates", "pulse_count", "phases"):
        plain = getattr(inner, answer)(runs[0].controller_state)
        assert getattr(guard, answer)(runs[1].controller_state) == plain


@pytest.mark.parametrize(("variants", "method"), METHODS)
def test_missing_channels_are_named(variants: Any, method: str) -> None:
    guard = scenario(variants, method).build(Path()).guarded
    state = guard.init()
    for k in range(guard.limits.max_lost + 1):
        assert guard.outcome(state) in (PositioningOutcome.MOVING, None)
        state, effort = guard.step(state, NONE._replace(time=k * guard.sampling_time))
        assert effort == 0.0
    assert guard.outcome(state) is PositioningOutcome.STOPPED
    for name in guard.channels:
        assert name in str(guard.why(state))
    assert "measured_position" in guard.channels


@pytest.mark.parametrize("lost", ["hold", "zero", "brake"])
def test_the_reaction_to_a_lost_sample(lost: Any) -> None:
    guard = guarded(pid(), lost=lost)
    state, effort = guard.step(guard.init(), SensorSample(0.0, 0.05, 0.0, nan, nan))
    assert effort == 0.0
    state, effort = guard.step(state, SensorSample(T, 0.0497, -0.02, nan, nan))
    assert effort == pytest.approx(1e4 * 0.0003 + 1e3 * 0.02)
    _, held = guard.step(state, NONE._replace(time=2 * T))
    braking = 0.02 * LIMITS.braking_gain
    assert held == pytest.approx({"hold": effort, "zero": 0.0, "brake": braking}[lost])


def test_a_pulse_goes_on_where_a_sample_is_lost() -> None:
    guard = guarded(pulses())
    plain = moved(guard, 0.5)
    first = int(np.flatnonzero(plain.log.effort)[0])

    class Lossy:
        def init(self) -> Any:
            return guard.init()

        def step(self, state: Any, sample: SensorSample) -> Any:
            gap = round(sample.time / T) == first + 3
            return guard.step(state, NONE._replace(time=sample.time) if gap else sample)

    lossy = simulate_closed_loop(AXIS, Lossy(), sampling_time=T, samples=50)
    pulse = slice(first, first + 10)
    np.testing.assert_array_equal(lossy.log.effort[pulse], plain.log.effort[pulse])
    assert guard.lost_samples(lossy.controller_state) == 1


def test_leaving_the_travel_brakes_before_the_limit() -> None:
    guard = guarded(Push(0.8 * LIMIT), speed=10.0)
    run = moved(guard, 4.0)
    low, high = LIMITS.travel
    assert low < run.motion.position.min()
    assert 0.7 * high < run.motion.position.max() < high
    assert run.motion.velocity[-1] == 0.0
    assert run.log.effort[-1] == 0.0
    assert "travel" in str(guard.why(run.controller_state))
    # A new target begins anew
    state = guard.retargeted(run.controller_state, 0.0)
    assert guard.why(state) is None
    with pytest.raises(InputError) as caught:
        guard.retargeted(state, 1.0)
    assert caught.value.code == "target_range"


def test_the_mean_speed_of_both_masses_counts_for_the_travel() -> None:
    # Braking takes 0.85 * 300 N from 150 kg and 1350 kg: 0.17 m/s^2
    limits = Limits.for_task(
        mass=MASS, load_mass=1350.0, effort_limit=LIMIT, sampling_time=T, places=(0.0, 0.05)
    )
    for load_speed, leaves in ((-0.02, False), (0.2, True)):
        guard = GuardedController(controller=Push(0.0), limits=limits)
        state = guard.init()
        for k in range(5):  # either stops within 0.1 m of mean motion, or does not
            x, x2 = 0.18 * k * T, load_speed * k * T
            sample = SensorSample(k * T, x, 0.18, x2, load_speed)
            state, _ = guard.step(state, sample)
        assert ("travel" in str(guard.why(state))) is leaves


def test_too_much_speed_is_braked() -> None:
    guard = guarded(Push(LIMIT), speed=0.1, travel=(-100.0, 100.0))
    run = moved(guard, 3.0)
    assert 0.1 < run.motion.velocity.max() < 0.15
    assert run.motion.velocity[-1] == 0.0
    assert "speed" in str(guard.why(run.controller_state))


def test_a_load_above_friction_is_held_and_explained() -> None:
    heavy = SingleMass(mass=MASS, friction=replace(LAW, offset=160.0))
    guard = guarded(pulses(), travel=(-10.0, 10.0), speed=100.0)
    run = moved(guard, 4.0, heavy)
    assert "load is above friction" in str(guard.why(run.controller_state))
    assert np.abs(run.motion.position).max() < 0.1
    assert np.ptp(run.motion.position[-100:]) < 1e-3
    # A push of less time than it takes to be sure is none
    free = guarded(Push(0.0))
    state = free.init()
    for k in range(60):
        x = 0.5 * 0.4 * (min(k, 15) * T) ** 2
        state, _ = free.step(
            state, SensorSample(k * T, x, 0.4 * T * k if k < 15 else 0.0, nan, nan)
        )
    assert free.why(state) is None


@pytest.mark.parametrize(("deceleration", "falls"), [(0.6, False), (-0.6, True)])
def test_a_load_is_found_among_the_errors_of_the_positions(
    deceleration: float, falls: bool
) -> None:
    """An axis that coasts, or that a load accelerates, seen through 0.2 mm of noise."""
    noise = 2e-4
    limits = Limits.for_task(
        mass=MASS, effort_limit=LIMIT, sampling_time=T, places=(0.0, 2.0),
        sensors=SensorErrors(noise=noise),
    )  # fmt: skip
    generator, named = np.random.default_rng(2), 0
    for _ in range(50):
        guard = GuardedController(controller=Push(0.0), limits=limits)
        state = guard.init()
        for k in range(100):
            t = k * T if falls else min(k * T, 0.3 / deceleration)
            x = 0.3 * t - 0.5 * deceleration * t * t + noise * float(generator.normal())
            state, _ = guard.step(state, SensorSample(k * T, x, nan, nan, nan))
        named += "load is above friction" in str(guard.why(state))
    assert named == (50 if falls else 0)


def test_bristles_that_spring_back_are_no_load() -> None:
    """Half a swing of 3 mm in 0.8 s, of which the first 0.64 s are looked at."""
    guard = guarded(Push(0.0))
    state = guard.init()
    for k in range(200):
        t = min(k * T, 0.8)
        x = 1.5e-3 * (1.0 - np.cos(np.pi * t / 0.8))
        v = 1.5e-3 * np.pi / 0.8 * np.sin(np.pi * t / 0.8)
        state, _ = guard.step(state, SensorSample(k * T, x, v, nan, nan))
    assert guard.why(state) is None


def test_velocities_may_be_differences_of_encoder_positions() -> None:
    """At 1 kHz a step of 0.1 mm is a velocity of 0.1 m/s, more than any force makes in a sample."""
    period, step, effort = 1e-3, 1e-4, 120.0
    limits = Limits.for_task(
        mass=MASS, effort_limit=LIMIT, sampling_time=period, places=(0.0, 0.05),
        sensors=SensorErrors(encoder_step=step),
    )  # fmt: skip
    push = Push(effort)
    push.sampling_time = period
    guard = GuardedController(controller=push, limits=limits)
    state, before = guard.init(), 0.0
    for k in range(500):
        x = step * round(0.08 * k * period / step)
        sample = SensorSample(k * period, x, (x - before) / period, nan, nan)
        state, sent = guard.step(state, sample)
        before = x
        assert sent == effort
    assert guard.lost_samples(state) == 0


def test_a_position_that_no_force_explains_is_rejected() -> None:
    guard = guarded(pid(effort_limit=LIMIT))

    class Glitchy:
        def init(self) -> Any:
            return guard.init()

        def step(self, state: Any, sample: SensorSample) -> Any:
            wrong = 1.0 if round(sample.time / T) % 10 == 5 else 0.0
            shifted = sample._replace(measured_position=sample.measured_position + wrong)
            return guard.step(state, shifted)

    run = simulate_closed_loop(AXIS, Glitchy(), sampling_time=T, samples=200)
    assert run.motion.position[-1] == pytest.approx(0.05, abs=0.02)
    assert guard.lost_samples(run.controller_state) == 20
    # One that stays is a fault of the encoder
    state = guard.init()
    for k in range(40):
        state, effort = guard.step(
            state, SensorSample(k * T, 0.0 if k < 10 else 1.0, 0.0, nan, nan)
        )
    assert "jumps" in str(guard.why(state))
    assert effort == 0.0


@pytest.mark.parametrize("velocity", [0.0, nan])
@pytest.mark.parametrize("wrong", [0, 1, 2])
def test_a_controller_begins_anew_after_a_glitch_in_the_first_samples(
    wrong: int, velocity: float
) -> None:
    """As if it had begun with the first sample from which on positions agree."""
    guard = guarded(pulses())

    def efforts(positions: list[float]) -> tuple[list[float], GuardedState]:
        state, sent = guard.init(), []
        for k, x in enumerate(positions):
            state, effort = guard.step(state, SensorSample(k * T, x, velocity))
            sent.append(effort)
        return sent, state

    rest = [0.0] * 20
    seen, state = efforts([*rest[:wrong], 0.01, *rest[wrong:]])
    begun, _ = efforts(rest)
    assert guard.why(state) is None
    assert guard.lost_samples(state) == 1
    lost = 2 - wrong  # a pulse goes on where a sample is lost
    assert seen[lost : lost + 9] == begun[:9]


def test_a_lost_sample_does_not_agree_with_a_glitch() -> None:
    guard = guarded(pulses())
    state = guard.init()
    for k, x in enumerate((0.03, nan, 0.0)):
        state, _ = guard.step(state, SensorSample(k * T, x, 0.0))
    assert guard.lost_samples(state) == 2


def test_a_new_target_holds_after_a_glitch_in_the_first_sample() -> None:
    plain = PreciseController(pulses=pulses())
    guard = guarded(plain)
    state, first = guard.step(guard.init(), SensorSample(0.0, 0.06, 0.0))
    assert first < 0.0  # a move that the right position does not need
    state = guard.retargeted(state, 0.02)
    begun = plain.retargeted(plain.init(), 0.02)
    for k in range(1, 5):
        seen = SensorSample(k * T, 0.0, 0.0, nan, nan)
        state, effort = guard.step(state, seen)
        if k > 1:  # the second one agrees with the first
            begun, expected = plain.step(begun, seen)
            assert effort == expected > 0.0


def test_frozen_sensors_are_detected() -> None:
    # By the velocity, which the position does not follow
    guard = guarded(pid())
    state = guard.init()
    for k in range(100):
        state, _ = guard.step(state, SensorSample(k * T, 0.01, 0.0 if k < 3 else 0.1, nan, nan))
    assert "frozen" in str(guard.why(state))
    # By the noise that is missing, and not where it is there
    noisy = Limits.for_task(
        mass=MASS, effort_limit=LIMIT, sampling_time=T, places=(0.0, 0.05),
        sensors=SensorErrors(noise=1e-6, encoder_step=1e-6),
    )  # fmt: skip
    guard = GuardedController(
        controller=pid(velocity="differentiated", filter_time=T), limits=noisy
    )
    generator = np.random.default_rng(1)
    state = guard.init()
    for k in range(3000):
        x = 1e-6 * round(float(generator.normal()))
        state, _ = guard.step(state, SensorSample(k * T, x, nan, nan, nan))
        if guard.why(state) is not None:
            break
    assert "blocked" in str(guard.why(state))  # and not frozen, as its noise is there
    state = guard.init()
    for k in range(100):
        state, _ = guard.step(state, SensorSample(k * T, 0.0, nan, nan, nan))
    assert "frozen" in str(guard.why(state))


def test_an_error_of_a_controller_stops_the_axis(caplog: pytest.LogCaptureFixture) -> None:
    guard = guarded(Failing(1.0), travel=(-1e9, 1e9), acceleration=1e30, speed=1e9)
    state, effort = guard.step(guard.init(), SensorSample(0.0, 0.0, 0.0, nan, nan))
    assert effort == 1.0
    state, effort = guard.step(state, SensorSample(T, 2e6, 0.0, nan, nan))
    assert isfinite(effort)
    assert "failed" in str(guard.why(state))
    assert "far away" in caplog.text
    # It is not called again
    caplog.clear()
    state, effort = guard.step(state, SensorSample(2.0 * T, 2e6, 0.0, nan, nan))
    assert isfinite(effort)
    assert not caplog.text


def test_a_guard_lets_an_interruption_through() -> None:
    guard = guarded(Interrupted(1.0))
    with pytest.raises(Terminated):
        guard.step(guard.init(), SensorSample(0.0, 0.0, 0.0, nan, nan))


@pytest.mark.parametrize("share", [0.6, 0.9, 1.5, 3.0])
@pytest.mark.parametrize("glitches", [1, 2, 3])
def test_glitches_at_rest_do_not_move_the_axis(glitches: int, share: float) -> None:
    """They are off by a share of what the largest acceleration would do in two samples."""
    guard = guarded(pulses(target=0.0), travel=(-10.0, 10.0), speed=100.0)
    off = share * 2.0 * guard.limits.acceleration * T * T
    state = guard.init()
    for k in range(80):
        seen = off if 40 <= k < 40 + glitches else 0.0
        state, effort = guard.step(state, SensorSample(k * T, seen, np.nan, np.nan, np.nan))
        assert effort == 0.0
    assert guard.outcome(state) is PositioningOutcome.REACHED


def test_an_axis_that_was_displaced_at_rest_is_followed() -> None:
    """Five equal positions in a row may be glitches, the sixth is not: pulses begin."""
    guard = guarded(pulses(target=0.0), travel=(-10.0, 10.0), speed=100.0)
    off, state, efforts = 3.0 * guard.limits.acceleration * T * T, guard.init(), []
    for k in range(120):
        seen = off if k >= 40 else 0.0
        state, effort = guard.step(state, SensorSample(k * T, seen, np.nan, np.nan, np.nan))
        efforts.append(effort)
    assert not np.any(efforts[:45])
    assert np.any(efforts[45:])


def test_a_glitch_is_no_way_out_of_the_travel() -> None:
    guard = guarded(pulses(), travel=(-0.05, 0.1), acceleration=1e6, speed=1e9)
    state = guard.init()
    for k, x in enumerate([0.0, 0.0, 0.2, 0.0, 0.0]):
        state, _ = guard.step(state, SensorSample(k * T, x, nan, nan, nan))
    assert guard.why(state) is None
    for k in range(5, 8):
        state, _ = guard.step(state, SensorSample(k * T, 0.2, nan, nan, nan))
    assert "travel" in str(guard.why(state))


@pytest.mark.parametrize("value", [1e308, 1e200, inf])
def test_values_that_no_sensor_shows_give_no_infinite_effort(value: float) -> None:
    guard = guarded(pid())
    for seed in range(50):
        generator, state = np.random.default_rng(seed), guard.init()
        for k in range(60):
            x, v = generator.choice([0.0, 0.0, value, -value], 2)
            state, effort = guard.step(state, SensorSample(k * T, x, v, nan, nan))
            assert abs(effort) <= LIMIT  # nor one that is NaN


def test_a_move_has_a_time_limit_where_it_ends() -> None:
    stuck = SingleMass(mass=MASS, friction=replace(LAW, static_friction_positive=299.9))
    guard = guarded(pulses(max_idle_pulses=10**6), time=0.5, stall=inf)
    run = moved(guard, 2.0, stuck)
    assert "time limit" in str(guard.why(run.controller_state))
    held = guarded(pid(effort_limit=LIMIT, integral_gain=100.0), time=0.5)
    run = moved(held, 2.0)
    assert held.why(run.controller_state) is None


@pytest.mark.parametrize("variants", [AXIS_CONTROLLERS, ARM_CONTROLLERS])
def test_an_axis_that_leaves_its_target_is_brought_back(variants: Any) -> None:
    asked = scenario(variants, "landing")
    built = asked.build(Path()).guarded
    guard = replace(built, limits=replace(built.limits, time=None))
    axis = asked.axis.build()
    samples = 4 * asked.task.samples
    run = simulate_closed_loop(axis, guard, sampling_time=asked.task.sampling_time, samples=samples)
    state, target = run.controller_state, asked.task.all_targets[0]
    assert guard.outcome(state) is PositioningOutcome.REACHED
    end = samples * asked.task.sampling_time
    aside = target - 20.0 * asked.task.tolerance

    class Resumed:
        def init(self) -> Any:
            return state

        def step(self, now: Any, sample: SensorSample) -> Any:
            return guard.step(now, sample._replace(time=sample.time + end))

    start = (aside, 0.0, aside, 0.0) if axis.flexible else (aside, 0.0)
    run = simulate_closed_loop(
        axis,
        Resumed(),
        sampling_time=asked.task.sampling_time,
        samples=samples,
        initial_state=start,
    )
    assert guard.outcome(run.controller_state) is PositioningOutcome.REACHED
    assert abs(run.motion.position[-1] - target) <= 2.0 * asked.task.tolerance


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"effort": 0.0}, "not_positive"),
        ({"effort": inf}, "not_finite"),
        ({"travel": (1.0, 0.0)}, "travel_range"),
        ({"travel": (-inf, 0.0)}, "travel_range"),
        ({"max_lost": -1}, "negative_samples"),
    ],
)
def test_limits_out_of_range(changes: dict[str, Any], code: str) -> None:
    with pytest.raises(InputError) as caught:
        replace(LIMITS, **changes)
    assert caught.value.code == code
