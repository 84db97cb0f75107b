"""Estimates of the exact pulse controller, against references that share nothing with it."""

import json
import math
from dataclasses import replace

import exact_pulses
import numpy as np
import pytest
from exact_pulses import ENCODER, ENCODER_ONLY, IDEAL, T, controller_for, driven
from laws import uneven
from pulse_runs import run_pulses
from random_axes import random_axes
from refusals import refuses
from scipy.optimize import least_squares

from stickslip.control import ExactPulseController, RestDetection
from stickslip.control.pulses import exact_state as at
from stickslip.control.pulses import kernel as pulse
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import LearnedPulses, PositioningOutcome, SensorSample
from stickslip.simulation import Sensors, simulate, simulate_closed_loop

UNEVEN = uneven(coulomb=(90.0, 115.0), static=(120.0, 135.0), viscous=(650.0, 800.0), offset=15.0)
PLANT = SingleMass(mass=150.0, friction=UNEVEN)
CONTROLLER = replace(exact_pulses.CONTROLLER, mass=145.0)
MEANS_APART = 0.02  # standard deviations: slopes by differences, both here and there
COVARIANCE_APART = 0.01  # of the product of two standard deviations
# The law is trusted to 1e-4 of a displacement, and what it says of friction is a few times worse
RECOVERED = {"mass": 1e-3, "coulomb_friction": 1e-3, "viscous_friction": 2e-2}
ABOVE_TRUTH = 1e-3  # as the Coulomb friction is known no better than that


def moments(state):
    """Return mean and covariance of the logarithms."""
    own = at.own_fields(state)
    return own.values.copy(), own.covariance.copy()


class OnePulse:
    """A controller that lets another fire one pulse, and then leaves it and its state alone."""

    def __init__(self, controller):
        self._controller = controller
        self.sampling_time = controller.sampling_time
        self.before = self.after = None
        self.decided = 0.0

    def init(self):
        return self._controller.init()

    def step(self, state, sample):
        if self.after is not None:
            return state, 0.0
        before = state
        state, effort = self._controller.step(state, sample)
        if self._controller.pulse_count(state) == 1:
            self.before, self.after, effort = before, state, 0.0
            self.decided = sample.time
        return state, effort


def most_probable(controller, once, log, *, inflation=1.0):
    """Return mean, covariance and mean square residual from the simulator and least squares."""
    record = controller.last_pulse(once.after)
    effort, width = record.levels[0]
    period, stride = controller.sampling_time, int(pulse.head(once.before).stride)
    first, last = round(record.time / period), round(once.decided / period)
    later = np.arange(1, pulse.TRACE_SIZE) * stride
    later = later[later <= last - first]
    rest = controller.target - record.error
    seen = log.measured_position[first + later] - rest
    rest_noise = controller.position_noise / math.sqrt(controller.rest.samples)
    coarse = 1e-4 * record.achieved_displacement
    spread = np.full(later.size + 1, math.hypot(rest_noise, controller.position_noise, coarse))
    spread[-1] = math.hypot(rest_noise, rest_noise, coarse)
    spread *= math.sqrt(inflation)
    prior, P = moments(controller.init())
    P[1:, 1:] += 1e-6 * np.eye(4)  # by which friction is first taken to walk
    whiten = np.linalg.inv(np.linalg.cholesky(P))
    efforts = np.zeros(max(later[-1], round(width / period)) + 4000)
    efforts[: round(width / period)] = effort

    def residuals(logarithms):
        mass, *friction = np.exp(logarithms).tolist()
        law = uneven(coulomb=friction, static=friction, viscous=(friction[2], friction[3]))
        x = simulate(SingleMass(mass=mass, friction=law), efforts, sampling_time=period).position
        model = np.append(x[np.maximum(later - controller.rest.delay, 0)], x[-1])
        misfit = (np.append(seen, record.achieved_displacement) - model) / spread
        return np.concatenate((misfit, whiten @ (logarithms - prior)))

    found = least_squares(residuals, prior, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    fit = found.fun[: later.size + 1]
    return found.x, np.linalg.inv(found.jac.T @ found.jac), float(np.mean(fit**2)) * inflation


@pytest.mark.parametrize(
    ("target", "delay", "period"),
    [(0.01, 0, T), (-0.01, 0, T), (0.004, 2, T), (0.01, 0, 0.001), (-0.02, 1, 0.001)],
)
def test_the_posterior_of_a_pulse_is_that_of_least_squares_on_the_simulator(target, delay, period):
    rest = RestDetection.for_encoder(resolution=1e-6, noise=1e-6, samples=10, delay=delay)
    controller = replace(
        CONTROLLER,
        sampling_time=period,
        target=target,
        tolerance=2e-5,
        rest=rest,
        position_noise=2e-6,  # more than there is, so that the law is not doubted
    )
    once = OnePulse(controller)
    run = simulate_closed_loop(
        PLANT,
        once,
        sampling_time=period,
        samples=round(1.0 / period),
        sensors=replace(ENCODER_ONLY, delay=delay),
        generator=np.random.default_rng(5),
    )
    mean, covariance = moments(once.after)
    expected, expected_covariance, misfit = most_probable(controller, once, run.log)
    assert misfit < 1.0
    deviation = np.sqrt(np.diag(expected_covariance))
    assert np.abs(mean - expected) == pytest.approx(0.0, abs=MEANS_APART * deviation.min())
    apart = np.abs(covariance - expected_covariance) / np.outer(deviation, deviation)
    assert apart.max() < COVARIANCE_APART
    if period < T:
        assert pulse.head(once.before).stride > 1  # else a longer pulse would do to see it thinned


def test_noise_that_was_not_told_is_found_out():
    controller = replace(CONTROLLER, tolerance=2e-5, rest=ENCODER, position_noise=2e-7)
    once = OnePulse(controller)
    run = simulate_closed_loop(
        PLANT,
        once,
        sampling_time=T,
        samples=100,
        sensors=ENCODER_ONLY,
        generator=np.random.default_rng(5),
    )
    _, _, misfit = most_probable(controller, once, run.log)
    assert misfit > 4.0
    expected, expected_covariance, _ = most_probable(controller, once, run.log, inflation=misfit)
    mean, covariance = moments(once.after)
    deviation = np.sqrt(np.diag(expected_covariance))
    assert np.all(np.abs(mean - expected) < 0.1 * deviation)
    assert np.sqrt(np.diag(covariance)) == pytest.approx(deviation, rel=0.05)


def test_mass_and_friction_of_either_direction_are_recovered_offset_included():
    controller, position = CONTROLLER, 0.0
    for target in (0.01, -0.01, 0.005, -0.004):
        controller = replace(controller, target=target)
        run = run_pulses(
            PLANT, controller, sampling_time=T, duration=2.0, initial_state=(position, 0.0)
        )
        assert run.outcome is PositioningOutcome.REACHED
        position = float(run.run.motion.position[-1])
        controller = controller.resumed(controller.learned(run.run.controller_state))
    found = controller.estimates(controller.init())
    truth = {
        "mass": 150.0,
        "coulomb_friction_positive": 90.0 + 15.0,
        "coulomb_friction_negative": 115.0 - 15.0,
        "viscous_friction_positive": 650.0,
        "viscous_friction_negative": 800.0,
    }
    for name, value in truth.items():
        quantity = name.removesuffix("_positive").removesuffix("_negative")
        assert found[name] == pytest.approx(value, rel=RECOVERED[quantity]), name


@pytest.mark.parametrize(
    ("period", "target", "mass", "coulomb", "viscous", "guess"),
    [
        (0.0021, -0.143, 1490.0, 1.28e6, 2850.0, 372e3),
        (0.00069, 0.000488, 1061.0, 102.4e3, 9675.0, 31.1e3),
    ],
)
def test_a_first_guess_far_from_the_truth_does_not_mislead(
    period, target, mass, coulomb, viscous, guess
):
    # The first pulse goes a tenth of the way expected, where the slopes at the guess are useless
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=coulomb, static_friction=1.1 * coulomb, viscous_friction=viscous
    )
    step = 1e-4 * abs(target)
    controller = ExactPulseController(
        sampling_time=period,
        target=target,
        tolerance=20 * step,
        rest=RestDetection.for_encoder(resolution=step, noise=step, samples=10),
        effort_limit=2.5 * coulomb,
        mass=mass,
        friction=CoulombViscousFriction.symmetric(
            coulomb_friction=guess, static_friction=1.2 * guess, viscous_friction=viscous
        ),
        position_noise=step,
    )
    for seed in range(5):
        run = run_pulses(
            SingleMass(mass=mass, friction=law),
            controller,
            sampling_time=period,
            duration=500 * period,
            sensors=Sensors(encoder_step=step, position_noise=step, velocity="none"),
            generator=np.random.default_rng(seed),
        )
        assert run.outcome is PositioningOutcome.REACHED
        assert np.abs(run.run.motion.position).max() < 1.5 * abs(target)
        side = "positive" if target > 0 else "negative"
        found = run.estimates[f"coulomb_friction_{side}"][-1]
        assert found == pytest.approx(coulomb, rel=0.05)


def test_the_breakaway_interval_holds_the_truth():
    freed = held = 0
    for axis in random_axes(np.random.default_rng(11), 40):
        law = axis.plant.friction
        truth = (
            law.static_friction_positive + law.offset,
            law.static_friction_negative - law.offset,
        )
        controller = controller_for(axis, rest=IDEAL, position_noise=0.0, tolerance=1e-7)
        step, state = controller.step, controller.init()
        states = []

        def noted(state, sample, step=step, states=states):
            state, effort = step(state, sample)
            states.append(state)
            return state, effort

        class Noting:
            init = staticmethod(controller.init)
            step = staticmethod(noted)

        simulate_closed_loop(axis.plant, Noting(), sampling_time=T, samples=150)
        for state in states[:: len(states) // 15] + states[-1:]:
            for side in range(2):
                own = at.own_fields(state)
                low, high = own.held[side], own.moved_at[side]
                estimated = own.breakaway[side]
                assert low <= truth[side] * (1.0 + ABOVE_TRUTH)
                assert high >= truth[side] or high == axis.effort_limit
                held += low > law.coulomb_friction_positive * 1.01
                freed += high < axis.effort_limit
                if controller.pulse_count(state) and freed:
                    assert estimated >= low * (1.0 - ABOVE_TRUTH)
    assert held > 0
    assert freed > 0


def fed(controller, positions, velocities=None):
    """Feed samples to a controller, return its last state."""
    state = controller.init()
    for k, x in enumerate(positions):
        v = 0.0 if velocities is None else velocities[k]
        sample = SensorSample(controller.sampling_time * k, x, v, math.nan, math.nan)
        state, _ = controller.step(state, sample)
    return state


@pytest.mark.parametrize("displacement", [0.0, -0.002])
def test_a_pulse_that_moved_nothing_or_backwards_teaches_nothing_of_the_law(displacement):
    positions = [0.0] * 5 + [displacement] * 2
    velocities = [0.0] + [0.1] * 4 + [0.1, 0.0]
    state = fed(CONTROLLER, positions, velocities)
    record = CONTROLLER.last_pulse(state)
    assert record is not None
    assert record.levels[0][0] > 0.0
    assert record.achieved_displacement == displacement
    for before, after in zip(moments(CONTROLLER.init()), moments(state), strict=True):
        assert np.array_equal(before, after)
    # But of the breakaway it does: it has not freed the axis in its direction
    assert CONTROLLER.estimates(state)["static_friction_positive"] > record.levels[0][0]


def test_a_sudden_change_of_friction_is_followed():
    controller, position = CONTROLLER, 0.0
    for k, factor in enumerate([1.0] * 12 + [1.4] * 4 + [0.7] * 4):
        law = UNEVEN
        changed = CoulombViscousFriction(
            **{
                name: getattr(law, name) * (1.0 if name == "offset" else factor)
                for name in law.__dataclass_fields__
            }
        )
        controller = replace(controller, target=position + (0.01 if k % 2 else -0.01))
        run = run_pulses(
            SingleMass(mass=150.0, friction=changed),
            controller,
            sampling_time=T,
            duration=3.0,
            initial_state=(position, 0.0),
        )
        assert run.outcome is PositioningOutcome.REACHED, k
        position = float(run.run.motion.position[-1])
        controller = controller.resumed(controller.learned(run.run.controller_state))
    found = controller.estimates(controller.init())
    assert found["coulomb_friction_positive"] == pytest.approx(0.7 * 90.0 + 15.0, rel=0.01)
    assert found["coulomb_friction_negative"] == pytest.approx(0.7 * 115.0 - 15.0, rel=0.01)
    assert found["viscous_friction_positive"] == pytest.approx(0.7 * 650.0, rel=0.05)
    assert found["viscous_friction_negative"] == pytest.approx(0.7 * 800.0, rel=0.05)


def test_what_was_learned_survives_to_the_next_run_and_saves_pulses():
    first = again = fewer = anew = 0
    for axis in random_axes(np.random.default_rng(3), 40):
        controller = controller_for(axis, position_noise=1e-6)

        def count(controller, axis=axis):
            state = driven(axis, controller, samples=500).controller_state
            assert controller.outcome(state) is PositioningOutcome.REACHED
            return controller.pulse_count(state), state

        pulses, state = count(controller)
        saved = json.loads(json.dumps(controller.learned(state).to_dict()))
        read = LearnedPulses.from_dict(saved)
        resumed = controller.resumed(read)
        assert resumed.estimates(resumed.init()) == pytest.approx(
            controller.estimates(state), rel=1e-12
        )
        assert np.array_equal(moments(resumed.init())[1], moments(state)[1])
        next_pulses, _ = count(resumed)
        assert next_pulses <= pulses
        first, again, fewer = first + pulses, again + next_pulses, fewer + (next_pulses < pulses)
        unsure = controller.resumed(read, keep_covariance=False)
        assert np.array_equal(moments(unsure.init())[1], moments(controller.init())[1])
        anew += count(unsure)[0]
    assert fewer >= 30
    assert again <= 50
    assert anew >= again


def learned():
    return CONTROLLER.learned(CONTROLLER.init())


@pytest.mark.parametrize(
    ("wrong", "code"),
    [
        ({"values": {"mass": 1.0}}, "learned_lacks"),
        ({"covariance": -np.eye(5)}, "covariance_not_definite"),
        ({"covariance": np.triu(np.ones((5, 5)))}, "covariance_not_definite"),
        ({"values": {**learned().values, "mass": -1.0}}, "not_positive"),
        ({"values": {**learned().values, "coulomb_friction_negative": 0.0}}, "not_positive"),
    ],
)
def test_what_cannot_be_resumed_is_refused(wrong, code):
    with refuses(code):
        CONTROLLER.resumed(replace(learned(), **wrong))


def test_what_was_saved_with_no_uncertainty_at_all_is_still_followed():
    values = {**learned().values, "friction_walk": 0.0, "static_friction_positive": 290.0}
    sure = replace(learned(), values=values, covariance=np.zeros((5, 5)))
    controller = replace(CONTROLLER.resumed(sure), effort_limit=250.0)
    run = run_pulses(PLANT, controller, sampling_time=T, duration=5.0)
    assert np.isfinite(at.own_fields(run.run.controller_state).values).all()
    assert np.abs(run.run.motion.commanded_effort).max() <= 250.0
    assert run.outcome is PositioningOutcome.REACHED


@pytest.mark.parametrize("estimated", [310.0, 1000.0, 1e4])
def test_friction_estimated_above_the_limit_is_found_to_be_below(estimated):
    names = ("coulomb_friction_positive", "static_friction_positive")
    values = {**learned().values, **dict.fromkeys(names, estimated)}
    controller = replace(CONTROLLER.resumed(replace(learned(), values=values)), tolerance=1e-5)
    run = run_pulses(PLANT, controller, sampling_time=T, duration=5.0)
    assert run.outcome is PositioningOutcome.REACHED
    assert len(run.pulses) <= 7  # an effort that fails is followed by one half as large again
    found = run.estimates["coulomb_friction_positive"][-1]
    assert found == pytest.approx(90.0 + 15.0, rel=0.02)
