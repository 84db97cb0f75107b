"""Frozen sensors: detected in motion, and no false alarm of an axis that stands still."""

from dataclasses import replace
from functools import partial
from math import nan
from typing import Any

import pytest
from simple_controllers import Push, T, pid_controller

from stickslip.control import GuardedController, Limits, SensorErrors, guard_kernels
from stickslip.control.guard_momentum import stands_too_long
from stickslip.records import SensorSample

MASS, LIMIT, FRICTION = 2.0, 10.0, 1.0
FINE = 200  # steps of the plant in a sample
LIMITS = Limits.for_task(mass=MASS, effort_limit=LIMIT, sampling_time=T, places=(0.0, 1.0))


def advanced(
    x: float, v: float, effort: float, *, friction: float = FRICTION, period: float = T
) -> tuple[float, float]:
    """Return position and speed of a mass on Coulomb friction after a sample, in fine steps."""
    h = period / FINE
    for _ in range(FINE):
        if v == 0.0 and abs(effort) <= friction:
            break
        sign = 1.0 if v > 0.0 or (v == 0.0 and effort > 0.0) else -1.0
        new = v + h * (effort - sign * friction) / MASS
        v = 0.0 if new * v < 0.0 else new
        x += h * v
    return x, v


def run(guard: GuardedController, samples: int, **sensors: Any) -> tuple[list[float], Any]:
    """Return the true positions, and the state at the end."""
    frozen, step = sensors.get("frozen_from", samples), sensors.get("step", 0.0)
    every, measured = sensors.get("every", 1), sensors.get("velocity", True)
    x, v, state, path = 0.0, 0.0, guard.init(), []
    seen = (x, v)
    for k in range(samples):
        if k < frozen and k % every == 0:
            seen = (step * round(x / step) if step > 0.0 else x, v)
        velocity = seen[1] if measured else nan
        state, effort = guard.step(state, SensorSample(k * T, seen[0], velocity, nan, nan))
        x, v = advanced(x, v, effort)
        path.append(x)
    return path, state


pid = partial(
    pid_controller,
    target=1.0,
    position_gain=40.0,
    integral_gain=20.0,
    velocity_gain=18.0,
    effort_limit=LIMIT,
)


@pytest.mark.parametrize("frozen_from", [20, 40, 60])
def test_an_axis_whose_sensors_freeze_in_motion_is_braked(frozen_from: int) -> None:
    guard = GuardedController(controller=pid(), limits=LIMITS)
    before, _ = run(guard, frozen_from)
    speed = (before[-1] - before[-2]) / T
    path, state = run(guard, 1000, frozen_from=frozen_from)
    assert "frozen" in str(guard.why(state))
    # Ten samples until it is noticed, then the largest effort; friction helps
    unseen = 10.0 * T
    fastest = abs(speed) + unseen * LIMIT / MASS
    bound = unseen * fastest + 0.5 * MASS * fastest**2 / LIMIT
    assert abs(path[-1] - before[-1]) < bound
    assert path[-1] == path[-100]  # it rests


def test_without_masses_the_effort_is_zero() -> None:
    guard = GuardedController(controller=pid(), limits=replace(LIMITS, mass=0.0))
    path, state = run(guard, 200, frozen_from=40)
    assert "frozen" in str(guard.why(state))
    assert guard.step(state, SensorSample(2.0, path[39], 0.1, nan, nan))[1] == 0.0


@pytest.mark.parametrize("velocity", [True, False])
@pytest.mark.parametrize("step", [0.0, 1e-3, 0.02])
def test_no_false_alarm_with_a_coarse_encoder(step: float, velocity: bool) -> None:
    limits = Limits.for_task(
        mass=MASS,
        effort_limit=LIMIT,
        sampling_time=T,
        places=(0.0, 1.0),
        sensors=SensorErrors(encoder_step=step),
    )
    control = pid() if velocity else pid(velocity="differentiated", filter_time=0.05)
    guard = GuardedController(controller=control, limits=limits)
    path, state = run(guard, 3000, step=step, velocity=velocity)
    assert guard.why(state) is None
    assert path[-1] == pytest.approx(1.0, abs=0.1)


def test_no_false_alarm_with_a_sensor_at_a_fifth_of_the_rate() -> None:
    slow = pid(position_gain=4.0, integral_gain=2.0, velocity_gain=6.0)
    guard = GuardedController(controller=slow, limits=LIMITS)
    path, state = run(guard, 2000, every=5)
    assert guard.why(state) is None
    assert path[-1] == pytest.approx(1.0, abs=0.05)


def test_an_axis_that_friction_holds_is_not_stopped() -> None:
    held = SensorSample(0.0, 0.5, 0.0, nan, nan)
    for share, blocked in ((0.7, False), (0.8, True)):
        guard = GuardedController(controller=Push(share * LIMIT), limits=LIMITS)
        state = guard.init()
        for k in range(5000):
            state, _ = guard.step(state, held._replace(time=k * T))
        assert ("blocked" in str(guard.why(state))) is blocked


@pytest.mark.parametrize("period", [1e-3, 1e-2])
@pytest.mark.parametrize(("gain", "friction"), [(20.0, 0.4), (10.0, 0.3)])
def test_an_axis_that_stops_short_under_an_effort_is_not_blocked(
    period: float, gain: float, friction: float
) -> None:
    """Friction, a share of the effort limit, stops a PD controller that has no integral."""
    control = pid_controller(
        sampling_time=period, velocity="differentiated", target=1.0, position_gain=gain,
        integral_gain=0.0, velocity_gain=0.5 * gain, filter_time=5.0 * period, effort_limit=LIMIT,
    )  # fmt: skip
    places = {"mass": MASS, "effort_limit": LIMIT, "sampling_time": period, "places": (0.0, 1.0)}
    guard = GuardedController(controller=control, limits=Limits.for_task(**places))
    state, x, v, path = guard.init(), 0.0, 0.0, []
    for k in range(round(5.0 / period)):
        state, effort = guard.step(state, SensorSample(k * period, x, nan, nan, nan))
        x, v = advanced(x, v, effort, friction=friction * LIMIT, period=period)
        path.append(x)
    assert guard.why(state) is None
    assert path[-1] == pytest.approx(path[-100], abs=1e-4)
    assert path[-1] < 0.99


@pytest.mark.parametrize("period", [1e-3, 1e-2])
def test_an_axis_that_stopped_in_lost_samples_is_not_blocked(period: float) -> None:
    """Its mean speed over ten samples is more than it can lose in one."""
    limits = Limits.for_task(mass=MASS, effort_limit=LIMIT, sampling_time=period, places=(0.0, 1.0))
    vector = GuardedController(controller=Push(0.0), limits=limits).init().guard
    g, x, v = guard_kernels.fields(vector), 0.0, 0.0
    g.period = period
    for k in range(400):
        effort = LIMIT if k < 20 else -LIMIT if k < 29 else 0.3 * LIMIT
        seen = nan if 20 <= k < 29 else x
        readable = guard_kernels.admit(vector, k * period, seen, nan, nan, nan)
        guard_kernels.release(vector, readable, effort)
        x, v = advanced(x, v, effort, friction=0.4 * LIMIT, period=period)
    assert v == 0.0
    assert g.fault == 0


@pytest.mark.parametrize("steps", [3, 5, 7])
@pytest.mark.parametrize("share", [-0.3, 0.3])
@pytest.mark.parametrize(("period", "step"), [(1e-3, 5e-6), (1e-3, 2e-5), (2e-3, 2e-5)])
def test_a_glitch_at_rest_is_no_motion(
    period: float, step: float, share: float, steps: int
) -> None:
    limits = Limits.for_task(
        mass=MASS, effort_limit=LIMIT, sampling_time=period, places=(0.0, 0.01),
        sensors=SensorErrors(encoder_step=step),
    )  # fmt: skip
    vector = GuardedController(controller=Push(0.0), limits=limits).init().guard
    g = guard_kernels.fields(vector)
    g.period = period
    for k in range(1000):
        seen = steps * step if k == 50 else 0.0
        readable = guard_kernels.admit(vector, k * period, seen, nan, nan, nan)
        guard_kernels.release(vector, readable, share * LIMIT)
    assert g.fault == 0


def test_the_momentum_of_a_move_ends_with_another_target() -> None:
    """A strong effort on the axis that stands, and a weaker one for long, are no motion."""
    vector = GuardedController(controller=Push(0.0), limits=LIMITS).init().guard
    g = guard_kernels.fields(vector)
    guard_kernels.admit(vector, 0.0, 0.03, nan, nan, nan)
    g.moved_fast, g.momentum = 1, MASS * 0.2
    guard_kernels.renew(vector)
    for k in range(1, 100):
        guard_kernels.admit(vector, k * T, 0.03, nan, nan, nan)
        guard_kernels.release(vector, True, (0.8 if k == 2 else 0.7) * LIMIT)
    assert g.fault == 0


def test_the_load_of_an_arm_that_repeats_its_samples_is_noticed() -> None:
    limits = Limits.for_task(
        mass=MASS, load_mass=MASS, effort_limit=LIMIT, sampling_time=T, places=(0.0, 1.0)
    )
    for speed, frozen in ((0.2, True), (0.0, False)):
        guard = GuardedController(controller=Push(0.0), limits=limits)
        state = guard.init()
        for k in range(50):
            state, _ = guard.step(state, SensorSample(k * T, 0.0, 0.0, 0.01, speed))
        assert ("frozen" in str(guard.why(state))) is frozen


@pytest.mark.parametrize("first", [1, 2])
def test_the_error_of_a_momentum_is_subtracted_once(first: int) -> None:
    """Also if the first equal sample is lost: two are equal in the next one."""
    vector = GuardedController(controller=Push(0.0), limits=LIMITS).init().guard
    g, speed = guard_kernels.fields(vector), 4.0 * LIMIT * T / MASS
    g.velocity_resolution = 0.01 * speed
    for _ in range(2):
        assert not stands_too_long(g, speed, nan, T)
    assert g.momentum == pytest.approx(MASS * speed)
    for equal in range(first, first + 3):
        g.alike[0], g.v = equal, 0.0
        assert not stands_too_long(g, 0.0, nan, T)
    error = MASS * 2.0 * (0.01 * speed + g.resolution / g.period)
    assert g.momentum == pytest.approx(MASS * speed - error)
