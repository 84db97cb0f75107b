"""Limits and plausibility checks between the sensors, a controller and the drive."""

import logging
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, inf, isfinite, nan, sqrt
from typing import Any, Literal, NamedTuple

import numpy as np
from jaxtyping import Float

from stickslip.control import guard_kernels as at
from stickslip.control.base import LOADED, Phase, PositionController
from stickslip.errors import interruption_behind
from stickslip.records import (
    InputError,
    LearnedPulses,
    PositioningOutcome,
    PulseRecord,
    SensorSample,
    non_negative,
    one_of,
    positive,
    quantity_field,
)

_logger = logging.getLogger("stickslip")

Reaction = Literal["hold", "zero", "brake"]
_REACTIONS: dict[Reaction, int] = {"hold": at.HOLD, "zero": at.ZERO, "brake": at.BRAKE}
_CHANNELS = (
    "measured_position",
    "measured_velocity",
    "measured_load_position",
    "measured_load_velocity",
)
_WHY = {
    at.TRAVEL: "the axis leaves its travel limits",
    at.SPEED: "the axis exceeds its speed limit",
    at.TIME: "the move takes longer than its time limit",
    at.JUMP: "the position jumps farther than the axis can move; check the encoder",
    at.FROZEN: (
        "the sensors are frozen: the position does not follow the velocity, a moving mass has "
        "the same position and velocity in every sample, or the position shows no noise"
    ),
    at.BLOCKED: (
        "the axis does not move as the effort drives it: it is blocked, or a sensor is frozen"
    ),
    at.LOAD: LOADED,
    at.SIGN: (
        "the effort drives the axis to the other side: the sign of the effort or of the position "
        "is wrong, or a load is above the effort limit; the effort is 0"
    ),
    at.FAILED: "the controller failed, and its error is in the log of the program",
}

_LARGEST = 1e12  # [SI]: a larger time, value or effort is not plausible

# Defaults
_MARGIN = 1.0  # travel beyond the task, over its longest move
_FASTER = 1.5  # speed limit over the largest speed of a move
_STRONGER = 1.5  # largest acceleration, over twice the effort limit by the mass
_CERTAIN = 6.0  # standard deviations of a position
_BRAKES = 0.85  # of the effort limit: deceleration, as moves of `precise` plan it
_TIMES = 2.0  # time limit over the duration of a move
_RARELY = 1e-9  # probability of a window of equal positions of a sensor with noise
_LEAST_SAME = 5  # samples
_STALL = 0.25  # of the longest move that a blocked axis would have made
_STALL_STEPS = 10.0  # largest errors of a position, at least


class SensorErrors(NamedTuple):
    """Errors of the samples of an axis's sensors."""

    noise: float = 0.0  #: Standard deviation of a position [m or rad].
    velocity_noise: float = 0.0  #: Standard deviation of a velocity [m/s or rad/s].
    encoder_step: float = 0.0  #: [m or rad].


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Limits of an axis, and the reaction to samples that are lost.

    `for_task` derives them from a task.

    Attributes
    ----------
    effort
        Largest magnitude of the effort.
    travel
        Lowest and highest position. The axis is braked so that it stops before either.
    speed
        Largest speed.
    acceleration
        Largest acceleration that any force can cause. A position that it does not explain is
        rejected.
    braking_gain
        Effort of braking over speed [N s/m or N m s/rad], within the effort limit: the mass that it
        acts on over four samples.
    braking
        Deceleration that braking certainly reaches [m/s^2 or rad/s^2].
    time
        Longest time of a move of a controller that judges its outcome; None for no limit.
    lost
        Reaction to a lost sample that the controller itself does not answer: ``"hold"`` the last
        effort, ``"zero"`` effort, or ``"brake"`` by the last speed. A pulse or a series continues.
    max_lost
        After more lost samples in a row the axis is stopped.
    resolution
        Largest error of a position sample by noise and encoder step.
    velocity_resolution
        Largest error of a velocity sample by noise.
    same
        After so many equal positions in a row the sensor is frozen; None if equal positions are
        normal, as without noise.
    gravity
        Whether acceleration without effort is a fault; a spring with a second mass causes it too.
    mass, load_mass
        Driven by the effort, and behind a spring [kg or kg m^2]. An axis whose sensors have failed
        is braked by the momentum that they last showed and the efforts since; with a mass of 0 it
        gets no effort.
    stall
        An axis that stands still, and would have moved so far against a friction of 0.75 of the
        effort limit, or of 0.1 of it after a fast motion, is blocked.

    Raises
    ------
    InputError
        If a value is out of its range.

    Examples
    --------
    >>> limits = Limits.for_task(mass=2.0, effort_limit=10.0, sampling_time=0.01,
    ...                          places=(0.0, 0.1), duration=1.0)
    >>> limits.travel
    (-0.1, 0.2)
    """

    effort: float = quantity_field("effort")
    travel: tuple[float, float] = quantity_field("position")
    speed: float = quantity_field("velocity")
    acceleration: float = quantity_field("acceleration")
    braking_gain: float
    braking: float = quantity_field("acceleration")
    time: float | None = quantity_field("time", default=None)
    lost: Reaction = "hold"
    max_lost: int = 10
    resolution: float = quantity_field("position", default=0.0)
    velocity_resolution: float = quantity_field("velocity", default=0.0)
    same: int | None = None
    gravity: bool = True
    mass: float = 0.0
    load_mass: float = 0.0
    stall: float = quantity_field("position", default=inf)

    def __post_init__(self) -> None:
        for name, unit in (
            ("effort", "N or N m"),
            ("speed", "m/s or rad/s"),
            ("acceleration", "m/s^2 or rad/s^2"),
            ("braking_gain", "N s/m or N m s/rad"),
            ("braking", "m/s^2 or rad/s^2"),
        ):
            object.__setattr__(self, name, positive(name, getattr(self, name), unit))
        for name, unit in (
            ("resolution", "m or rad"),
            ("velocity_resolution", "m/s or rad/s"),
            ("mass", "kg or kg m^2"),
            ("load_mass", "kg or kg m^2"),
        ):
            object.__setattr__(self, name, non_negative(name, getattr(self, name), unit))
        if self.time is not None:
            object.__setattr__(self, "time", positive("time", self.time, "s"))
        one_of("lost", self.lost, _REACTIONS)
        low, high = self.travel
        if not (isfinite(low) and isfinite(high) and low < high):
            raise InputError("travel_range", low=low, high=high, unit="m or rad")
        if self.max_lost < 0:
            raise InputError("negative_samples", name="max_lost", value=self.max_lost)

    @classmethod
    def for_task(
        cls,
        *,
        mass: float,
        effort_limit: float,
        sampling_time: float,
        places: tuple[float, ...],
        duration: float | None = None,
        load_mass: float = 0.0,
        sensors: SensorErrors | None = None,
    ) -> "Limits":
        """Return the default limits of a task.

        The travel is that of the task and the length of its longest move on either side. The speed
        is 1.5 times that which the effort limit gives the mass over the longest move. A move may
        take twice its duration.

        Parameters
        ----------
        mass
            That the effort acts on [kg or kg m^2].
        effort_limit
            [N or N m].
        sampling_time
            [s].
        places
            Start and targets [m or rad], two different ones at least.
        duration
            Of a move [s]; None for no time limit.
        load_mass
            Of a second mass behind a spring [kg or kg m^2]; 0 for none.
        sensors
            Their errors; None for none.
        """
        noise, velocity_noise, encoder_step = sensors or SensorErrors()
        low, high = min(places), max(places)
        moves = [abs(b - a) for a, b in pairwise(places)]
        longest = max(moves, default=0.0)
        if not longest > 0.0:
            raise InputError("no_travel_given", places=places)
        fastest = sqrt(2.0 * effort_limit * longest / (mass + load_mass))
        return cls(
            effort=effort_limit,
            travel=(low - _MARGIN * longest, high + _MARGIN * longest),
            speed=_FASTER * fastest * (1.0 if load_mass == 0.0 else sqrt(1.0 + load_mass / mass)),
            acceleration=_STRONGER * 2.0 * effort_limit / mass,
            braking_gain=mass / (at.TIME_CONSTANT * sampling_time),
            braking=_BRAKES * effort_limit / (mass + load_mass),
            time=None if duration is None else _TIMES * duration,
            resolution=_CERTAIN * noise + encoder_step,
            velocity_resolution=_CERTAIN * velocity_noise,
            same=_same(noise, encoder_step),
            gravity=load_mass == 0.0,
            mass=mass,
            load_mass=load_mass,
            stall=max(_STALL * longest, _STALL_STEPS * (_CERTAIN * noise + encoder_step)),
        )


def _same(noise: float, step: float) -> int | None:
    """Return after how many equal samples a sensor is frozen, by its noise; None if never."""
    if noise == 0.0:
        return None
    # The probability that two samples with this noise are in the same step is this at most
    equal = step / (2.5 * noise)
    if equal >= 0.9:
        return None
    return max(_LEAST_SAME, ceil(np.log(_RARELY) / np.log(max(equal, _RARELY))))


class GuardedState(NamedTuple):
    """State of a guarded controller: that of the guard and that of the controller."""

    guard: Float[np.ndarray, " g"]
    inner: Any
    #: State of the controller before the first sample, while that may be a glitch.
    first: Any = None


@dataclass(frozen=True, kw_only=True)
class GuardedController(PositionController[GuardedState]):
    """A controller within limits: its effort is always finite, and within the limit.

    Samples are checked before the controller sees them, and efforts before the drive. A lost sample
    is one without a channel that the controller needs, with a time that does not advance, or with a
    position that no force explains. The axis is braked when a limit is exceeded, too many samples
    are lost, a sensor is frozen, the axis is blocked, or it accelerates without effort. The outcome
    is then ``STOPPED``, with the reason in `why`. Braking stops the axis within its travel, as far
    as the effort limit and a reaction of two samples and the delay allow. After a rest the effort
    is 0, unless a load moves the axis: then it is held. A new target (`retargeted`) begins anew.

    `step` accepts numbers of any type, raises no error and compiles nothing after `warm_up`.

    Attributes
    ----------
    controller
        Any controller of the package.
    limits
        Of the axis and its task.

    Examples
    --------
    >>> from stickslip.control import PIDController
    >>> pid = PIDController(sampling_time=0.01, target=0.1, position_gain=1e3, integral_gain=0.0,
    ...                     velocity_gain=0.0, effort_limit=50.0)
    >>> guarded = GuardedController(controller=pid, limits=Limits.for_task(
    ...     mass=2.0, effort_limit=10.0, sampling_time=0.01, places=(0.0, 0.1)))
    >>> state, effort = guarded.step(guarded.init(), SensorSample(time=0.0))
    >>> effort
    0.0
    >>> guarded.step(state, SensorSample(time=0.01, measured_position=0))[1]
    10.0
    """

    controller: PositionController[Any]
    limits: Limits

    @property
    def sampling_time(self) -> float:
        """That of the controller [s]."""
        return self._inner.sampling_time

    @property
    def _inner(self) -> Any:
        return self.controller

    def init(self) -> GuardedState:
        """Return the state before the first sample."""
        limits, T = self.limits, self.sampling_time
        guard = np.zeros(at.SIZE)
        g = at.fields(guard)
        g.period, g.effort_limit, g.speed = T, limits.effort, limits.speed
        g.low, g.high = limits.travel
        g.acceleration, g.braking = limits.acceleration, limits.braking
        g.gain = limits.braking_gain
        inner = self._inner.init()
        ends = self.controller.outcome(inner) is not None  # others hold their target for ever
        g.time_limit = limits.time if limits.time is not None and ends else inf
        g.reaction, g.max_lost = _REACTIONS[limits.lost], limits.max_lost
        g.resolution, g.velocity_resolution = limits.resolution, limits.velocity_resolution
        g.same_limit = 0 if limits.same is None else limits.same
        g.gravity = limits.gravity
        g.mass[:] = limits.mass, limits.load_mass
        g.stall = limits.stall
        g.seen[:] = nan
        for name in self.controller.channels:
            g.needed[_CHANNELS.index(name)] = 1
        return GuardedState(guard, inner)

    def step(self, state: GuardedState, sample: SensorSample) -> tuple[GuardedState, float]:
        """Take a sample; return the state after it and the effort until the next [N or N m]."""
        seen = SensorSample(*(_number(value) for value in sample))
        guard = state.guard.copy()
        inner, first, effort = state.inner, state.first, nan
        before = at.fields(guard).samples
        readable = at.admit(guard, *seen)
        g = at.fields(guard)
        asked = g.fault != at.FAILED
        if before == 0:
            first = inner
        elif before == g.samples == 1 and readable and first is not None:
            inner = first  # the first sample was a glitch
        try:
            if asked and readable:
                inner, effort = self._inner.step(inner, seen)
            elif asked and seen.time == seen.time:
                inner, effort = self.controller.blind(inner, seen.time)
        except Exception as error:
            if (interruption := interruption_behind(error)) is not None:
                raise interruption from None
            # The drive must be stopped whatever the reason
            _logger.exception(
                "stickslip: the controller failed at %g s; the axis is stopped", seen.time
            )
            g.fault = at.FAILED
            inner = state.inner
        if g.samples > 1:
            first = None
        return GuardedState(guard, inner, first), at.release(guard, readable, _number(effort))

    def warm_up(self) -> None:
        """Compile and load all that `step` uses."""
        self.controller.warm_up()
        state = self.init()
        for time in range(2):
            state, _ = self.step(state, SensorSample(time * self.sampling_time, 0.0, 0.0, 0.0, 0.0))

    def blind(self, state: GuardedState, time: float) -> tuple[GuardedState, float]:
        """Take a lost sample."""
        return self.step(state, SensorSample(time=time))

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels that the controller needs."""
        return self.controller.channels

    def lost_samples(self, state: GuardedState) -> int:
        """Return how many samples were lost so far."""
        return int(at.fields(state.guard).lost_total)

    def retargeted(self, state: GuardedState, target: float) -> GuardedState:
        """Return the state with another target [m or rad]; a fault is cleared.

        Raises
        ------
        InputError
            If it is not within the travel limits.
        """
        low, high = self.limits.travel
        if not low <= target <= high:
            raise InputError("target_range", value=target, low=low, high=high, unit="m or rad")
        guard = state.guard.copy()
        at.renew(guard)
        again = self.controller.retargeted
        first = None if state.first is None else again(state.first, target)
        return GuardedState(guard, again(state.inner, target), first)

    def outcome(self, state: GuardedState) -> PositioningOutcome | None:
        """Return how far positioning has come."""
        if at.fields(state.guard).fault:
            return PositioningOutcome.STOPPED
        return self.controller.outcome(state.inner)

    def why(self, state: GuardedState) -> str | None:
        """Return why the axis has stopped short of the target; None if it has not."""
        g = at.fields(state.guard)
        fault = int(g.fault)
        if fault == at.LOST:
            missing = [name for name, gap in zip(_CHANNELS, g.missing, strict=True) if gap]
            return (
                f"{' and '.join(missing)} {'are' if len(missing) > 1 else 'is'} missing"
                if missing
                else "the time of the samples does not advance by the sampling time"
            )
        return _WHY[fault] if fault else self.controller.why(state.inner)

    def estimates(self, state: GuardedState) -> dict[str, float]:
        """Return what is estimated, by name [SI]."""
        return self.controller.estimates(state.inner)

    def deviations(self, state: GuardedState) -> dict[str, float]:
        """Return standard deviations of estimates, by name [SI]."""
        return self.controller.deviations(state.inner)

    def learned(self, state: GuardedState) -> LearnedPulses | None:
        """Return what was learned, for the first guesses of the next run."""
        return self.controller.learned(state.inner)

    def integrates(self, tolerance: float) -> bool:
        """Return whether the effort grows while the axis rests outside a tolerance [m or rad]."""
        return self.controller.integrates(tolerance)

    def phases(self, state: GuardedState) -> tuple[Phase, ...]:
        """Return the phases of the controller so far."""
        return self.controller.phases(state.inner)

    def pulse_count(self, state: GuardedState) -> int:
        """Return the number of pulses whose outcome is known."""
        return self.controller.pulse_count(state.inner)

    def last_pulse(self, state: GuardedState) -> PulseRecord | None:
        """Return the last pulse whose outcome is known, or None."""
        return self.controller.last_pulse(state.inner)


def _number(value: Any) -> float:
    """Return a number as a float; NaN for what is none, or not plausible."""
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        return nan
    return number if abs(number) <= _LARGEST else nan
