"""Braking by the guard, on a mass in explicit steps that shares no code with the simulator."""

from typing import NamedTuple

import numpy as np
import pytest
from simple_controllers import Push, T

from stickslip.control import GuardedController, Limits
from stickslip.records import SensorSample

FINE = 1e-4  # step of the plant [s]
STEP = 1e-6  # of the encoder [m]
SAMPLES = 600


class Braked(NamedTuple):
    """What has become of an axis, beyond the end of its travel [m, m/s]."""

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
) -> Braked:
    """Let 1 kg run towards the end of its travel under no effort but that of the guard."""
    limits = Limits.for_task(mass=1.0, effort_limit=limit, sampling_time=T, places=(0.0, 0.01))
    guard = GuardedController(controller=Push(0.0), limits=limits)
    state, end = guard.init(), limits.travel[1]
    x, v = end - max(2.0 * speed * speed / limit, 8.0 * T * speed), speed
    efforts = [0.0] * (delay + 1)
    farthest = x
    for k in range(SAMPLES):
        seen = STEP * round(x / STEP)
        sample = SensorSample(k * T, seen, v if velocity else np.nan, np.nan, np.nan)
        state, effort = guard.step(state, sample)
        assert abs(effort) <= limit
        efforts.append(effort)
        force = efforts[-1 - delay] + load
        for _ in range(round(T / FINE)):
            opposes = friction * np.sign(v) if v else np.clip(force, -friction, friction)
            after = v + FINE * (force - opposes)
            v = 0.0 if after * v < 0.0 else after
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


def test_an_axis_that_moves_when_it_is_let_go_is_under_a_load() -> None:
    run = braked(0.03, limit=20.0, load=2.0, friction=0.7)
    assert "load" in run.why
    assert "held" in run.why
