"""The controller of moves and pulses: what a move teaches, how long it takes, what it survives."""

from dataclasses import replace
from math import ceil, inf, isfinite, nan, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refuses
from scipy.integrate import quad

from stickslip import (
    CoulombViscousFriction,
    ExactPulseController,
    SensorSample,
    SingleMass,
    StribeckFriction,
)
from stickslip.control import PreciseController, RestDetection
from stickslip.control.feedback import profile_kernels
from stickslip.control.precise import braking, holding
from stickslip.control.precise import learning as at
from stickslip.control.precise.servo import retarget_servo, servo_effort, start_servo
from stickslip.control.pulses import exact_learning, exact_state
from stickslip.control.pulses.kernel import head
from stickslip.records import PositioningOutcome
from stickslip.simulation import ClosedLoopRun, Sensors, simulate, simulate_closed_loop

T, MASS = 1e-2, 150.0
LAW = CoulombViscousFriction.symmetric(
    coulomb_friction=100.0, static_friction=130.0, viscous_friction=700.0
)
GUESS = CoulombViscousFriction.symmetric(coulomb_friction=75.0, viscous_friction=500.0)
PULSES = ExactPulseController(
    sampling_time=T,
    target=0.01,
    tolerance=2e-5,
    effort_limit=300.0,
    mass=1.05 * MASS,
    friction=GUESS,
    rest=RestDetection.for_encoder(resolution=1e-6, noise=1e-6, samples=10),
    position_noise=1.1e-6,
)
PRECISE = PreciseController(pulses=PULSES)
FRICTION_LEARNED = 0.05
"""Relative: 1 um of noise is 1e-4 of the way. Found: 0.02 at most."""


def moved(
    controller: PreciseController, *, delay: int = 0, target: float = 0.01, samples: int = 200
) -> ClosedLoopRun[Any]:
    """Return the run of a controller on the axis."""
    pulses = replace(controller.pulses, target=target)
    return simulate_closed_loop(
        SingleMass(mass=MASS, friction=LAW),
        replace(controller, pulses=pulses),
        sampling_time=controller.sampling_time,
        samples=samples,
        sensors=Sensors(position_noise=1e-6, encoder_step=1e-6, velocity="none", delay=delay),
        generator=np.random.default_rng(3),
    )


def shortest(limit: float, way: float) -> float:
    """Return the time of accelerating and braking at the limit, by the speeds on a fine grid."""

    def part(sign: float, v: float) -> tuple[float, float]:
        def rate(w: float) -> float:
            return MASS / (limit - sign * (100.0 + 700.0 * w))

        return quad(rate, 0.0, v)[0], quad(lambda w: w * rate(w), 0.0, v)[0]

    low, high = 0.0, 0.999 * (limit - 100.0) / 700.0
    for _ in range(60):
        v = 0.5 * (low + high)
        low, high = (v, high) if part(1.0, v)[1] + part(-1.0, v)[1] < way else (low, v)
    return part(1.0, low)[0] + part(-1.0, low)[0]


@given(
    f=st.floats(-1e3, 1e3), u=st.floats(-1e3, 1e3), lag=st.floats(0.1, 3.0), h=st.floats(0.01, 2.0)
)
def test_an_effort_behind_a_lag_is_integrated(f: float, u: float, lag: float, h: float) -> None:
    def effort(t: float) -> float:
        return u + (f - u) * float(np.exp(-t / lag))

    end, mean, double = at.lagging(f, u, lag, h)
    size = max(abs(f), abs(u), 1.0)
    assert end == pytest.approx(effort(h), abs=1e-9 * size)
    assert mean == pytest.approx(quad(effort, 0.0, h)[0] / h, abs=1e-8 * size)
    twice = quad(lambda t: (h - t) * effort(t), 0.0, h)[0]
    assert double == pytest.approx(twice / h**2, abs=1e-8 * size)


@pytest.mark.parametrize("target", [0.01, -0.02])
def test_a_move_teaches_mass_friction_and_delay(target: float) -> None:
    run = moved(PRECISE, target=target, delay=2, samples=60)
    p = at.own_fields(run.controller_state)
    side = "positive" if target > 0.0 else "negative"
    found = PRECISE.estimates(run.controller_state)
    assert found["mass"] == pytest.approx(MASS, rel=FRICTION_LEARNED)
    assert found[f"coulomb_friction_{side}"] == pytest.approx(100.0, rel=2.0 * FRICTION_LEARNED)
    assert at.delay_of(int(p.best)) + at.lag_of(int(p.best)) == pytest.approx(2.0, abs=0.5)
    known = PRECISE.learned_delay(run.controller_state)
    assert known is not None
    assert head(run.controller_state[at.SIZE :]).delay >= known / T


@pytest.mark.parametrize("delay", [9, 15])
@pytest.mark.parametrize("given", [True, False])
def test_a_long_delay_is_learned_or_taken_as_given(delay: int, given: bool) -> None:
    controller = replace(PRECISE, delay=delay * T if given else None)
    run = moved(controller, delay=delay, samples=400)
    assert controller.outcome(run.controller_state) is PositioningOutcome.REACHED
    assert controller.learned_delay(run.controller_state) == pytest.approx(delay * T, abs=0.5 * T)


def test_the_recursion_is_weighted_least_squares() -> None:
    precise = replace(PRECISE, delay=0.0)  # the best model stays the first
    run = moved(precise, samples=8)
    x, u = run.log.measured_position - run.log.measured_position[0], run.log.effort
    state, start = precise.init(), at.own_fields(precise.init())
    speeds: list[float] = []
    for k in range(8):
        sample = SensorSample(k * T, float(run.log.measured_position[k]), nan, nan, nan)
        state, effort = precise.step(state, sample)
        assert effort == pytest.approx(float(u[k]))
        speeds.append(float(at.own_fields(state).v))
    p = at.own_fields(state)
    assert p.moving
    assert start.moving == 0
    # The model without delay and lag, by a batch: rows over their deviation, and the prior
    once = np.concatenate([[0.0], np.cumsum(u[:7]) * T])
    twice = np.concatenate([[0.0], np.cumsum(once[:-1] * T + 0.5 * u[:7] * T * T)])
    steps = 0.5 * T * (x[1:8] + x[:7]) - T * T * np.diff(speeds) / 12.0
    area = np.concatenate([[0.0], np.cumsum(steps)])
    tau = np.arange(8) * T
    A = np.column_stack([x[:8], 0.5 * tau**2, area, tau])[1:]
    mass = 1.05 * MASS
    deviation = mass * np.sqrt(1.1e-6**2 + (5e-4 * x[1:8]) ** 2)
    both = sqrt(0.5**2 + 0.2**2)
    bend = 75.0 * sqrt(2.0 * 1e-5 * mass / (300.0 - 75.0))
    prior = np.array([mass, 75.0, 500.0, 0.0])
    spread = np.array([0.05 * mass, both * 75.0, both * 500.0, bend])
    rows = np.vstack([A / deviation[:, None], np.diag(1.0 / spread)])
    right = np.concatenate([twice[1:8] / deviation, prior / spread])
    expected = np.linalg.lstsq(rows, right, rcond=None)[0]
    np.testing.assert_allclose(p.values[0], expected, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(("ratio", "longest"), [(3.0, 1.2), (10.0, 1.3)])
@pytest.mark.parametrize("target", [0.01, -0.02])
def test_a_move_takes_little_more_than_the_shortest_time(
    ratio: float, longest: float, target: float
) -> None:
    limit = 100.0 * ratio
    pulses = replace(PULSES, effort_limit=limit, mass=MASS, friction=LAW, friction_uncertainty=0.05)
    controller = PreciseController(pulses=replace(pulses, mass_uncertainty=0.01), delay=0.0)
    run = moved(controller, target=target)
    outside = np.flatnonzero(np.abs(run.motion.position - target) > 2e-5)
    settled = float(run.motion.time[outside[-1] + 1])
    assert settled <= longest * shortest(limit, abs(target)) + T


@pytest.mark.parametrize("viscous", [700.0, 2500.0])
@pytest.mark.parametrize("target", [0.01, -0.02])
def test_a_move_lands_whatever_viscous_friction_takes_in_a_sample(
    target: float, viscous: float
) -> None:
    """It takes up to 15 % of the speed; as if it did so evenly, moves would miss by 7 to 25 µm.

    What is left is by the noise of positions: 1 µm of one makes 0.2 mm/s, or 2 µm in a sample.
    """
    law = CoulombViscousFriction.symmetric(coulomb_friction=100.0, viscous_friction=viscous)
    pulses = replace(PULSES, effort_limit=3000.0, mass=MASS, friction=law, target=target)
    known = replace(pulses, mass_uncertainty=0.01, friction_uncertainty=0.05)
    ends = [
        simulate_closed_loop(
            SingleMass(mass=MASS, friction=law),
            PreciseController(pulses=known, delay=0.0),
            sampling_time=T,
            samples=13,
            sensors=Sensors(position_noise=1e-6, encoder_step=1e-6, velocity="none"),
            generator=np.random.default_rng(seed),
        ).motion.position[-1]
        for seed in range(9)
    ]
    assert np.median(ends) == pytest.approx(target, abs=6e-6)


@pytest.mark.parametrize("delay", [2, 5])
@pytest.mark.parametrize("target", [0.008, -0.003])
def test_a_strong_axis_stays_within_its_travel_behind_an_unknown_delay(
    target: float, delay: int
) -> None:
    """Friction is unknown, and in truth a sixth of what is expected of the effort limit."""
    law = PreciseController.unknown_friction(mass=MASS, effort_limit=5000.0, distance=abs(target))
    pulses = replace(PULSES, effort_limit=5000.0, mass=MASS, friction=law)
    pulses = replace(pulses, friction_uncertainty=PreciseController.unknown_spread)
    run = moved(PreciseController(pulses=pulses), delay=delay, target=target)
    assert np.max(run.motion.position / target) < 1.6
    assert run.motion.position[-1] == pytest.approx(target, abs=2e-5)


@pytest.mark.parametrize(
    ("samples", "size", "farthest"),
    [((2,), -0.01, 0.0103), ((3,), -0.01, 0.0103), ((2, 3), -0.01, 0.017), ((4,), -1e-3, 0.017)],
)
def test_a_glitch_in_a_move_is_not_followed(
    samples: tuple[int, ...], size: float, farthest: float
) -> None:
    """One that no force explains is not used; of one that is used, the next position is as well."""
    controller = PreciseController(pulses=replace(PULSES, effort_limit=3000.0))
    state, plant = controller.init(), SingleMass(mass=MASS, friction=LAW)
    moving: tuple[float, float] = (0.0, 0.0)
    for k in range(40):
        seen = moving[0] + (size if k in samples else 0.0)
        state, effort = controller.step(state, SensorSample(k * T, seen, nan, nan, nan))
        run = simulate(plant, np.array([effort]), sampling_time=T, initial_state=moving)
        moving = (float(run.position[-1]), float(run.velocity[-1]))
        assert moving[0] < farthest
    assert moving[0] == pytest.approx(0.01, abs=2e-4)


@pytest.mark.parametrize("lost", [0.1, 0.5])
def test_lost_samples_leave_the_effort_finite(lost: float) -> None:
    generator = np.random.default_rng(5)
    state = PRECISE.init()
    x = 0.0
    for k in range(200):
        if generator.uniform() < lost:
            state, effort = PRECISE.blind(state, k * T)
        else:
            sample = SensorSample(k * T, x + 1e-6 * generator.normal(), nan, nan, nan)
            state, effort = PRECISE.step(state, sample)
        assert isfinite(effort)
        assert abs(effort) <= 300.0
        x += 1e-5 * effort / 300.0


def test_another_target_during_a_move_is_reached() -> None:
    class Changing:
        sampling_time = T
        init = staticmethod(PRECISE.init)

        @staticmethod
        def step(state: np.ndarray, sample: SensorSample) -> tuple[np.ndarray, float]:
            if abs(sample.time - 0.05) < 0.5 * T:
                state = PRECISE.retargeted(state, -0.004)
            return PRECISE.step(state, sample)

    run = simulate_closed_loop(
        SingleMass(mass=MASS, friction=LAW),
        Changing(),
        sampling_time=T,
        samples=300,
        sensors=Sensors(position_noise=1e-6, encoder_step=1e-6, velocity="none"),
        generator=np.random.default_rng(1),
    )
    assert abs(float(run.motion.position[-1]) + 0.004) <= 2e-5
    assert PRECISE.outcome(run.controller_state) is PositioningOutcome.REACHED


def test_a_delay_beyond_the_models_is_refused() -> None:
    with refuses("not_in_interval", name="delay"):
        PreciseController(pulses=PULSES, delay=1.0)


@pytest.mark.parametrize("target", [0.01, -0.02])
def test_friction_need_not_be_guessed(target: float) -> None:
    law = PreciseController.unknown_friction(mass=MASS, effort_limit=300.0, distance=abs(target))
    pulses = replace(
        PULSES, friction=law, friction_uncertainty=PreciseController.unknown_spread, mass=MASS
    )
    run = moved(PreciseController(pulses=pulses), target=target)
    assert abs(float(run.motion.position[-1]) - target) <= 2e-5
    assert PRECISE.outcome(run.controller_state) is PositioningOutcome.REACHED
    side = "positive" if target > 0.0 else "negative"
    found = PRECISE.estimates(run.controller_state)[f"coulomb_friction_{side}"]
    assert found == pytest.approx(100.0, rel=2.0 * FRICTION_LEARNED)


FINE = 2e-5  # step of the plant below [s]


def pushed_run(
    controller: PreciseController, force: float, *, begin: float = 1.0, lasts: float = 0.05
) -> tuple[list[float], Any]:
    """Return the positions of an axis that is pushed, in explicit steps of 20 us, and the state."""
    x = v = 0.0
    state, positions = controller.init(), [0.0]
    steps = round(controller.sampling_time / FINE)
    for k in range(round(3.0 / controller.sampling_time)):
        seen = 1e-6 * round(x / 1e-6)
        state, effort = controller.step(state, SensorSample(k * T, seen, nan, nan, nan))
        assert abs(effort) <= controller.pulses.effort_limit
        for i in range(steps):
            time = (k * steps + i) * FINE
            f = effort + (force if begin <= time < begin + lasts else 0.0)
            slips = abs(v) > 1e-6 or abs(f) > 130.0
            friction = 100.0 * np.sign(v if abs(v) > 1e-6 else f) + 700.0 * v
            after = v + FINE * (f - friction) / MASS if slips else 0.0
            v = 0.0 if after * v < 0.0 else after
            x += FINE * v
        positions.append(x)
    return positions, state


def test_a_push_is_held_and_the_axis_returns_to_its_target() -> None:
    """Coasting would take the axis from 10 mm to 61 mm: 0.32 m/s, and friction brakes by 0.7 m/s^2.

    Held with the limit from the first sample on, it goes 1.4 mm: 7.3 m/s^2 for 10 ms, then -2.7.
    """
    strong = replace(PRECISE, pulses=replace(PULSES, effort_limit=1500.0))
    positions, _ = pushed_run(strong, 1200.0)
    assert max(positions) < 0.012
    assert positions[99] == pytest.approx(0.01, abs=2e-5)
    assert positions[-1] == pytest.approx(0.01, abs=2e-5)


def test_a_load_above_friction_is_held_and_explained() -> None:
    """At rest at the target from 1 s on, the axis would fall 0.8 m by the end."""
    positions, state = pushed_run(PRECISE, 160.0, lasts=2.0)
    assert max(positions) < 0.02
    assert positions[-1] == pytest.approx(positions[-50], abs=2e-5)
    assert PRECISE.outcome(state) is PositioningOutcome.STOPPED
    assert "load" in str(PRECISE.why(state))


@pytest.mark.parametrize("limit", [300.0, 1000.0, 3000.0])
@pytest.mark.parametrize("load", [160.0, -160.0])
def test_a_load_above_friction_moves_the_axis_little(limit: float, load: float) -> None:
    """It acts from the start; while moves took it for no friction, the axis went on by 3 mm."""
    strong = replace(PRECISE, pulses=replace(PULSES, effort_limit=limit))
    positions, state = pushed_run(strong, load, begin=0.0, lasts=3.0)
    assert max(positions) < 0.0107
    assert min(positions) > -1e-4
    assert PRECISE.outcome(state) is PositioningOutcome.STOPPED
    assert "load" in str(PRECISE.why(state))


@pytest.mark.parametrize("limit", [300.0, 1000.0, 3000.0])
@pytest.mark.parametrize("load", [103.0, -103.0])
def test_an_axis_that_friction_hardly_slows_is_braked_and_lands(limit: float, load: float) -> None:
    """Between Coulomb and static friction it would glide for as long as 3 s, and 10 mm."""
    strong = replace(PRECISE, pulses=replace(PULSES, effort_limit=limit))
    positions, state = pushed_run(strong, load, begin=0.0, lasts=3.0)
    assert min(positions) > -1e-4
    assert max(positions) < 0.014
    assert positions[-1] == pytest.approx(0.01, abs=3e-5)
    assert PRECISE.outcome(state) is PositioningOutcome.REACHED


def test_a_push_is_estimated_by_a_kalman_filter() -> None:
    """Against the filter in matrices, of a mass under a known effort and a force that walks."""
    state = PRECISE.init()
    p, generator = at.own_fields(state), np.random.default_rng(3)
    p.past[:2] = [3e-5, 1e-5]
    holding.start_holding(p, MASS, 50.0)
    A = np.array([[1.0, T, 0.5 * T * T / MASS], [0.0, 1.0, T / MASS], [0.0, 0.0, 1.0]])
    B = np.array([0.5 * T * T / MASS, T / MASS, 0.0])
    change = 0.1 * p.limit
    mean, P = np.zeros(3), np.diag([p.noise**2, 0.0, change**2])
    effort = misfit = 0.0
    for position in (1e-5, 3e-5, *(3e-5 + np.cumsum(generator.uniform(2e-5, 1e-4, 5)))):
        mean = A @ mean + B * effort
        P = A @ P @ A.T + np.diag([0.0, 0.0, change**2])
        gain = P[:, 0] / (P[0, 0] + p.noise**2)
        misfit += min((position - mean[0]) ** 2 / (P[0, 0] + p.noise**2), 25.0)
        mean, P = mean + gain * (position - mean[0]), P - np.outer(gain, P[0])
        if position != 1e-5:
            braking.remember(p, position)
            effort = holding.hold(p, MASS, 50.0, True)
            at.sent(p, effort)
    scale = np.array([1.0, T, T * T / MASS])
    np.testing.assert_allclose(p.hold_misfit, misfit, rtol=1e-7)
    for motion in p.motion:  # no delay was learned
        np.testing.assert_allclose(motion, scale * mean, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(p.spread, np.outer(scale, scale) * P, rtol=1e-7, atol=1e-20)


def test_the_speed_of_braking_counts_the_last_commands() -> None:
    """A mass under three efforts, each for a sample, from rest and without friction."""
    state = PRECISE.init()
    p, efforts = at.own_fields(state), (200.0, -100.0, 250.0)
    x = v = 0.0
    for effort in efforts:
        braking.remember(p, x)
        at.sent(p, effort)
        x += v * T + 0.5 * effort / MASS * T * T
        v += effort / MASS * T
    braking.remember(p, x)
    p.way = 1.0
    assert braking.speed_now(p, MASS, 0.0, len(efforts)) == pytest.approx(v)


def test_an_axis_that_vibrates_is_braked_before_its_whole_mean_is_known() -> None:
    """The mean speed of a vibrating axis is over more samples than there are at first."""
    controller = PreciseController(pulses=replace(PULSES, sampling_time=1e-3))
    p, speed = at.own_fields(controller.init()), 0.2
    p.shaken, p.way = 1, 1.0
    for k in range(at.PAST + 2):
        braking.remember(p, speed * 1e-3 * k)
    braking.start_braking(p)
    p.unslowed = 1
    assert braking.speed_now(p, MASS, 0.0, at.KEPT - 1) == pytest.approx(speed)
    assert braking.brake(p, MASS, 50.0, True) < 0.0


@pytest.mark.parametrize(("lost", "speed"), [(0, 0.5), (1, 0.2)])
def test_a_lost_sample_leaves_the_impulse_of_a_move_out(lost: int, speed: float) -> None:
    """Positions show 0.2 m/s and the impulse of the move 0.5 m/s, without its uncertainty."""
    p = at.own_fields(PRECISE.init())
    p.shakes, p.off, p.way, p.mass = at.SHAKES, 1.0, 1.0, MASS
    p.values[p.best], p.once[p.best] = (MASS, 0.0, 0.0, 0.0), 0.5 * MASS
    for k in range(at.KEPT):
        braking.remember(p, 0.2 * T * k)
    braking.start_braking(p)
    for _ in range(lost):
        assert braking.brake(p, MASS, 0.0, False) == 0.0
    assert braking.brake(p, MASS, 0.0, True) < 0.0
    assert p.braked_speed == pytest.approx(speed)


def test_a_delay_beyond_the_commands_that_are_kept_is_that_of_the_oldest() -> None:
    efforts = []
    for delay in (60, at.HISTORY - 2):
        rest = replace(PULSES.rest, delay=delay)
        p = at.own_fields(replace(PRECISE, pulses=replace(PULSES, rest=rest)).init())
        assert (p.known, p.delay) == (1, delay)
        p.commands[-1], p.misfit[:] = 30.0, 500.0
        for x in (0.0, 0.0, 1e-5, 3e-5):
            braking.remember(p, x)
        holding.start_holding(p, MASS, 50.0)
        efforts.append(holding.hold(p, MASS, 50.0, True))
    assert efforts[0] == efforts[1]


@pytest.mark.parametrize("target", [0.01, -0.01])
def test_the_last_efforts_are_kept_whatever_the_axis_does(target: float) -> None:
    """In moves, pulses, rests, brakings and blind samples alike, and with their own sign."""
    controller = replace(PRECISE, pulses=replace(PULSES, target=target))
    generator = np.random.default_rng(7)
    state, efforts, what = controller.init(), [0.0] * at.HISTORY, set()
    x = v = 0.0
    for k in range(300):
        p = at.own_fields(state)
        if k == 150:
            braking.start_braking(p)
            v = 0.05
        what.add(int(p.moving))
        if generator.random() < 0.05:
            state, effort = controller.blind(state, k * T)
        else:
            sample = SensorSample(k * T, x + 1e-6 * generator.standard_normal(), nan, nan, nan)
            state, effort = controller.step(state, sample)
        efforts.insert(0, effort)
        np.testing.assert_array_equal(at.own_fields(state).commands, efforts[: at.HISTORY])
        for _ in range(100):
            friction = 100.0 * np.sign(v) if v else np.clip(effort, -100.0, 100.0)
            after = v + T / 100 * (effort - friction - 700.0 * v) / MASS
            v = 0.0 if after * v < 0.0 else after
            x += T / 100 * v
    assert {0, at.MOVE, at.BRAKING} <= what


@pytest.mark.parametrize(("predicted", "share"), [(2e-4, 0.5**0.7), (0.0, 1.0)])
def test_a_pulse_that_contradicts_the_move_changes_no_friction_by_much(
    predicted: float, share: float
) -> None:
    """A mass that swings on the axis disturbs a pulse: 2 % of the way once meant F/3 and 70 c."""
    run = moved(PRECISE, samples=120)
    inner = run.controller_state[at.SIZE :].copy()
    s, own = head(inner), exact_state.own_fields(inner)
    before = own.values.copy()
    s.last.levels[0] = 250.0, 1.0
    s.last.level_count, s.last.moved = 1, 1
    s.last.predicted, s.last.achieved = predicted, 4e-6
    s.rest += s.last.achieved
    s.position_count, s.stride = 4, 1
    s.positions[:4] = s.rest - s.last.achieved + np.array([0.0, 0.0, 3e-6, 4e-6])
    exact_learning.learn(s, own)
    assert np.all(np.abs(own.values - before) < np.log(1.5))
    np.testing.assert_array_equal(own.values[exact_state.VISCOUS :], before[exact_state.VISCOUS :])
    assert own.share[0] == pytest.approx(share)  # of the least one 0.7 is taken over
    assert own.share[1] == 1.0


def test_pulses_that_contradict_the_move_again_and_again_teach_another_friction() -> None:
    """A drive that is clipped at 70 % teaches a move twice the friction.

    A pulse of 200 N for a sample, against 100 N and 700 N s/m, goes 64 µm in truth.
    """
    run = moved(PRECISE, samples=120)
    inner = run.controller_state[at.SIZE :].copy()
    s, own = head(inner), exact_state.own_fields(inner)
    i = exact_state.COULOMB
    own.values[i] = own.by_moves[i] = np.log(195.0)
    own.covariance[i, :] = own.covariance[:, i] = 0.0
    own.covariance[i, i] = 0.03**2
    law = CoulombViscousFriction.symmetric(coulomb_friction=100.0, viscous_friction=700.0)
    one = simulate(
        SingleMass(mass=MASS, friction=law), np.r_[200.0, np.zeros(3)], sampling_time=T
    ).position
    friction = []
    for _ in range(12):
        s.last.levels[0] = 200.0, 1.0
        s.last.level_count, s.last.moved = 1, 1
        s.last.predicted, s.last.achieved = 3e-6, float(one[-1])
        s.position_count, s.stride = one.size, 1
        s.positions[: one.size] = s.rest + one
        s.rest += s.last.achieved
        exact_learning.learn(s, own)
        friction.append(float(np.exp(own.values[i])))
    assert friction[0] > 150.0  # one pulse may be disturbed
    assert friction[-1] == pytest.approx(100.0, rel=0.1)
    assert own.share[0] < exact_learning.LARGEST_SHARE


def test_a_held_axis_is_not_driven_to_and_fro() -> None:
    """The positions of an axis on which a mass swings at 50 Hz by 2 mm, sampled at 1 kHz."""
    pulses = replace(PULSES, sampling_time=1e-3, effort_limit=1500.0, target=0.0)
    controller = PreciseController(pulses=pulses)
    state, efforts = controller.init(), []
    for k in range(1000):
        swing = 2e-3 * np.sin(2.0 * np.pi * 50.0 * max(k - 50, 0) * 1e-3)
        sample = SensorSample(k * 1e-3, 1e-6 * round(swing / 1e-6), nan, nan, nan)
        state, effort = controller.step(state, sample)
        efforts.append(effort)
    turns = np.count_nonzero(np.diff(np.sign([u for u in efforts if u != 0.0])))
    assert turns <= 11  # three holdings of three turns; of 95 half swings


def test_a_glitch_at_rest_is_no_push() -> None:
    state = PRECISE.init()
    x = 0.0
    for k in range(60):
        seen = 0.01 if k != 40 else 0.03
        state, effort = PRECISE.step(
            state, SensorSample(k * T, seen + (k % 2) * 1e-6 + x, nan, nan, nan)
        )
        assert effort == 0.0


def test_noise_at_rest_is_no_push() -> None:
    """With a noise that friction takes long to stop, as of a servo with a coarse encoder."""
    noise = 0.144
    pulses = ExactPulseController(
        sampling_time=T, target=0.0, tolerance=1.0, effort_limit=1.56, mass=2.45e-3,
        friction=CoulombViscousFriction.symmetric(coulomb_friction=0.07, viscous_friction=1.5e-5),
        rest=RestDetection.for_encoder(resolution=1e-9, noise=noise, samples=10),
        position_noise=noise,
    )  # fmt: skip
    controller = PreciseController(pulses=pulses)
    state, generator = controller.init(), np.random.default_rng(1)
    for k in range(20_000):
        x = noise * float(generator.normal())
        state, effort = controller.step(state, SensorSample(k * T, x, nan, nan, nan))
        assert effort == 0.0


@pytest.mark.parametrize("stribeck_velocity", [0.03, 0.3])
def test_friction_that_falls_with_speed_teaches_no_wrong_mass(stribeck_velocity: float) -> None:
    """In 1 ms and without noise, on 60 mm: 90 to 400 samples of which many deviate from the law."""
    law = StribeckFriction.symmetric(
        coulomb_friction=100.0,
        static_friction=130.0,
        stribeck_velocity=stribeck_velocity,
        viscous_friction=100.0,
    )
    guess = CoulombViscousFriction.symmetric(coulomb_friction=100.0, viscous_friction=100.0)
    pulses = replace(
        PULSES,
        sampling_time=1e-3,
        target=0.06,
        tolerance=6e-5,
        effort_limit=1000.0,
        mass=MASS,
        friction=guess,
        rest=RestDetection(samples=2, spread=0.0),
        position_noise=0.0,
    )
    controller = PreciseController(pulses=pulses)
    run = simulate_closed_loop(
        SingleMass(mass=MASS, friction=law), controller, sampling_time=1e-3, samples=1000
    )
    assert controller.outcome(run.controller_state) is PositioningOutcome.REACHED
    assert controller.estimates(run.controller_state)["mass"] == pytest.approx(MASS, rel=0.1)


def two_masses(
    controller: PreciseController, masses: tuple[float, float], frequency: float, friction: float
) -> list[float]:
    """Return the positions of a mass with friction, on which another swings, for 2 s.

    Semi-implicit steps of 20 us; the mass sticks where it would turn round and friction holds it.
    """
    T, h = controller.sampling_time, 2e-5
    m, M = masses
    k = (2.0 * np.pi * frequency) ** 2 * m * M / (m + M)
    d = 0.1 * np.sqrt(k * m * M / (m + M))  # 5 % of the critical damping
    x = v = y = w = 0.0
    state, positions = controller.init(), [0.0]
    for i in range(round(2.0 / T)):
        sample = SensorSample(i * T, 1e-6 * round(x / 1e-6), nan, nan, nan)
        state, effort = controller.step(state, sample)
        for _ in range(round(T / h)):
            spring = k * (x - y) + d * (v - w)
            net = effort - spring
            if v == 0.0 and abs(net) <= friction:
                after = 0.0
            else:
                after = v + h * (net - float(np.copysign(friction, v if v else net))) / m
                after = 0.0 if after * v < 0.0 else after
            v = after
            w += h * spring / M
            x, y = x + h * v, y + h * w
        positions.append(x)
    return positions


@pytest.mark.parametrize(
    ("sampling_time", "frequency", "share"),
    [(2e-3, 48.0, 0.48), (2e-3, 70.0, 0.35), (5e-3, 40.0, 0.48), (5e-3, 110.0, 0.3)],
)
def test_an_axis_that_vibrates_under_thirty_times_its_friction_lands(
    sampling_time: float, frequency: float, share: float
) -> None:
    """A hold against the vibration would drive it out of its travel."""
    F, m, target = 4.0, 2.0, 0.04
    guess = CoulombViscousFriction.symmetric(coulomb_friction=1.1 * F, viscous_friction=1.0)
    pulses = replace(
        PULSES,
        sampling_time=sampling_time,
        target=target,
        effort_limit=30.0 * F,
        mass=1.08 * m,
        friction=guess,
    )
    positions = two_masses(
        PreciseController(pulses=pulses), ((1.0 - share) * m, share * m), frequency, F
    )
    assert positions[-1] == pytest.approx(target, abs=2e-5)
    assert -0.5 * target < min(positions) <= max(positions) < 2.0 * target


def first_effort(fruitless: int, swing: float) -> tuple[int, float]:
    """Return the sample of the first effort at 90 um from the target, after pulses.

    The second value is the largest effort that is then known not to free the axis.
    """
    controller = PreciseController(pulses=replace(PULSES, target=9e-5))
    state = controller.init()
    at.own_fields(state).swing = swing
    own = exact_state.own_fields(state[at.SIZE :])
    own.fruitless, own.held[:], own.breakaway[:] = fruitless, 250.0, 260.0
    for k in range(200):
        state, effort = controller.step(state, SensorSample(k * T, 0.0, nan, nan, nan))
        if effort != 0.0:
            return k, exact_state.own_fields(state[at.SIZE :]).held[0]
    raise AssertionError


@pytest.mark.parametrize("swing", [0.5e-3, 1e-3, 5e-3])
def test_pulses_that_have_not_helped_wait_for_what_swings_on_the_axis(swing: float) -> None:
    """It dies down to the error with a time constant of 5 samples.

    Efforts that it held are forgotten. Otherwise the axis is judged after ten samples at rest.
    """
    assert first_effort(0, swing) == first_effort(1, swing) == first_effort(2, 0.0) == (9, 250.0)
    decayed = 5.0 * np.log(swing / 9e-5)
    expected = (int(np.ceil(decayed)) - 1, 0.0) if decayed > 10.0 else (9, 250.0)
    assert first_effort(2, swing) == expected


def test_an_axis_that_is_pushed_while_it_waits_is_judged_at_its_next_rest() -> None:
    """The push takes it beyond the target: the move or pulse after it leads back."""
    controller = PreciseController(pulses=replace(PULSES, target=9e-5))
    state = controller.init()
    at.own_fields(state).swing = 8e-3  # until the 23rd sample at rest
    exact_state.own_fields(state[at.SIZE :]).fruitless = 2
    for k in range(80):
        x = 2e-4 * min(max(k - 15, 0), 4)
        state, effort = controller.step(state, SensorSample(k * T, x, nan, nan, nan))
        if head(state[at.SIZE :]).pulses > 0 or at.own_fields(state).moving == at.MOVE:
            break
    assert head(state[at.SIZE :]).rest == x
    assert effort < 0.0


def serving(x: float) -> Any:
    """Return the fields of a controller whose servo begins at rest in x, in a move of 10 mm."""
    state = PreciseController(pulses=replace(PULSES, sampling_time=1e-3)).init()
    p = at.own_fields(state)
    p.way = 0.01
    start_servo(p, exact_state.own_fields(state[at.SIZE :]), 0.01, x, 0.0)
    return p


@pytest.mark.parametrize(("off", "given_up"), [(0.95e-3, False), (1.05e-3, True)])
def test_a_servo_is_given_up_where_more_than_a_tenth_of_the_way_is_left(
    off: float, given_up: bool
) -> None:
    """The axis rests at this distance from its target after a move of 10 mm."""
    p = serving(0.01 - off)
    for _ in range(100):
        servo_effort(p, 0.01 - off)
        if p.moving != at.SERVO:
            break
    assert bool(p.servo_failed) is given_up


@pytest.mark.parametrize(("goes", "share"), [(1.01, 0.5), (0.99, 1.0)])
def test_a_servo_that_goes_too_far_feeds_less_friction_forward(goes: float, share: float) -> None:
    """The axis follows a profile of 10 mm, and rests 0.1 mm beyond its target, or before it."""
    p = serving(0.0)
    before = p.servo.coulomb.copy()
    for _ in range(500):
        r, _, _ = profile_kernels.reference(p.servo, p.servo.samples * 1e-3)
        servo_effort(p, goes * r)
        if p.servo.start != 0.0:
            break
    assert p.servo.start == pytest.approx(0.01 * goes)
    assert p.servo_failed == 0
    assert p.servo.coulomb.tolist() == [share * before[0], before[1]]


@pytest.mark.parametrize("targets", [1, 8])
def test_a_servo_begins_20_profiles_for_each_target(targets: int) -> None:
    """After its first one; the axis rests 0.5 mm before its targets of 10 mm and -10 mm in turn."""
    p, x, begun = serving(0.0095), 0.0095, 0
    for k in range(targets):
        if k:
            x = -x
            retarget_servo(p, x / 0.95)
        before = p.profiles
        for _ in range(1500):
            p.patience = inf
            servo_effort(p, x)
            begun += p.profiles - before
            before = p.profiles
            if p.moving != at.SERVO or (targets > 1 and p.profiles == 15):
                break
    assert begun == (21 if targets == 1 else 15 * targets)
    assert (p.moving == at.SERVO) == (targets > 1)


def test_a_servo_has_the_time_of_the_profile_to_each_target() -> None:
    """After 0.5 mm to its first target an axis with an effort limit of 300 N goes on to 0.5 m."""
    p = serving(0.0095)
    servo_effort(p, 0.0095)
    retarget_servo(p, 0.5)
    servo_effort(p, 0.0095)
    samples = ceil(profile_kernels.duration(p.servo) / 1e-3)
    assert samples * 1e-3 > 0.5  # longer than the time for the first target
    for _ in range(samples):
        x, _, _ = profile_kernels.reference(p.servo, p.servo.samples * 1e-3)
        servo_effort(p, x)
    assert p.moving == at.SERVO
    assert p.servo_failed == 0


@pytest.mark.parametrize(("equal", "expected"), [(1, True), (24, True), (25, False)])
def test_an_axis_that_surely_moved_is_not_where_its_sensor_shows_it(
    equal: int, expected: bool
) -> None:
    p = at.own_fields(PRECISE.init())
    p.glitch, p.sensor.equal = at.FROZEN, equal
    assert braking.may_be_elsewhere(p) is expected
