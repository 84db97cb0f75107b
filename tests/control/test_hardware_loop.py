"""The loop on hardware: time base, limits, watchdog, and zero effort at the end of every path."""

import math
import os
import signal
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from refusals import refuses
from simple_controllers import interrupted_kernel

from stickslip import CoulombViscousFriction, SingleMass, simulate
from stickslip.control import (
    ExactPulseController,
    LoopEnding,
    LoopSettings,
    Playback,
    RealTimeClock,
    Recording,
    RestDetection,
    run,
)
from stickslip.records import SensorSample
from stickslip.simulation.kernels.single_mass import mass_step
from stickslip.simulation.plant_kernels import initial_kernel_state, kernel_model

T = 0.01
LAW = CoulombViscousFriction.symmetric(coulomb_friction=10.0, viscous_friction=20.0)
PLANT = SingleMass(mass=2.0, friction=LAW)


class Stepped:
    """A clock that goes on when it is waited for, and whenever something takes time."""

    def __init__(self) -> None:
        self.time = 100.0

    def now(self) -> float:
        return self.time

    def wait_until(self, instant: float) -> None:
        self.time = max(self.time, instant)


class Axis:
    """An axis that moves with the clock, and may do something else at a sample."""

    def __init__(self, clock: Stepped, at: dict[int, Callable[[], Any]] | None = None) -> None:
        self.clock, self.at = clock, at or {}
        self.model, self.state = kernel_model(PLANT, T), initial_kernel_state(PLANT, None)
        mass_step(self.model, self.state, 0.0)  # compiled here: the watchdog is in real time
        self.effort, self.since, self.reads = 0.0, clock.time, 0
        self.written: list[float] = []

    def read(self) -> SensorSample:
        action = self.at.get(self.reads)
        self.reads += 1
        while self.clock.time - self.since > 0.5 * T:
            self.state, _ = mass_step(self.model, self.state, self.effort)
            self.since += T
        sample = SensorSample(math.nan, self.state[0], math.nan, math.nan, math.nan)
        found = None if action is None else action()
        return sample if found is None else found

    def write(self, effort: float) -> None:
        self.effort = effort
        self.written.append(effort)


class Constant:
    def __init__(self, effort: float = 5.0, at: dict[int, Callable[[], Any]] | None = None) -> None:
        self.effort, self.at = effort, at or {}
        self.seen: list[SensorSample] = []

    def init(self) -> int:
        return 0

    def step(self, state: int, sample: SensorSample) -> tuple[int, float]:
        self.seen.append(sample)
        action = self.at.get(state)
        if action is not None:
            action()
        return state + 1, self.effort


def settings(**changes: Any) -> LoopSettings:
    # The watchdog is in real time, and a loaded machine may stop this process for longer than 0.1 s
    usual: dict[str, Any] = {"sampling_time": T, "duration": 0.5, "effort": 30.0, "watchdog": 5.0}
    return LoopSettings(**usual | changes)


def lost() -> SensorSample:
    return SensorSample(*[math.nan] * 5)


def at(position: float) -> Callable[[], SensorSample]:
    return lambda: SensorSample(0.0, position, math.nan, math.nan, math.nan)


def test_efforts_are_played_and_recorded_as_they_were() -> None:
    effort = 25.0 * np.sin(0.3 * np.arange(50))
    clock = Stepped()
    axis = Axis(clock)
    done = run(axis, Playback(effort=effort, sampling_time=T), settings(), clock=clock)
    assert done.ending is LoopEnding.FINISHED
    assert done.ending.normal
    log = done.recording.log("stage")
    truth = simulate(PLANT, effort, sampling_time=T)
    np.testing.assert_array_equal(log.effort, effort)
    np.testing.assert_allclose(log.time, T * np.arange(50), atol=1e-9)
    np.testing.assert_array_equal(log.measured_position, truth.position[:-1])
    assert log.measured_velocity is None
    assert axis.written[50:]
    assert set(axis.written[50:]) == {0.0}


def test_a_delayed_effort_and_one_at_a_lost_sample_are_in_the_log() -> None:
    """The mean of what acted, by the integral over the instants of writing."""
    clock = Stepped()

    class Late(Constant):
        def step(self, state: int, sample: SensorSample) -> tuple[int, float]:
            del sample
            clock.time += 0.25 * T
            return state + 1, 10.0 + 4.0 * state

    axis = Axis(clock, {3: lost})
    done = run(axis, Late(), settings(duration=0.06), clock=clock)
    log = done.recording.log("stage")
    np.testing.assert_allclose(log.time, T * np.array([0, 1, 2, 4, 5]), atol=1e-9)
    held = [0.0, 10.0, 14.0, 18.0, 22.0, 26.0]  # before and after the writing at each sample
    quarters = [[held[k]] + [held[k + 1]] * 3 for k in range(5)]
    spans = [quarters[0], quarters[1], quarters[2] + quarters[3], quarters[4], [30.0]]
    np.testing.assert_allclose(log.effort, [sum(each) / len(each) for each in spans], rtol=1e-9)


def test_a_pulse_controller_positions_and_the_loop_ends_when_it_has() -> None:
    controller = ExactPulseController(
        sampling_time=T, target=0.01, tolerance=2e-5, effort_limit=30.0, mass=2.0, friction=LAW,
        rest=RestDetection.for_encoder(resolution=1e-9, samples=3), position_noise=1e-9,
    )  # fmt: skip
    controller.step(controller.init(), lost())  # compiled before the watchdog runs
    clock = Stepped()
    axis = Axis(clock)
    limits = settings(duration=20.0, settled=0.2)
    done = run(axis, controller, limits, clock=clock)
    assert done.ending is LoopEnding.SETTLED
    assert abs(axis.state[0] - 0.01) <= 2e-5
    assert clock.time - 100.0 < 10.0
    assert axis.written[-1] == 0.0


def raised(error: BaseException) -> Callable[[], Any]:
    def action() -> None:
        raise error

    return action


def killed() -> None:
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(0.01)  # the signal arrives between two instructions


PATHS: dict[str, tuple[Any, Any, Any]] = {
    "read fails": ({7: raised(OSError("bus"))}, {}, OSError),
    "step fails": ({}, {7: raised(ValueError("defect"))}, ValueError),
    "exit in step": ({}, {7: raised(SystemExit(3))}, SystemExit),
    "Ctrl-C in read": ({7: raised(KeyboardInterrupt())}, {}, LoopEnding.INTERRUPTED),
    "Ctrl-C in step": ({}, {7: raised(KeyboardInterrupt())}, LoopEnding.INTERRUPTED),
    "Ctrl-C in a compiled call": ({}, {7: interrupted_kernel}, LoopEnding.INTERRUPTED),
    "defect of a compiled call": ({}, {7: raised(SystemError("defect"))}, SystemError),
    "terminated": ({7: killed}, {}, LoopEnding.INTERRUPTED),
    "travel": ({7: at(0.3)}, {}, LoopEnding.TRAVEL),
    "travel below": ({7: at(-0.3)}, {}, LoopEnding.TRAVEL),
    "speed": ({8: at(0.09)}, {}, LoopEnding.SPEED),
    "no sensor": (dict.fromkeys(range(7, 30), lost), {}, LoopEnding.LOST),
}


@pytest.mark.parametrize("path", list(PATHS))
def test_zero_effort_is_the_last_whatever_happens(path: str) -> None:
    reading, stepping, expected = PATHS[path]
    clock = Stepped()
    axis, controller = Axis(clock, reading), Constant(at=stepping)
    recording = Recording()
    limits = settings(travel=(-0.2, 0.2), speed=1.0, max_lost=4)
    before = signal.getsignal(signal.SIGTERM)
    if isinstance(expected, LoopEnding):
        done = run(axis, controller, limits, recording=recording, clock=clock)
        assert done.ending is expected
        assert not done.ending.normal
        assert done.ending.text
    else:
        with pytest.raises(expected):
            run(axis, controller, limits, recording=recording, clock=clock)
    assert axis.written[-3:] == [0.0, 0.0, 0.0]
    assert 5.0 in axis.written
    assert len(recording.times) >= 7
    assert signal.getsignal(signal.SIGTERM) is before
    assert not [each for each in threading.enumerate() if each.name == "stickslip watchdog"]


def test_a_write_that_fails_once_is_tried_again() -> None:
    clock = Stepped()

    class Failing(Axis):
        def write(self, effort: float) -> None:
            super().write(effort)
            if len(self.written) in (8, 9, 10):
                raise OSError("bus")

    axis = Failing(clock)
    with pytest.raises(OSError, match="bus") as caught:
        run(axis, Constant(), settings(), clock=clock)
    assert axis.written[-1] == 0.0
    assert len(axis.written) >= 11
    assert not getattr(caught.value, "__notes__", [])


def test_a_drive_that_takes_no_zero_effort_is_reported() -> None:
    clock = Stepped()

    class Deaf(Axis):
        def write(self, effort: float) -> None:
            if effort == 0.0:
                raise OSError("gone")

    with pytest.raises(OSError, match="gone") as caught:
        run(Deaf(clock), Constant(), settings(), clock=clock)
    assert any("could not be written" in note for note in caught.value.__notes__)
    with pytest.raises(ValueError, match="defect") as other:
        run(Deaf(clock), Constant(at={3: raised(ValueError("defect"))}), settings(), clock=clock)
    assert any("could not be written" in note for note in other.value.__notes__)


@pytest.mark.parametrize(
    ("effort", "written", "name"),
    [(31.0, 30.0, "clipped"), (-1e9, -30.0, "clipped"), (math.nan, 0.0, "replaced"),
     (math.inf, 0.0, "replaced"), (30.0, 30.0, "")],
)  # fmt: skip
def test_efforts_are_finite_and_within_the_limit(effort: float, written: float, name: str) -> None:
    clock = Stepped()
    axis = Axis(clock)
    done = run(axis, Constant(effort), settings(duration=0.05), clock=clock)
    assert axis.written[:5] == [written] * 5
    assert (done.clipped, done.replaced) == (5 * (name == "clipped"), 5 * (name == "replaced"))


def test_periods_that_have_passed_are_lost_samples_of_the_controller() -> None:
    clock = Stepped()

    def slow() -> None:
        clock.time += 3.4 * T

    axis, controller = Axis(clock, {10: slow, 20: lost}), Constant()
    done = run(axis, controller, settings(duration=0.4, max_lost=3), clock=clock)
    assert done.ending is LoopEnding.FINISHED
    assert (done.overruns, done.lost_samples) == (2, 1)
    assert done.latest == pytest.approx(2.4 * T)
    assert done.longest == pytest.approx(3.4 * T)
    times = [sample.time for sample in controller.seen]
    np.testing.assert_allclose(times, T * np.arange(40), atol=1e-9)
    empty = [k for k, each in enumerate(controller.seen) if math.isnan(each.measured_position)]
    assert empty == [11, 12, 22]
    assert len(done.recording.log("stage")) == 37


def test_too_many_periods_that_have_passed_end_the_loop() -> None:
    clock = Stepped()

    def slow() -> None:
        clock.time += 30 * T

    axis = Axis(clock, {10: slow})
    done = run(axis, Constant(), settings(max_lost=3), clock=clock)
    assert done.ending is LoopEnding.LOST


def test_the_watchdog_stops_a_loop_that_hangs() -> None:
    """In real time: a read that does not return, and the effort that it would leave."""
    clock = Stepped()
    seen: list[float] = []

    def hang() -> None:
        for _ in range(300):
            time.sleep(0.01)
            if axis.written[-1] == 0.0:
                break
        seen.append(axis.written[-1])

    axis = Axis(clock, {10: hang})
    done = run(axis, Constant(), settings(watchdog=0.1), clock=clock)
    assert seen == [0.0], "zero was written while the read hung"
    assert done.ending is LoopEnding.WATCHDOG
    assert set(axis.written[10:]) == {0.0}, "nothing else was written afterwards"


def test_real_time_is_kept_without_drift() -> None:
    class Still:
        def read(self) -> SensorSample:
            return SensorSample(0.0, 0.0, 0.0, math.nan, math.nan)

        def write(self, effort: float) -> None:
            """Take nothing."""

    clock = RealTimeClock()
    start = clock.now()
    limits = settings(duration=0.3, max_lost=30, watchdog=5.0)
    done = run(Still(), Constant(), limits)
    assert clock.now() - start >= 0.29
    times = np.array(done.recording.times)
    assert np.all(np.diff(times) > 0.0)
    # A sample is never before its instant
    assert np.all(times - T * np.floor(times / T + 1e-6) >= -1e-6)
    assert done.recording.log("still").measured_velocity is not None
    assert len(times) + done.overruns == 30


def test_wrong_settings_are_refused() -> None:
    for name in ("sampling_time", "duration", "effort"):
        with refuses("not_positive", name=name):
            settings(**{name: 0.0})
    with refuses("travel_range", low=1.0, high=0.0):
        settings(travel=(1.0, 0.0))
    with refuses("not_positive", name="speed"):
        settings(speed=-1.0)
    with refuses("watchdog_too_short", value=0.019):
        settings(watchdog=0.019)
    settings(watchdog=0.02)
    with refuses("not_whole", name="max_lost"):
        settings(max_lost=-1)
    with refuses("other_sampling_time"):
        run(Axis(Stepped()), Playback(effort=np.ones(3), sampling_time=0.02), settings())
    with refuses("no_controller", method="init"):
        run(Axis(Stepped()), object(), settings())
    with refuses("samples_not_finite", name="effort"):
        Playback(effort=np.array([1.0, np.nan]), sampling_time=T)
