"""Guarded moves of `precise` with wrong wiring, loads, stops and frozen sensors.

The axis is a mass in explicit steps that shares no code with the simulator.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import exp, inf, nan

import numpy as np
import pytest
from jaxtyping import Float

from stickslip.control import (
    ExactPulseController,
    GuardedController,
    Limits,
    PreciseController,
    RestDetection,
    SensorErrors,
    guard_kernels,
)
from stickslip.records import PositioningOutcome, SensorSample

T, FINE = 2e-3, 1e-4  # sampling time, step of the plant [s]
MASS, FRICTION, WAY, TOLERANCE = 2.0, 1.0, 0.01, 2e-5
STEP = 2e-6  # of the encoder [m]
STOP = (2.0 * np.pi * 300.0) ** 2 * MASS  # stiffness of an end stop [N/m]
DAMPS = 0.6 * np.sqrt(STOP * MASS)  # its damping [N s/m]
REACHED, STOPPED = PositioningOutcome.REACHED, PositioningOutcome.STOPPED

Samples = Callable[[float, float], float]  # of a time and a position


@dataclass
class Moved:
    """Final state of an axis."""

    outcome: PositioningOutcome
    why: str
    position: float
    speed: float
    farthest: float  # beyond the way to the target [m]
    wrong: int  # samples in which it was reached, and was not


def guarded(
    limit: float, *, target: float = WAY, margin: float = 1.0, noise: float = 0.0, period: float = T
) -> GuardedController:
    """Return `precise` with the mass given, and nothing of the friction."""
    friction = PreciseController.unknown_friction(mass=MASS, effort_limit=limit, distance=WAY)
    rest = RestDetection.for_encoder(resolution=STEP, noise=noise, samples=10)
    pulses = ExactPulseController(
        sampling_time=period,
        target=target,
        tolerance=TOLERANCE,
        effort_limit=limit,
        mass=MASS,
        friction=friction,
        friction_uncertainty=PreciseController.unknown_spread,
        position_noise=max(noise, 0.3 * STEP),
        rest=rest,
    )
    limits = Limits.for_task(
        mass=MASS,
        effort_limit=limit,
        sampling_time=period,
        places=(0.0, target),
        sensors=SensorErrors(noise=noise, encoder_step=STEP),
    )
    low, high = sorted((0.0, target))
    limits = replace(limits, travel=(low - margin * WAY, high + margin * WAY))
    return GuardedController(controller=PreciseController(pulses=pulses), limits=limits)


def advanced(x: float, v: float, force: float) -> tuple[float, float]:
    """Return position and speed after a step of the plant."""
    if v == 0.0 and abs(force) <= FRICTION:
        return x, 0.0
    opposes = FRICTION * np.sign(v if v else force)
    after = v + FINE * (force - opposes) / MASS
    v = 0.0 if after * v < 0.0 else after
    return x + FINE * v, v


def moved(
    guard: GuardedController,
    *,
    load: float = 0.0,
    sign: float = 1.0,
    stop: float = inf,
    noise: float = 0.0,
    sensor: Samples = lambda _, x: x,
    delay: int = 0,
    lag: float = 0.0,
    samples: int = 800,
    seed: int = 1,
) -> Moved:
    """Run a move under a load, with an end stop and a sensor.

    The effort has a sign, a delay in samples, and a first-order lag [s].
    """
    period = guard.controller.sampling_time
    efforts = [0.0] * delay
    generator = np.random.default_rng(seed)
    target = guard.controller.target
    low, high = sorted((0.0, target))
    state, x, v, farthest, wrong, acts = guard.init(), 0.0, 0.0, 0.0, 0, 0.0
    for k in range(samples):
        shown = sensor(k * period, x + noise * float(generator.normal()))
        seen = STEP * round(shown / STEP)
        state, effort = guard.step(state, SensorSample(k * period, seen, nan, nan, nan))
        efforts.append(effort)
        wrong += guard.outcome(state) is REACHED and abs(x - target) > 2.0 * TOLERANCE
        for _ in range(round(period / FINE)):
            sent = sign * efforts[-1 - delay]
            acts = sent + (acts - sent) * (exp(-FINE / lag) if lag > 0.0 else 0.0)
            force = acts + load
            force -= max(STOP * (x - stop) + DAMPS * v, 0.0) if x > stop else 0.0
            x, v = advanced(x, v, force)
            farthest = max(farthest, x - high, low - x)
    outcome = guard.outcome(state)
    assert outcome is not None
    return Moved(outcome, str(guard.why(state)), x, v, farthest, wrong)


def repeated(limit: float, pattern: tuple[float, ...]) -> Callable[[int], float]:
    """Return the commands of a pattern that repeats, in shares of the limit."""
    return lambda k: limit * pattern[k % len(pattern)]


def commanded(
    vector: Float[np.ndarray, " g"],
    command: Callable[[int], float],
    *,
    samples: int,
    load: float = 0.0,
    sign: float = 1.0,
    noise: tuple[float, int] = (0.0, 0),
    speed: float = 0.0,
) -> tuple[float, float, float]:
    """Apply one command a sample to the axis, through a guard.

    Returns position [m], speed [m/s] and largest distance from the start [m]. ``sign`` is that of
    the effort at the axis, ``load`` a force [N], ``noise`` the standard deviation of a measured
    position [m] and its seed, ``speed`` the initial one [m/s].
    """
    period = guard_kernels.fields(vector).period
    generator = np.random.default_rng(noise[1])
    x, v, farthest = 0.0, speed, 0.0
    for k in range(samples):
        seen = STEP * round((x + noise[0] * float(generator.normal())) / STEP)
        guard_kernels.admit(vector, k * period, seen, nan, nan, nan)
        effort = guard_kernels.release(vector, True, command(k))
        for _ in range(round(period / FINE)):
            x, v = advanced(x, v, sign * effort + load)
        farthest = max(farthest, abs(x))
    return x, v, farthest


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("limit", [3.0, 10.0, 30.0])
def test_a_travel_with_a_fifth_of_the_way_to_spare_is_enough(limit: float, side: float) -> None:
    run = moved(guarded(limit, margin=0.2, target=side * WAY))
    assert run.outcome is REACHED
    assert abs(run.position - side * WAY) <= TOLERANCE


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("noise", [0.0, 2e-6, 4e-6])
@pytest.mark.parametrize("limit", [3.0, 10.0, 30.0])
def test_an_effort_of_the_wrong_sign_is_stopped_at_the_start(
    limit: float, noise: float, side: float
) -> None:
    run = moved(guarded(limit, noise=noise, target=side * WAY), sign=-1.0, noise=noise)
    assert "sign" in run.why
    assert run.speed == 0.0
    assert run.farthest < (1.5 if noise > 2e-6 else 1.0) * WAY  # it is seen later


@pytest.mark.parametrize("pattern", [(1.0,), (1.0, 1.0, 1.0, 0.3), (1.0, 1.0, 0.0)])
@pytest.mark.parametrize("noise", [0.0, 2e-6])
@pytest.mark.parametrize("limit", [3.0, 10.0, 30.0])
def test_an_interrupted_effort_of_the_wrong_sign_is_stopped(
    limit: float, noise: float, pattern: tuple[float, ...]
) -> None:
    vector = guarded(limit, noise=noise).init().guard
    command = repeated(limit, pattern)
    x, _, _ = commanded(vector, command, samples=100, sign=-1.0, noise=(noise, 2))
    assert guard_kernels.fields(vector).fault == guard_kernels.SIGN
    assert -2.0 * WAY < x < 0.0


@pytest.mark.parametrize("limit", [100.0, 200.0, 300.0])
def test_a_delay_as_long_as_the_move_is_no_wrong_sign(limit: float) -> None:
    """The axis starts when the effort already brakes."""
    run = moved(guarded(limit), delay=5)
    assert run.why == "None"
    assert run.outcome is REACHED


@pytest.mark.parametrize("share", [1.1, 1.3, 1.6, 2.0])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_an_axis_that_a_load_moves_is_not_at_its_target(share: float, side: float) -> None:
    noise = 2e-6
    load = side * share * FRICTION
    run = moved(guarded(10.0, noise=noise), load=load, noise=noise, samples=1500)
    assert run.wrong <= 2  # two samples show it
    assert run.outcome is STOPPED
    assert "load" in run.why
    assert run.farthest < 1.5 * WAY


@pytest.mark.parametrize("limit", [3.0, 10.0, 30.0])
def test_a_load_that_moves_the_axis_before_a_late_effort_is_no_wrong_sign(limit: float) -> None:
    """In the five samples of the delay it falls; the effort would accelerate it by far more."""
    guard, load, delay = guarded(limit), -1.6 * FRICTION, 5
    state, x, v, efforts = guard.init(), 0.0, 0.0, [0.0] * delay
    for k in range(400):
        seen = STEP * round(x / STEP)
        state, effort = guard.step(state, SensorSample(k * T, seen, nan, nan, nan))
        assert "sign" not in str(guard.why(state))
        efforts.append(effort)
        for _ in range(round(T / FINE)):
            x, v = advanced(x, v, efforts[-1 - delay] + load)


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("weak", [0.0, 0.2])
def test_a_load_that_falls_in_single_weak_efforts_is_no_wrong_sign(
    weak: float, side: float
) -> None:
    """Strong efforts hold it, and a pause of a sample lets it fall farther than the one before."""
    vector, T = guarded(3.0, period=1e-2).init().guard, 1e-2
    x, seen = 0.0, [0.0]
    for k in range(40):
        guard_kernels.admit(vector, k * T, STEP * round(x / STEP), nan, nan, nan)
        pauses = k % 4 == 3
        effort = -side * (weak if pauses else 0.95) * 3.0 * FRICTION
        guard_kernels.release(vector, True, effort)
        x += side * k * 1e-5 if pauses else 0.0
        seen.append(x)
    assert abs(seen[-1]) > WAY / 5.0
    assert guard_kernels.fields(vector).fault != guard_kernels.SIGN


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("load", [2.2, 2.8, -2.8])
@pytest.mark.parametrize("noise", [1e-6, 2e-6, 4e-6])
def test_a_load_near_the_effort_limit_is_no_wrong_sign(
    noise: float, load: float, seed: int
) -> None:
    """Noise and the fall before the axis is braked look like an effort to the wrong side."""
    guard = guarded(3.0, noise=noise, target=float(np.copysign(WAY, load)))
    run = moved(guard, load=-load * FRICTION, noise=noise, seed=seed)
    assert "sign" not in run.why
    assert run.farthest < 1.5 * WAY


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("period", "limit", "load"),
    [
        (2e-3, 10.0, 2.0),
        (2e-3, 30.0, 2.0),
        (2e-3, 30.0, 2.4),
        (1e-2, 3.0, 2.0),
        (1e-2, 3.0, 2.4),
        (1e-2, 30.0, 1.6),
    ],
)
def test_a_load_does_not_move_an_axis_out_of_its_travel(
    period: float, limit: float, load: float, side: float
) -> None:
    """An effort that has held it is let go slowly; what falls for long does not swing."""
    for noise, seed in ((1e-6, 2), (3e-6, 2), (3e-6, 3)):
        guard = guarded(limit, noise=noise, period=period)
        samples = round(1.6 / period)
        run = moved(guard, load=side * load, noise=noise, seed=seed, samples=samples)
        assert run.farthest < WAY
        assert run.wrong <= 2
        assert "load" in run.why


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("seed", range(5))
def test_a_guard_holds_an_axis_that_creeps_in_noise(seed: int, side: float) -> None:
    """The noise of the accelerations is six times the load."""
    period, noise, load = 1e-3, 1e-6, 1.6 * side * FRICTION
    vector = guarded(3.0, noise=noise, period=period).init().guard
    g = guard_kernels.fields(vector)
    g.fault = guard_kernels.TRAVEL
    x, v, _ = commanded(vector, lambda _: 0.0, samples=1000, load=load, noise=(noise, seed))
    assert abs(x) < 0.5 * WAY
    assert abs(g.hold + load) < 1.2 * FRICTION
    assert abs(v) < 0.1 * WAY


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_guard_that_stops_a_blocked_axis_goes_on_to_hold_its_load(side: float) -> None:
    """Nearly the whole limit holds 80 % of it; without an effort the axis would fall."""
    vector, load = guarded(3.0).init().guard, 2.4 * side * FRICTION
    against = -2.97 * side * FRICTION
    _, v, farthest = commanded(vector, lambda _: against, samples=1500, load=load)
    assert guard_kernels.fields(vector).fault == guard_kernels.LOAD
    assert farthest < 0.1 * WAY
    assert v == 0.0


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("holds", [True, False])
def test_a_guard_goes_on_to_hold_what_creeps_out_of_its_travel(side: float, holds: bool) -> None:
    """An effort to the inside has nearly held its load; one to the outside holds nothing."""
    period = 1e-2
    vector = guarded(3.0, period=period).init().guard
    g = guard_kernels.fields(vector)
    g.low, g.high = -0.1 * WAY, 0.1 * WAY
    effort = (-1.4 if holds else 1.001) * side * FRICTION
    load = 2.4 * side * FRICTION if holds else 0.0
    x, v, _ = commanded(vector, lambda _: effort, samples=300, load=load, speed=side * 5e-4)
    assert g.fault in (guard_kernels.TRAVEL, guard_kernels.LOAD)
    assert abs(x) < 0.12 * WAY
    assert v == 0.0


def test_an_effort_of_the_wrong_sign_with_pauses_is_stopped() -> None:
    """Pauses of two samples hide the sign until the axis leaves its travel."""
    vector, command = guarded(10.0).init().guard, repeated(10.0, (1.0, 1.0, 1.0, 1.0, 0.0, 0.0))
    _, v, farthest = commanded(vector, command, samples=400, sign=-1.0)
    assert guard_kernels.fields(vector).fault == guard_kernels.SIGN
    assert farthest < 4.0 * WAY
    assert v == 0.0


def test_another_target_is_tried_once_the_load_is_gone() -> None:
    guard = guarded(10.0)
    state, x, v, load = guard.init(), 0.0, 0.0, 1.6 * FRICTION
    outcomes = []
    for k in range(1600):
        if k == 800:
            load, state = 0.0, guard.retargeted(state, 0.5 * WAY)
        seen = STEP * round(x / STEP)
        state, effort = guard.step(state, SensorSample(k * T, seen, nan, nan, nan))
        outcomes.append(guard.outcome(state))
        for _ in range(round(T / FINE)):
            x, v = advanced(x, v, effort + load)
    assert outcomes[799] is STOPPED
    assert outcomes[-1] is REACHED
    assert abs(x - 0.5 * WAY) <= TOLERANCE


@pytest.mark.parametrize("place", [0.5, 0.8])
def test_an_axis_at_an_end_stop_is_blocked(place: float) -> None:
    run = moved(guarded(10.0), stop=place * WAY, samples=1500)
    assert run.outcome is STOPPED
    assert "blocked" in run.why
    assert run.speed == 0.0


@pytest.mark.parametrize("lag", [0.005, 0.01])
@pytest.mark.parametrize("limit", [3.0, 10.0, 30.0])
def test_a_move_behind_a_lag_hardly_goes_beyond_its_target(limit: float, lag: float) -> None:
    run = moved(guarded(limit, period=0.01), lag=lag, samples=200)
    assert run.outcome is REACHED
    assert run.farthest <= 0.01 * WAY


def freezing(after: float) -> Samples:
    """Return a sensor that keeps one value, as after its cable is cut."""
    held: list[float] = []

    def frozen(time: float, x: float) -> float:
        if time <= after:
            return x
        held.append(x)
        return held[0]

    return frozen


@pytest.mark.parametrize("after", [0.0, 0.03, 0.04])
def test_a_frozen_encoder_is_no_axis_to_be_freed(after: float) -> None:
    """It freezes at the start or in the move."""
    run = moved(guarded(10.0), sensor=freezing(after))
    assert run.outcome is STOPPED
    assert "frozen" in run.why
    assert run.speed == 0.0
    assert run.farthest < 2.0 * WAY


@pytest.mark.parametrize(("limit", "noise"), [(10.0, 0.0), (10.0, 0.5), (10.0, 1.0), (30.0, 1.0)])
@pytest.mark.parametrize("after", [0.03, 0.05, 0.07, 0.09, 0.11, 0.13])
def test_an_axis_with_a_frozen_sensor_stays_within_its_travel(
    limit: float, noise: float, after: float
) -> None:
    """A move takes less than 20 samples of 10 ms; another one after it would leave the travel."""
    for seed in range(3):
        run = moved(
            guarded(limit, noise=noise * STEP, period=0.01),
            noise=noise * STEP,
            sensor=freezing(after),
            samples=200,
            seed=seed,
        )
        assert run.farthest < WAY
        assert run.outcome is REACHED or "frozen" in run.why


@pytest.mark.parametrize("limit", [10.0, 20.0])
@pytest.mark.parametrize("after", [0.02, 0.025, 0.03, 0.035])
def test_an_axis_that_freezes_in_a_fast_move_stops_within_its_travel(
    after: float, limit: float
) -> None:
    """The guard notices it 20 samples later, and takes out the momentum that is left."""
    for seed in range(3):
        guard = guarded(limit, noise=STEP, period=1e-3)
        run = moved(guard, noise=STEP, sensor=freezing(after), samples=1000, seed=seed)
        assert run.farthest < 0.5 * WAY
        assert run.speed == 0.0


@pytest.mark.parametrize("limit", [10.0, 30.0])
@pytest.mark.parametrize("ends", [0.12, 0.16, 0.2])
def test_a_move_goes_on_from_where_a_sensor_shows_the_axis_again(limit: float, ends: float) -> None:
    frozen = freezing(0.05)

    def sensor(time: float, x: float) -> float:
        return frozen(time, x) if time < ends else x

    run = moved(guarded(limit, noise=STEP, period=0.01), noise=STEP, sensor=sensor, samples=200)
    assert run.outcome is REACHED
    assert abs(run.position - WAY) <= 2.0 * TOLERANCE
    assert run.farthest < 0.1 * WAY
