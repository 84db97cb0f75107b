"""Series of pulses that bring both masses of a flexible arm to rest on a target.

The record of a series, its planner, and why there may be none.
"""

import math
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Float

from stickslip.planning.arm_motion import NO_LOSSES, LoadLosses
from stickslip.planning.move import FEWEST_PULSES, Move, Search
from stickslip.planning.programme import Solution, landed, solve
from stickslip.planning.rest import with_rest
from stickslip.planning.tuning import TUNING
from stickslip.plants import FlexibleArm, check_affine
from stickslip.records import (
    AxisKind,
    InputError,
    StickslipError,
    non_negative,
    positive,
    quantity_field,
    unit_of,
    whole,
)


class SeriesLimit(Enum):
    """Reason why a series is impossible."""

    EFFORT = "effort"
    DIRECTION = "direction"
    BREAKAWAY = "breakaway"
    PULSES = "pulses"
    TOGETHER = "together"


class NoPulseSeriesError(InputError):
    """No series of pulses meets the request."""

    @property
    def limit(self) -> SeriesLimit:
        """Limit without which there would be one; ``TOGETHER`` if no single one is enough."""
        return self.quantities["limit"]


@dataclass(frozen=True, kw_only=True)
class PulseSeries:
    """Efforts that bring both masses of a flexible arm to rest on a target, and what they do.

    ``effort[k]`` is held from ``time[k]`` to ``time[k+1]``; after the last the effort is 0, and
    mass 1 stays where it is. The motion is that of a plant as planned with.
    """

    kind: AxisKind  #: ``"linear"`` or ``"rotary"``; decides the units.
    sampling_time: float = quantity_field("sampling_time")  #: [s].
    pulse_samples: int  #: Samples in each pulse.
    target: float = quantity_field("position")  #: Where both masses shall rest.
    effort: Float[np.ndarray, " n"] = quantity_field("effort")  #: Of each sample, shape (n,).
    position: Float[np.ndarray, " n+1"] = quantity_field("position")  #: Of mass 1, shape (n+1,).
    velocity: Float[np.ndarray, " n+1"] = quantity_field("velocity")  #: Of mass 1, shape (n+1,).
    load_position: Float[np.ndarray, " n+1"] = quantity_field("position")  #: Of mass 2.
    load_velocity: Float[np.ndarray, " n+1"] = quantity_field("velocity")  #: Of mass 2.
    effort_limit: float = quantity_field("effort")  #: That none of the efforts exceeds.
    #: By how much the first effort exceeds what frees mass 1; infinite if it moves already.
    breakaway_margin: float = quantity_field("effort")
    #: The least speed of mass 1 between begin and end, between samples too; it is positive unless
    #: mass 1 rests on the way.
    slowest: float = quantity_field("velocity")
    #: Proven lower bound of the duration of a series of this effort limit [s]; the shortest
    #: series takes between this and its duration.
    least_duration: float = quantity_field("time")
    #: Lower bound of the impulse of a series without a rest, over this time [N s or N m s].
    least_impulse: float
    #: From when until when mass 1 rests on the way; None if it does not.
    rest: tuple[float, float] | None = quantity_field("time", default=None)

    def __post_init__(self) -> None:
        for name in ("effort", "position", "velocity", "load_position", "load_velocity"):
            array = np.array(getattr(self, name), dtype=np.float64)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @cached_property
    def time(self) -> Float[np.ndarray, " samples"]:
        """Sample instants [s], shape (n+1,)."""
        time = np.arange(self.effort.size + 1) * self.sampling_time
        time.flags.writeable = False
        return time

    @cached_property
    def states(self) -> Float[np.ndarray, "samples 4"]:
        """Position and velocity of masses 1 and 2 [m or rad, m/s or rad/s], shape (n+1, 4)."""
        columns = (self.position, self.velocity, self.load_position, self.load_velocity)
        states = np.column_stack(columns)
        states.flags.writeable = False
        return states

    @property
    def duration(self) -> float:
        """From the begin of the first pulse to the end of the last [s]."""
        return self.effort.size * self.sampling_time

    @property
    def amplitudes(self) -> Float[np.ndarray, " pulses"]:
        """Effort of each pulse [N or N m]."""
        return self.effort[:: self.pulse_samples]

    @property
    def rest_samples(self) -> tuple[int, int] | None:
        """First sample of the rest on the way, and first after it; None without one."""
        if self.rest is None:
            return None
        begin, end = self.rest
        return round(begin / self.sampling_time), round(end / self.sampling_time)

    @property
    def direction(self) -> Literal[1, -1]:
        """Which way mass 1 moves."""
        return 1 if self.target > self.position[0] else -1

    @property
    def peak_effort(self) -> float:
        """The largest magnitude of effort [N or N m]."""
        return float(np.abs(self.effort).max())

    @property
    def impulse(self) -> float:
        """Time integral of the effort's magnitude [N s or N m s], the smallest possible."""
        return float(np.abs(self.effort).sum()) * self.sampling_time


@dataclass(frozen=True, kw_only=True)
class PulseSeriesPlanner:
    """Find the efforts that bring both masses of a flexible arm to rest on a target.

    While mass 1 moves in one direction the arm is linear, with its friction as a constant force
    and a damping. The efforts solve a linear programme: both masses rest on the target at the end,
    mass 1 never turns back or stops on the way (between samples neither), no effort exceeds the
    limit, and the first one frees mass 1. What is minimised is the impulse, the time integral of
    the effort's magnitude. At the end the spring is relaxed, and static friction holds mass 1.

    Raises
    ------
    InputError
        If a value is out of its range, or if the offset is above the static friction, so that
        mass 1 does not rest without effort.

    Examples
    --------
    >>> from stickslip.friction import CoulombViscousFriction
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=0.1, viscous_friction=0.1)
    >>> arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
    >>> planner = PulseSeriesPlanner(arm=arm, sampling_time=0.05, effort_limit=1.0)
    >>> series = planner.plan((0.0, 0.0, 0.0, 0.0), target=1.0)
    >>> round(series.duration, 9)
    4.6
    >>> wide = replace(planner, pulse_samples=20).plan((0.0, 0.0, 0.0, 0.0), target=1.0)
    >>> wide.amplitudes.size, round(wide.duration, 9)
    (6, 6.0)
    """

    arm: FlexibleArm  #: Masses, spring and friction that it plans with.
    sampling_time: float = quantity_field("sampling_time")  #: [s].
    effort_limit: float = quantity_field("effort")  #: Largest magnitude of effort.
    pulse_samples: int = 1  #: Samples in each pulse, over which the effort is held; 1 is full rate.
    #: Least speed of mass 1 on the way, as a share of the mean speed of the move [-]. It keeps
    #: rounding errors from stopping mass 1.
    slowest: float = 1e-3
    #: By which share the time may exceed the shortest one, where the number of pulses is not given
    #: [-]. With 0.1, and a wide impulse gap, a plan takes a fifth of the work that it takes with 0.
    #: The work of a search is bounded: where that is not enough for a proof, a series may be
    #: longer, and `PulseSeries.least_duration` is what is proven of the shortest time.
    excess: float = 0.0
    #: By which share the impulse may exceed the least one [-]. Very near to the shortest time less
    #: may be proven; `PulseSeries.least_impulse` is what is proven.
    impulse_gap: float = 0.02
    #: Whether mass 1 shall rest where it would only creep while mass 2 swings over, as it does in
    #: most series of about the shortest time. Held by static friction it does not gather the error
    #: of a friction that differs from the plan.
    rest_on_the_way: bool = False
    #: Duration that no series may exceed where the number of pulses is not given; None for ten
    #: times a rough guess of the shortest.
    longest: float | None = quantity_field("time", default=None)
    #: Of the load, whose Coulomb friction opposes motion towards the target; with any, less is
    #: proven of the shortest time.
    losses: LoadLosses = NO_LOSSES

    def __post_init__(self) -> None:
        check_affine(self.arm)
        kind = self.arm.kind
        for name, unit in (("sampling_time", "s"), ("effort_limit", unit_of("effort", kind))):
            object.__setattr__(self, name, positive(name, getattr(self, name), unit))
        for name in ("slowest", "impulse_gap"):
            value = positive(name, getattr(self, name), "-")
            if value >= 1:
                raise InputError("not_below", name=name, value=value, limit=1.0, unit="-")
            object.__setattr__(self, name, value)
        if self.longest is not None:
            object.__setattr__(self, "longest", positive("longest", self.longest, "s"))
        non_negative("excess", self.excess, "-")
        whole("pulse_samples", self.pulse_samples, least=1)
        law = self.arm.friction
        if not -law.static_friction_positive <= law.offset <= law.static_friction_negative:
            raise InputError("offset_moves_arm", offset=law.offset, unit=unit_of("offset", kind))

    @property
    def pulse_width(self) -> float:
        """How long each pulse is held [s]."""
        return self.pulse_samples * self.sampling_time

    def plan(
        self,
        state: tuple[float, float, float, float],
        target: float,
        *,
        pulses: int | None = None,
    ) -> PulseSeries:
        """Return the series of least impulse with so many pulses, or with as few as possible.

        Parameters
        ----------
        state
            ``(position, velocity, load_position, load_velocity)`` at the begin [m or rad, m/s or
            rad/s]. Mass 1 rests, or moves towards the target already; mass 2 may swing.
        target
            Where both masses shall rest [m or rad].
        pulses
            How many; None for the fewest, that is, the shortest time, or up to the excess more.

        Raises
        ------
        NoPulseSeriesError
            If there is no such series; it names the limit that binds and what would help.
        InputError
            If a value is not finite, or mass 1 is on the target or moves away from it.
        """
        direction = self._direction(state, target)
        move = self._move(state, target, direction)
        if pulses is None:
            search = move.shortest(self.excess)
        else:
            found = move.solved(pulses, gap=self.impulse_gap)
            search = Search(pulses, None if found.effort is None else found, move.fewest)
        count, solution = search.pulses, search.solution
        if solution is None:
            raise _refusal(move, count, at_most=pulses is None, kind=self.arm.kind)
        if solution.gap > self.impulse_gap:
            quick = pulses is None and self.excess > 0.0
            work = TUNING.search_work if quick else TUNING.proof_work
            better = move.solved(count, gap=self.impulse_gap, begin=solution, work=work)
            solution = solution if better.effort is None else better
        origin = float(state[0])
        return self._series(move, count, solution, search.least, origin, direction, float(target))

    def _direction(self, state: tuple[float, float, float, float], target: float) -> int:
        names = ("position", "velocity", "load_position", "load_velocity", "target")
        if len(state) != len(names) - 1:
            raise InputError(
                "wrong_length", name="state", length=len(state), parts=4, names=names[:-1]
            )
        kind = self.arm.kind
        for name, value in zip(names, (*state, target), strict=True):
            if not math.isfinite(value):
                unit = unit_of("velocity" if "velocity" in name else "position", kind)
                raise InputError("not_finite", name=name, value=value, unit=unit)
        if target == state[0]:
            raise InputError("on_the_target", target=target, unit=unit_of("position", kind))
        direction = 1 if target > state[0] else -1
        if state[1] * direction < 0:
            unit = unit_of("velocity", kind)
            raise InputError("away_from_target", velocity=state[1], unit=unit)
        return direction

    def _move(
        self, state: tuple[float, float, float, float], target: float, direction: int
    ) -> Move:
        """Return the request, turned so that the move is forward."""
        law = self.arm.friction
        return Move(
            arm=replace(self.arm, friction=law if direction > 0 else law.mirrored()),
            sampling_time=self.sampling_time,
            pulse_samples=self.pulse_samples,
            effort_limit=self.effort_limit,
            slowest=self.slowest,
            start=(
                0.0,
                direction * float(state[1]),
                direction * (float(state[2]) - float(state[0])),
                direction * float(state[3]),
            ),
            travel=abs(float(target) - float(state[0])),
            longest=math.inf if self.longest is None else self.longest,
            losses=self.losses,
        )

    def _series(
        self,
        move: Move,
        pulses: int,
        solution: Solution,
        least: int,
        origin: float,
        direction: int,
        target: float,
    ) -> PulseSeries:
        """Return the record of a solution, verified by propagating it."""
        programme = move.programme(pulses)
        rest = (
            with_rest(move, programme, solution, self.impulse_gap) if self.rest_on_the_way else None
        )
        if rest is not None:
            effort, states, slowest = rest.effort, rest.states, 0.0
        else:
            effort = landed(programme, solution)
            states, minima = programme.states(effort), programme.minima(effort)
            slowest = float(min(states[1:-1, 1].min(), minima[:, 2].min(initial=np.inf)))
        frequency = math.sqrt(self.arm.stiffness / self.arm.mass_2)
        missing = (states[-1] - (move.travel, 0.0, move.travel, 0.0)) / (
            1.0,
            frequency,
            1.0,
            frequency,
        )
        error = float(np.abs(missing).max())
        stops = slowest <= 0.0 and rest is None
        if stops or error > TUNING.rounding * move.travel:
            raise StickslipError(
                "series_misses_target", error=error, travel=move.travel, least_speed=slowest
            )
        peak = float(np.abs(effort).max())
        if peak > self.effort_limit:
            raise StickslipError("series_exceeds_effort", effort=peak, limit=self.effort_limit)
        width = self.pulse_width
        samples = states[:: programme.steps_per_pulse // self.pulse_samples] * direction
        return PulseSeries(
            kind=self.arm.kind,
            sampling_time=self.sampling_time,
            pulse_samples=self.pulse_samples,
            target=target,
            effort=np.repeat(effort, self.pulse_samples) * direction,
            position=origin + samples[:, 0],
            velocity=samples[:, 1],
            load_position=origin + samples[:, 2],
            load_velocity=samples[:, 3],
            effort_limit=self.effort_limit,
            breakaway_margin=float(effort[0]) - move.breakaway,
            slowest=slowest,
            least_duration=least * width,
            least_impulse=solution.bound * self.effort_limit * pulses * self.pulse_width,
            rest=None if rest is None else (rest.begin * width, rest.end * width),
        )


def _refusal(move: Move, pulses: int, *, at_most: bool, kind: AxisKind) -> NoPulseSeriesError:
    """Return the error that names the limit which, lifted alone, would allow a series.

    ``at_most`` is whether fewer pulses would have done.
    """
    effort: float | None = None
    if pulses < FEWEST_PULSES:
        code, limit = "series_too_short", SeriesLimit.PULSES
    elif not move.frees:
        code, limit = "series_cannot_break_away", SeriesLimit.BREAKAWAY
    elif move.fewest == 0:
        code, limit = "series_swings_too_far", SeriesLimit.DIRECTION
    elif (effort := _enough_effort(move, pulses)) is not None:
        code, limit = "series_needs_effort", SeriesLimit.EFFORT
    elif move.frees_too_far or _possible_without("breakaway", move, pulses):
        code, limit = "series_breaks_away_too_far", SeriesLimit.BREAKAWAY
    elif _possible_without("direction", move, pulses):
        code, limit = "series_turns_back", SeriesLimit.DIRECTION
    else:
        code, limit = "series_impossible", SeriesLimit.TOGETHER
    enough = None
    if not at_most and limit is not SeriesLimit.PULSES and move.frees:
        search = move.shortest()
        if search.solution is not None and search.pulses != pulses:
            enough = search.pulses
    return NoPulseSeriesError(
        code,
        limit=limit,
        pulses=pulses,
        duration=pulses * move.pulse_width,
        at_most=at_most,
        travel=move.travel,
        unit=unit_of("position", kind),
        breakaway=move.breakaway,
        effort=effort,
        effort_limit=move.effort_limit,
        effort_unit=unit_of("effort", kind),
        enough=enough,
        enough_duration=(enough or 0) * move.pulse_width,
    )


def _enough_effort(move: Move, pulses: int) -> float | None:
    """Return about the least effort limit with which there is a series, None if there is none."""

    def does(times: float) -> bool:
        stronger = replace(move, effort_limit=times * move.effort_limit)
        return stronger.solved(pulses, work=TUNING.refusal_work).effort is not None

    if not does(TUNING.max_stronger):
        return None
    low, high = 1.0, 2.0
    while high < TUNING.max_stronger and not does(high):
        low, high = high, 2.0 * high
    while high > TUNING.effort_accuracy * low:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if does(middle) else (middle, high)
    return high * move.effort_limit


def _possible_without(limit: Literal["breakaway", "direction"], move: Move, pulses: int) -> bool:
    programme = move.programme(pulses)
    if limit == "breakaway":
        lowest = programme.lowest.copy()
        lowest[0] = lowest[1]
        programme = replace(programme, lowest=lowest)
    else:
        fastest = move.effort_limit * pulses * move.pulse_width / move.arm.mass_1
        programme = replace(programme, least_velocity=-10.0 * fastest)
    return solve(programme, gap=1.0, work=TUNING.refusal_work).effort is not None
