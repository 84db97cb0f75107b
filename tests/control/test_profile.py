"""The servo along a profile: its reference against numerical integration, its moves and ends."""

from dataclasses import replace
from math import nan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refuses
from scipy.integrate import cumulative_trapezoid

from stickslip import CoulombViscousFriction, SensorSample, SingleMass
from stickslip.control import ProfileController
from stickslip.control.feedback import profile_kernels as at
from stickslip.records import PositioningOutcome
from stickslip.simulation import Sensors, simulate_closed_loop

LAW = CoulombViscousFriction.symmetric(
    coulomb_friction=100.0, static_friction=130.0, viscous_friction=700.0
)
SERVO = ProfileController(
    sampling_time=1e-3,
    target=0.01,
    tolerance=2e-5,
    mass=150.0,
    friction=LAW,
    effort_limit=300.0,
    position_noise=7e-6,
)
INTEGRATED = 1e-2
"""Relative error of the trapezoidal rule over 2000 intervals with corners in between."""


@settings(max_examples=25)
@given(
    target=st.floats(-0.5, 0.5).filter(lambda x: abs(x) > 1e-4),
    limit=st.floats(200.0, 5000.0),
    speed=st.one_of(st.none(), st.floats(0.01, 1.0)),
)
def test_the_reference_goes_from_rest_to_rest_within_its_limits(
    target: float, limit: float, speed: float | None
) -> None:
    servo = replace(SERVO, target=target, effort_limit=limit, speed_limit=speed)
    state, _ = servo.step(servo.init(), SensorSample(0.0, 0.0, nan, nan, nan))
    s = at.fields(state)
    end = float(np.sum(s.times) + s.window)
    times = np.linspace(0.0, end, 2001)
    r, w, a = np.array([at.reference(s, t) for t in times]).T
    integral = cumulative_trapezoid(w, times, initial=0)
    np.testing.assert_allclose(r, integral, atol=INTEGRATED * abs(target))
    slope = cumulative_trapezoid(a, times, initial=0)
    np.testing.assert_allclose(w, slope, atol=INTEGRATED * np.max(np.abs(w)))
    assert r[-1] == pytest.approx(target, rel=1e-9)
    assert w[-1] == pytest.approx(0.0, abs=1e-9)
    if speed is not None:
        assert np.max(np.abs(w)) <= speed * (1.0 + 1e-9)
    effort = 150.0 * a + np.sign(w) * 100.0 + 700.0 * w
    assert np.max(np.abs(effort)) <= limit
    jerk = np.max(np.abs(np.diff(a))) / times[1]
    most = float(np.sum(s.accelerations)) / s.window
    assert jerk <= most * (1.0 + 1e-6)


@settings(max_examples=50)
@given(
    target=st.floats(-0.5, 0.5).filter(lambda x: abs(x) > 1e-4),
    speed=st.floats(-2.0, 2.0),
    delay=st.sampled_from([0.0, 0.002]),
)
def test_the_reference_of_an_axis_in_motion_begins_with_its_speed(
    target: float, speed: float, delay: float
) -> None:
    """As far as a stop at the target is possible from it; with none where it moves away from it."""
    s = at.fields(replace(SERVO, target=target, delay=delay).init())
    at.begin(s, 0.0, speed)
    end = float(np.sum(s.times) + s.window)
    times = np.linspace(0.0, end, 4001)
    r, w, a = np.array([at.reference(s, t) for t in times]).T
    v_0 = abs(s.first_speed)
    assert 0.0 <= v_0 <= abs(speed)
    assert s.start == pytest.approx(speed * delay)
    assert r[0] == pytest.approx(0.0, abs=1e-12)
    assert w[0] == pytest.approx(np.copysign(v_0, target - s.start), abs=1e-9)
    np.testing.assert_allclose(
        r, cumulative_trapezoid(w, times, initial=0), atol=INTEGRATED * max(abs(target), 1e-3)
    )
    assert s.start + r[-1] == pytest.approx(target, abs=1e-9)
    assert w[-1] == pytest.approx(0.0, abs=1e-9)
    way = target - s.start
    assert np.min(np.sign(way) * w) >= -1e-9  # never back
    assert np.max(np.abs(a)) <= max(s.accelerations) * (1.0 + 1e-9)
    room = abs(way) - 0.5 * v_0 * s.window
    if speed * np.sign(way) > 0.0 and v_0 < abs(speed) * (1.0 - 1e-9):  # as fast as it can stop
        assert v_0 * v_0 / (2.0 * s.accelerations[1]) == pytest.approx(room, rel=1e-6)


def test_a_new_target_in_motion_is_gone_to_without_a_stop() -> None:
    """Halfway, at 0.05 m/s: a profile from rest would step the velocity by as much."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=100.0, viscous_friction=700.0)
    servo = replace(SERVO, friction=law)
    state, x, v, speeds = servo.init(), 0.0, 0.0, []
    for k in range(400):
        if k == 80:
            state = servo.retargeted(state, 0.02)
        state, u = servo.step(state, SensorSample(k * 1e-3, x, nan, nan, nan))
        for _ in range(20):
            after = v + 5e-5 * (u - np.copysign(min(100.0, abs(u)), v or u) - 700.0 * v) / 150.0
            v = 0.0 if after * v < 0.0 else after
            x += 5e-5 * v
        speeds.append(v)
    assert speeds[80] > 0.03
    assert min(speeds[80:120]) > 0.9 * speeds[80]
    assert x == pytest.approx(0.02, abs=2e-5)


@pytest.mark.parametrize("target", [0.01, -0.003, 0.1])
@pytest.mark.parametrize("wrong", [0.8, 1.0, 1.2])
def test_it_rests_within_the_tolerance_and_stays(target: float, wrong: float) -> None:
    guessed = CoulombViscousFriction.symmetric(
        coulomb_friction=100.0 * wrong, static_friction=130.0 * wrong, viscous_friction=700.0
    )
    servo = replace(SERVO, target=target, friction=guessed)
    run = simulate_closed_loop(
        SingleMass(mass=150.0, friction=LAW),
        servo,
        sampling_time=1e-3,
        samples=3000,
        sensors=Sensors(position_noise=1e-6, encoder_step=1e-6, velocity="none"),
        generator=np.random.default_rng(1),
    )
    assert servo.outcome(run.controller_state) is PositioningOutcome.REACHED
    late = run.motion.position[-1000:]
    assert np.max(np.abs(late - target)) <= servo.tolerance
    assert np.ptp(late) == 0.0
    assert np.max(np.abs(run.motion.commanded_effort)) <= 300.0


def test_a_new_target_begins_a_profile_where_the_axis_is() -> None:
    state, _ = SERVO.step(SERVO.init(), SensorSample(0.0, 0.004, nan, nan, nan))
    assert at.fields(state).start == 0.004
    state = SERVO.retargeted(state, -0.02)
    state, effort = SERVO.step(state, SensorSample(1e-3, 0.0041, nan, nan, nan))
    s = at.fields(state)
    assert s.start == 0.0041
    assert s.backward == 1
    assert effort < 0.0
    assert SERVO.outcome(state) is PositioningOutcome.MOVING


def test_the_shaking_begins_only_where_it_sticks_outside() -> None:
    def efforts(place: float, *, dither: bool) -> list[float]:
        servo = replace(SERVO, target=1e-3, dither=dither)
        state, sent = servo.init(), []
        for k in range(400):
            # Without motion at first, then at rest in one place
            x = 0.0 if k < 2 else place
            state, u = servo.step(state, SensorSample(k * 1e-3, x, nan, nan, nan))
            sent.append(u)
        return sent[-100:]

    outside = np.diff(efforts(1e-3 + 6e-5, dither=True))
    assert np.max(np.abs(outside)) > 40.0
    assert np.max(np.abs(np.diff(efforts(1e-3 + 6e-5, dither=False)))) < 10.0
    assert efforts(1e-3 + 5e-6, dither=True) == [0.0] * 100


def test_a_limit_below_static_friction_is_refused() -> None:
    with refuses("effort_below_breakaway", value=120.0, limit=130.0):
        replace(SERVO, effort_limit=120.0)


def test_a_delay_that_is_set_gives_the_gains_of_a_servo_for_it() -> None:
    state, other = SERVO.init(), replace(SERVO, delay=3e-3).init()
    at.set_delay(at.fields(state), 3e-3)
    changed, expected = at.fields(state), at.fields(other)
    assert changed.delay == expected.delay
    for name in ("K_p", "K_i", "K_d"):
        assert getattr(changed, name) == pytest.approx(getattr(expected, name), rel=0.1)
