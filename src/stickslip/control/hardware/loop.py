"""The loop that runs a controller on hardware."""

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from math import ceil, inf, isfinite
from typing import Any, Generic, Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Float

from stickslip.control.checks import check_fields
from stickslip.control.hardware.recording import Recording
from stickslip.control.hardware.stop import (
    Output,
    Watchdog,
    terminated_as_interrupted,
    uninterrupted,
)
from stickslip.errors import check_controller, interruption_behind
from stickslip.records import (
    InputError,
    PositioningOutcome,
    SensorSample,
    finite_vector,
    non_negative,
    positive,
    quantity_field,
    whole,
)

S = TypeVar("S")

_SPIN = 0.0005  # before a sample, in which the clock is polled: a sleep lasts longer than asked [s]
_SPEED_SAMPLES = 5  # over which a speed is taken: noise of the encoder
_PATIENCE = (10.0, 0.1)  # of the watchdog: samples, and seconds at least


@runtime_checkable
class AxisIO(Protocol):
    """Sensors and drive of an axis.

    `write` of zero may be called from another thread while the loop waits in `read` or `write`.
    """

    def read(self) -> SensorSample:
        """Return what the sensors show now, in SI units; NaN where there is no value.

        The loop replaces the time. It should return within a fraction of a sampling time: with NaN
        if there is no answer.
        """
        ...

    def write(self, effort: float) -> object:
        """Let the drive hold an effort [N or N m] until the next one."""
        ...


@runtime_checkable
class Clock(Protocol):
    """A time base."""

    def now(self) -> float:
        """Return the time [s]."""
        ...

    def wait_until(self, instant: float) -> None:
        """Return at a time [s], or at once if it has passed."""
        ...


class RealTimeClock:
    """The monotonic clock of the computer; the last half millisecond of a wait is polled."""

    def now(self) -> float:
        """Return the time [s]."""
        return time.perf_counter()

    def wait_until(self, instant: float) -> None:
        """Return at a time [s], or at once if it has passed."""
        while (left := instant - time.perf_counter()) > 0.0:
            if left > _SPIN:
                time.sleep(left - _SPIN)


@dataclass(frozen=True, kw_only=True)
class LoopSettings:
    """Time base and limits of a loop on hardware.

    Attributes
    ----------
    sampling_time
        Of the loop.
    duration
        Time after which the loop ends.
    effort
        Largest magnitude of the effort; a larger one is clipped.
    travel
        Lowest and highest position; the loop ends outside.
    speed
        Largest speed, as the mean of five samples; the loop ends above. None for no limit.
    max_lost
        After more samples in a row without a position, or periods without a sample, the loop ends.
    watchdog
        After so long without a completed round, zero effort is written from another thread. None:
        ten samples, at least 0.1 s.
    settled
        Time after the end of positioning at which the loop ends; None: it runs for its duration.

    Raises
    ------
    InputError
        If a value is out of its range.
    """

    sampling_time: float = quantity_field("sampling_time")
    duration: float = quantity_field("time")
    effort: float = quantity_field("effort")
    travel: tuple[float, float] = quantity_field("position", default=(-inf, inf))
    speed: float | None = quantity_field("velocity", default=None)
    max_lost: int = 10
    watchdog: float | None = quantity_field("time", default=None)
    settled: float | None = quantity_field("time", default=None)

    def __post_init__(self) -> None:
        units = {"sampling_time": "s", "duration": "s", "effort": "N or N m"}
        check_fields(self, positive, units)
        low, high = map(float, self.travel)
        if not low < high:
            raise InputError("travel_range", low=low, high=high, unit="m or rad")
        check_fields(self, positive, {"speed": "m/s or rad/s"})
        whole("max_lost", self.max_lost)
        check_fields(self, non_negative, {"settled": "s"})
        if self.watchdog is not None and not self.watchdog >= 2.0 * self.sampling_time:
            raise InputError(
                "watchdog_too_short", value=self.watchdog, sampling_time=self.sampling_time
            )


class LoopEnding(StrEnum):
    """Why a loop on hardware has ended. Zero effort was written in each case."""

    FINISHED = "finished"
    SETTLED = "settled"
    INTERRUPTED = "interrupted"
    TRAVEL = "travel"
    SPEED = "speed"
    LOST = "lost_samples"
    WATCHDOG = "watchdog"

    @property
    def text(self) -> str:
        """One sentence on it."""
        return _TEXTS[self]

    @property
    def normal(self) -> bool:
        """Whether the loop has ended as it was meant to."""
        return self in (LoopEnding.FINISHED, LoopEnding.SETTLED)


_TEXTS = {
    LoopEnding.FINISHED: "the duration is over",
    LoopEnding.SETTLED: "positioning has ended",
    LoopEnding.INTERRUPTED: "the loop was interrupted from the keyboard, or asked to terminate",
    LoopEnding.TRAVEL: "the position left the travel limits",
    LoopEnding.SPEED: "the speed exceeded its limit",
    LoopEnding.LOST: "too many samples in a row were lost; check the sensor and the bus",
    LoopEnding.WATCHDOG: "the loop was not round in time: a read, a write or a step took too long",
}


@dataclass(kw_only=True)
class LoopRun(Generic[S]):
    """Result of a loop on hardware."""

    ending: LoopEnding = LoopEnding.INTERRUPTED  #: Why it ended.
    controller_state: S  #: The controller's last state.
    recording: Recording  #: What was read and written.
    #: Periods that had passed before their sample could be read; the controller received them as
    #: lost samples.
    overruns: int = 0
    lost_samples: int = 0  #: Samples that were read without a position.
    clipped: int = 0  #: Efforts that were beyond the limit.
    replaced: int = 0  #: Efforts that were not finite and were written as zero.
    #: Largest delay of a sample against the time base.
    latest: float = quantity_field("time", default=0.0)
    #: Longest time of a round, with reading, step and writing.
    longest: float = quantity_field("time", default=0.0)


@dataclass(frozen=True, kw_only=True)
class Playback:
    """Efforts that are written one after the other, such as those of `stickslip.excite`.

    Raises
    ------
    InputError
        If an effort is not finite, or the sampling time not positive.
    """

    #: Held over a sample each, shape (n,); zero follows.
    effort: Float[np.ndarray, " n"] = quantity_field("effort")
    sampling_time: float = quantity_field("sampling_time")  #: For which each is held.

    def __post_init__(self) -> None:
        object.__setattr__(self, "effort", finite_vector("effort", self.effort, "N or N m"))
        positive("sampling_time", self.sampling_time, "s")

    def init(self) -> int:
        """Return the number of efforts so far: none."""
        return 0

    def step(self, state: int, sample: SensorSample) -> tuple[int, float]:
        """Return the next effort, whatever the sample is."""
        del sample
        return state + 1, float(self.effort[state]) if state < self.effort.size else 0.0


def run(
    io: AxisIO,
    controller: Any,
    settings: LoopSettings,
    *,
    recording: Recording | None = None,
    clock: Clock | None = None,
) -> LoopRun[Any]:
    """Run a controller on an axis, sample by sample in real time.

    The effort is finite and within its limit. Zero effort is written, several times, whatever ends
    the loop: its duration, a limit, Ctrl-C, a request to terminate, the watchdog, or an exception
    of the controller or the axis, which is raised again afterwards. An axis that is loaded by
    gravity needs a brake of its own.

    Parameters
    ----------
    io
        Sensors and drive.
    controller
        Anything with ``init`` and ``step``, such as a `GuardedController`.
    settings
        Time base and limits.
    recording
        Receives what is read and written; None for one of its own.
    clock
        Time base; None for the clock of the computer.

    Raises
    ------
    InputError
        If the controller was made for another sampling time, or has no ``init`` or ``step``.
    """
    check_controller(controller, settings.sampling_time)
    if callable(warm_up := getattr(controller, "warm_up", None)):
        warm_up()
    done: LoopRun[Any] = LoopRun(
        controller_state=controller.init(),
        recording=Recording() if recording is None else recording,
    )
    output = Output(io.write)
    patience = settings.watchdog or max(_PATIENCE[0] * settings.sampling_time, _PATIENCE[1])
    with terminated_as_interrupted():
        try:
            try:
                with Watchdog(output, patience) as watchdog:
                    loop = _Loop(io, controller, settings, done, output, clock or RealTimeClock())
                    loop.run(watchdog)
            except (KeyboardInterrupt, SystemError) as error:
                if interruption_behind(error) is None:
                    raise
                done.ending = LoopEnding.INTERRUPTED
        except BaseException as error:
            _stop(output, error)
            raise
        else:
            failed = _stop(output, None)
            if failed is not None:
                raise failed
        finally:
            # Once more: a signal may have fallen between the lines above
            _stop(output, None)
    return done


def _stop(output: Output, error: BaseException | None) -> BaseException | None:
    """Write zero effort; note on an error, or return, that this failed."""
    with uninterrupted():
        failed = output.stop()
    if failed is not None:
        (error or failed).add_note(f"zero effort could not be written: {failed!r}")
    return failed


@dataclass
class _Loop:
    io: AxisIO
    controller: Any
    settings: LoopSettings
    done: LoopRun[Any]
    output: Output
    clock: Clock
    in_row: int = 0  # lost samples
    settled_at: float | None = None
    places: deque[tuple[float, float]] = field(
        default_factory=lambda: deque(maxlen=_SPEED_SAMPLES + 1)
    )

    def run(self, watchdog: Watchdog) -> None:
        """Go round until there is a reason to end."""
        T = self.settings.sampling_time
        samples = ceil(self.settings.duration / T - 1e-6)
        start, k = self.clock.now(), 0
        while k < samples:
            self.clock.wait_until(start + k * T)
            late = self.clock.now() - (start + k * T)
            self.done.latest = max(self.done.latest, late)
            missed = min(int(late / T), samples - k)
            if missed:
                ending = self._miss(k, missed)
                k += missed
            else:
                ending = self._sample(k * T, start)
                k += 1
            if watchdog.tripped:
                ending = LoopEnding.WATCHDOG
            if ending is not None:
                self.done.ending = ending
                return
            watchdog.feed()
        self.done.ending = LoopEnding.FINISHED

    def _miss(self, k: int, missed: int) -> LoopEnding | None:
        """Step the controller through periods that have passed without a sample."""
        self.done.overruns += missed
        self.in_row += missed
        if self.in_row > self.settings.max_lost:
            return LoopEnding.LOST
        for j in range(missed):
            sample = SensorSample(time=(k + j) * self.settings.sampling_time)
            state, _ = self.controller.step(self.done.controller_state, sample)
            self.done.controller_state = state
        return None

    def _sample(self, instant: float, start: float) -> LoopEnding | None:
        """Read, step and write; return why the loop ends, if it does."""
        at = self.clock.now()
        read = SensorSample(*map(float, self.io.read()))
        sample = read._replace(time=instant)
        ending = self._beyond(at - start, sample.measured_position)
        if ending is not None:
            self.done.recording.append(at - start, sample, 0.0, at - start)
            return ending
        state, effort = self.controller.step(self.done.controller_state, sample)
        self.done.controller_state = state
        effort = self._limited(float(effort))
        written = self.clock.now()
        if not self.output.write(effort):
            return LoopEnding.WATCHDOG
        self.done.recording.append(at - start, sample, effort, written - start)
        self.done.longest = max(self.done.longest, self.clock.now() - at)
        return self._settled(instant)

    def _limited(self, effort: float) -> float:
        if not isfinite(effort):
            self.done.replaced += 1
            return 0.0
        limit = self.settings.effort
        if abs(effort) > limit:
            self.done.clipped += 1
            return min(max(effort, -limit), limit)
        return effort

    def _beyond(self, at: float, position: float) -> LoopEnding | None:
        """Return the limit that a position is beyond."""
        if not isfinite(position):
            self.done.lost_samples += 1
            self.in_row += 1
            return LoopEnding.LOST if self.in_row > self.settings.max_lost else None
        self.in_row = 0
        low, high = self.settings.travel
        if not low <= position <= high:
            return LoopEnding.TRAVEL
        self.places.append((at, position))
        (t, x), limit = self.places[0], self.settings.speed
        full = len(self.places) == self.places.maxlen and at > t
        if limit is not None and full and abs(position - x) > limit * (at - t):
            return LoopEnding.SPEED
        return None

    def _settled(self, instant: float) -> LoopEnding | None:
        """Return whether positioning has been over for long enough."""
        judge: Callable[[Any], Any] | None = getattr(self.controller, "outcome", None)
        if self.settings.settled is None or judge is None:
            return None
        if judge(self.done.controller_state) in (None, PositioningOutcome.MOVING):
            self.settled_at = None
            return None
        self.settled_at = instant if self.settled_at is None else self.settled_at
        over = instant - self.settled_at >= self.settings.settled
        return LoopEnding.SETTLED if over else None
