"""Braking by the guard, on a mass in explicit steps that shares no code with the simulator."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from simple_controllers import Push, T

from stickslip.control import GuardedController, Limits
from stickslip.records import SensorSample

FINE = 1e-4  # step of the plant [s]
STEP = 1e-6  # of the encoder [m]
SAMPLES = 600
JUMP = 30  # sample of a jump of the clock


class Braked(NamedTuple):
    """Distance beyond the end of the travel, and velocity of an axis [m, m/s]."""

    farthest: float
    end: float
    speed: float
    why: str


def braked(
    speed: float,
    *,
    limit: float,
    delay: int = 0,
    load: float = 0.0,
    friction: float = 0.05,
    velocity: bool = True,
    sign: float = 1.0,
    hertz: float = 0.0,
    clock: float = 0.0,
) -> Braked:
    """Let 1 kg run towards the end of its travel under no effort but that of the guard.

    With a resonance frequency, half of it is behind a spring with a damping of 2 %. The time stamps
    jump by ``clock`` [s] as the axis is almost at rest.
    """
    limits = Limits.for_task(mass=1.0, effort_limit=limit, sampling_time=T, places=(0.0, 0.01))
    guard = GuardedController(controller=Push(0.0), limits=limits)
    state, end = guard.init(), limits.travel[1]
    x, v = end - max(2.0 * speed * speed / limit, 8.0 * T * speed), speed
    efforts = [0.0] * (delay + 1)
    farthest, mass, x2, v2 = x, 0.5 if hertz else 1.0, x, v
    stiffness, damping = (2 * np.pi * hertz) ** 2 / 4, 0.02 * np.pi * hertz
    for k in range(SAMPLES):
        seen = STEP * round(x / STEP)
        time = k * T + (clock if k >= JUMP else 0.0)
        sample = SensorSample(time, seen, v if velocity else np.nan)
        state, effort = guard.step(state, sample)
        assert abs(effort) <= limit
        efforts.append(effort)
        force = sign * efforts[-1 - delay] + load
        for _ in range(round(T / FINE)):
            coupling = stiffness * (x2 - x) + damping * (v2 - v)
            acts = force + coupling
            opposes = friction * np.sign(v) if v else np.clip(acts, -friction, friction)
            after = v + FINE * (acts - opposes) / mass
            v = 0.0 if after * v < 0.0 else after
            v2 -= FINE * coupling / 0.5
            x2 += FINE * v2
            x += FINE * v
            farthest = max(farthest, x)
    return Braked(farthest - end, x - end, v, str(guard.why(state)))


@pytest.mark.parametrize("velocity", [True, False])
@pytest.mark.parametrize("delay", [0, 1, 2])
@pytest.mark.parametrize("limit", [2.0, 20.0])
@pytest.mark.parametrize("speed", [0.03, 0.1])
def test_an_axis_goes_beyond_its_travel_by_the_reaction_alone(
    speed: float, limit: float, delay: int, velocity: bool
) -> None:
    """The guard is sure of it in the second sample, and the effort comes later by the delay."""
    run = braked(speed, limit=limit, delay=delay, velocity=velocity)
    assert "travel" in run.why
    assert run.farthest < (2 + delay) * T * speed
    assert run.speed == 0.0


@pytest.mark.parametrize("velocity", [True, False])
@pytest.mark.parametrize("limit", [2.0, 20.0])
def test_an_axis_behind_a_long_delay_does_not_swing_for_ever(limit: float, velocity: bool) -> None:
    """A time constant of four samples is close to unstable behind five, and friction is 1/400."""
    assert braked(0.1, limit=limit, delay=5, velocity=velocity).speed == 0.0


@pytest.mark.parametrize("clock", [-1.0, -0.1, -2.0 * T, -T, 1.0])
def test_a_clock_that_jumps_does_not_change_the_load(clock: float) -> None:
    """The load is computed over the time for which the efforts act, not over that of the stamps."""
    plain, run = (braked(0.1, limit=2.0, load=0.5, clock=each) for each in (0.0, clock))
    assert run.speed == plain.speed
    assert run.farthest == pytest.approx(plain.farthest, abs=1e-5)
    assert run.end == pytest.approx(plain.end, abs=1e-5)


@pytest.mark.parametrize("delay", [1, 2, 5])
@pytest.mark.parametrize("hertz", [5.0, 10.0, 15.0, 20.0])
def test_braking_does_not_excite_a_resonance(hertz: float, delay: int) -> None:
    """Friction is 1/30 of the limit; braking in each sample as of one mass swings for ever."""
    run = braked(0.1, limit=3.0, friction=0.1, delay=delay, velocity=False, hertz=hertz)
    assert abs(run.speed) < 0.01
    assert run.farthest < 0.05


@pytest.mark.parametrize("friction", [0.05, 0.5])
@pytest.mark.parametrize("delay", [0, 2])
@pytest.mark.parametrize("share", [0.3, 0.6])
@pytest.mark.parametrize("limit", [2.0, 20.0])
def test_a_load_of_much_of_the_effort_limit_is_held(
    limit: float, share: float, delay: int, friction: float
) -> None:
    """It would go metres in the time of the run; 16 samples of free fall are the bound.

    Friction is a share of the load.
    """
    load = share * limit
    run = braked(0.03, limit=limit, delay=delay, load=load, friction=friction * load)
    assert run.farthest < 0.5 * load * (16 * T) ** 2
    assert abs(run.speed) < 1e-6


class PushOnce(Push):
    """One effort in the first five samples, and none then."""

    def step(self, state: None, sample: SensorSample) -> tuple[None, float]:
        return state, self.effort if sample.time < 4.5 * T else 0.0


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_an_axis_that_a_load_has_taken_out_of_its_travel_is_brought_back(side: float) -> None:
    """1 kg falls back from a push of 6 N, with 2.5 m/s^2; friction of 1 N could keep it outside."""
    limits = Limits.for_task(mass=1.0, effort_limit=8.0, sampling_time=T, places=(0.0, 0.01))
    limits = replace(limits, travel=(-0.003, 0.003))
    guard = GuardedController(controller=PushOnce(side * 6.0), limits=limits)
    state, x, v, farthest = guard.init(), 0.0, 0.0, 0.0
    for k in range(1500):
        seen = STEP * round(x / STEP)
        state, effort = guard.step(state, SensorSample(k * T, seen, np.nan, np.nan, np.nan))
        force = effort - side * 3.5
        for _ in range(round(T / FINE)):
            opposes = np.sign(v) if v else np.clip(force, -1.0, 1.0)
            after = v + FINE * (force - opposes)
            v = 0.0 if after * v < 0.0 else after
            x += FINE * v
        farthest = max(farthest, -side * x)
    assert "load" in str(guard.why(state))
    assert farthest < 0.003 + 0.5 * 2.5 * (8 * T) ** 2
    assert abs(v) < 1e-6
    assert abs(x) <= 0.003 + 1e-5


def test_an_axis_that_moves_when_it_is_let_go_is_under_a_load() -> None:
    run = braked(0.03, limit=20.0, load=2.0, friction=0.7)
    assert "load" in run.why
    assert "held" in run.why


@pytest.mark.parametrize("velocity", [True, False])
def test_braking_with_the_wrong_sign_ends(velocity: bool) -> None:
    """The effort makes the axis faster by 20 m/s^2, for ten samples and the reaction."""
    run = braked(0.1, limit=20.0, velocity=velocity, sign=-1.0, friction=0.5)
    assert "sign of the effort" in run.why
    assert run.speed == 0.0
    assert run.farthest < 0.5 * 20.0 * (14 * T) ** 2 + 0.1 * 14 * T + 3.0**2 / (2 * 0.5)


def test_a_stop_is_forgotten_at_the_next_target() -> None:
    """The momentum that was reckoned before does not make the axis blocked in the first sample."""
    limits = Limits.for_task(mass=1.0, effort_limit=20.0, sampling_time=T, places=(0.0, 0.01))
    guard = GuardedController(controller=Push(0.9 * 20.0), limits=limits)
    state = guard.init()
    for k in range(300):  # the axis stands still
        state, _ = guard.step(state, SensorSample(k * T, 0.0, 0.0, np.nan, np.nan))
    assert "does not move" in str(guard.why(state))
    state = guard.retargeted(state, 0.0)
    for k in range(300, 303):
        state, effort = guard.step(state, SensorSample(k * T, 0.0, 0.0, np.nan, np.nan))
        assert effort == 18.0
    assert guard.why(state) is None


def test_the_missing_channel_stays_named_when_it_returns() -> None:
    limits = Limits.for_task(mass=1.0, effort_limit=20.0, sampling_time=T, places=(0.0, 0.01))
    guard = GuardedController(controller=Push(0.0), limits=limits)
    state = guard.init()
    for k in range(40):
        position = np.nan if 5 <= k < 30 else 0.0
        state, _ = guard.step(state, SensorSample(k * T, position, 0.0, np.nan, np.nan))
    assert guard.why(state) == "measured_position is missing"


@pytest.mark.parametrize("late", [1, 3])
def test_a_filtered_velocity_is_not_frozen(late: int) -> None:
    """Full acceleration and full braking, with a velocity that is late by some samples."""
    limits = Limits.for_task(mass=1.0, effort_limit=20.0, sampling_time=T, places=(0.0, 0.5))
    guard = GuardedController(controller=Push(0.0), limits=limits)
    state, x, speeds = guard.init(), 0.0, [0.0] * (late + 1)
    for k in range(40):
        v = speeds[-1 - late]
        state, _ = guard.step(state, SensorSample(k * T, x, v, np.nan, np.nan))
        after = speeds[-1] + (20.0 if k < 15 else -20.0 if k < 30 else 0.0) * T
        x += 0.5 * (speeds[-1] + after) * T
        speeds.append(after)
    assert guard.why(state) is None
