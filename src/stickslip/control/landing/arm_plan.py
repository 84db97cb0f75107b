"""Learning of a flexible arm from a series, and the plan of the next one."""

from dataclasses import dataclass, fields, replace
from itertools import product
from math import ceil, inf, isfinite, pi, sqrt
from statistics import NormalDist
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from stickslip.control.feedback.linear_parts import Notch
from stickslip.control.landing.arm_belief import (
    LEARNED,
    ArmBelief,
    FlightLog,
    RunningFriction,
    Swing,
)
from stickslip.control.landing.supervisor import (
    FRICTION,
    LEAST_FRICTION,
    Supervisor,
    SupervisorState,
    Window,
)
from stickslip.control.landing.tuning import LANDING, LEARNING
from stickslip.friction import CoulombViscousFriction
from stickslip.numerics.growing import Growing
from stickslip.planning import NO_LOSSES, LoadLosses, PulseLaw, PulseSeries, PulseSeriesPlanner
from stickslip.plants import FlexibleArm
from stickslip.records import (
    AxisKind,
    InputError,
    LearnedPulses,
    SensorSample,
    StickslipError,
    quantity_field,
)


@dataclass(frozen=True, kw_only=True)
class Flight:
    """A series of pulses as planned and as it went."""

    start: float = quantity_field("time")  #: When it began [s].
    #: The series; its target may lie beyond that of the landing, to come back from.
    planned: PulseSeries
    coulomb_friction: float = quantity_field("coulomb_friction")  #: With which it was planned.
    viscous_friction: float = quantity_field("viscous_friction")  #: With which it was planned.
    #: Where mass 1 came to rest; None as long as it has not, or if the series was cut short.
    final_position: float | None = quantity_field("position", default=None)
    #: Amplitude of mass 2 about that place; None likewise.
    final_swing: float | None = quantity_field("position", default=None)


@dataclass(frozen=True, kw_only=True)
class LandingState(SupervisorState):
    """State of a landing controller of an arm."""

    flights: tuple[Flight, ...] = ()  #: All series so far.
    sent: int = 0  #: Samples of the present series that have been sent.
    #: The samples of the last series, the one at its begin first; none once it has been judged, or
    #: if there is nothing to learn from it.
    track: Growing[SensorSample] = Growing()
    static_ratio: float  #: Static over Coulomb friction, as assumed so far [-].
    #: Masses, spring and friction as learned from the series; None if they are taken as given.
    belief: ArmBelief | None = None
    braking: bool = False  #: Whether mass 1 is braked, as it has left the corridor of a series.
    request: "PlanRequest | None" = None  #: The plan that is asked for; None for none.
    answer: "PlanAnswer | None" = None  #: The plan that was given; None for none.
    request_count: int = 0  #: Plans asked for so far.

    def seen(self) -> Float[np.ndarray, "m 4"]:
        """Return positions and velocities of both masses in the samples of the last series."""
        return np.array(tuple(self.track))[:, 1:]

    @property
    def series_since_target(self) -> int:
        """How many series have begun since the last feedback phase."""
        names = [phase.name for phase in self.phases]
        since = len(names) - 1 - names[::-1].index("feedback")
        return names[since:].count("series")


@dataclass(frozen=True, kw_only=True)
class PlanRequest:
    """Request of a plan: the state of the landing at rest, and the begin of the series."""

    number: int  #: Of the request, from 1 on.
    state: LandingState  #: Of the landing when it was made.
    swing: Swing  #: Of mass 2 at that time.
    made: float = quantity_field("time")  #: When it was made.
    begin: float = quantity_field("time")  #: When the series begins.
    samples: int = 0  #: Samples at rest when it was made.


@dataclass(frozen=True, kw_only=True)
class PlanAnswer:
    """Answer to a request: what was learned from the last series, and the next one."""

    number: int  #: Of the request.
    flights: tuple[Flight, ...]  #: As of `LandingState`.
    static_ratio: float  #: As of `LandingState` [-].
    belief: ArmBelief | None  #: As of `LandingState`.
    series: PulseSeries | str | None  #: None if none was due, or why there is none.

    @classmethod
    def of(
        cls, state: LandingState, *, number: int, series: PulseSeries | str | None
    ) -> "PlanAnswer":
        """Return the answer of a state that has learned, with the next series."""
        own = {name: getattr(state, name) for name in cls._of_state()}
        return cls(number=number, series=series, **own)

    def learned(self) -> dict[str, Any]:
        """Return what was learned, by the names of `LandingState`."""
        return {name: getattr(self, name) for name in self._of_state()}

    @classmethod
    def _of_state(cls) -> list[str]:
        return [each.name for each in fields(cls) if each.name not in ("number", "series")]


@dataclass(frozen=True, kw_only=True)
class ArmPlans(Supervisor[LandingState]):
    """Settings of a landing of a flexible arm, and what its plans depend on.

    `LandingController` documents the settings.
    """

    arm: FlexibleArm
    arm_uncertainty: float = 0.0
    experience: LearnedPulses | None = None
    notch: Notch | None = None
    most_series: int = 6
    longest_series: float | None = quantity_field("time", default=None)
    travel: tuple[float, float] | None = quantity_field("position", default=None)
    planning_time: float = quantity_field("time", default=0.0)
    plans_inside: bool = True
    _states: ClassVar[type[LandingState]] = LandingState
    _answers: ClassVar[type[PlanAnswer]] = PlanAnswer

    @property
    def kind(self) -> AxisKind:
        """``"linear"`` or ``"rotary"``, as the arm."""
        return self.arm.kind

    @property
    def half_swing(self) -> float:
        """Half a period of mass 2 while mass 1 rests [s]."""
        return pi * sqrt(self.arm.mass_2 / self.arm.stiffness)

    @property
    def longest_wait(self) -> float:
        """The wait limit, or 20 swings of mass 2 [s]."""
        return LANDING.wait_limit * self.half_swing if self.wait_limit is None else self.wait_limit

    def init(self) -> LandingState:
        """Return the state before the first sample."""
        law, learned = self.arm.friction, self.experience
        known = law.coulomb_friction_positive + law.coulomb_friction_negative
        static = law.static_friction_positive + law.static_friction_negative
        given = static / known if known > 0.0 else 0.0
        return self._states(
            target=self.target,
            estimator_state=self.estimator.init(sampling_time=self.sampling_time),
            window=Window.of(self._window),
            static_ratio=max(given, LANDING.static_ratio),
            belief=None if learned is None else ArmBelief.resumed(self.arm, learned),
        )

    def _off(self, state: LandingState, sample: SensorSample) -> bool:
        """Return whether mass 1 is outside the corridor around the present series."""
        planned = state.flights[-1].planned
        k = min(state.sent, planned.effort.size)
        wide = max(
            LANDING.corridor_travel * abs(planned.target - float(planned.position[0])),
            LANDING.corridor_tolerance * self.tolerance,
            LANDING.corridor_noise * self.position_noise,
        )
        wide += LANDING.corridor_delay * self.sampling_time * float(np.abs(planned.velocity).max())
        return bool(abs(sample.measured_position - self._due(state, k)) > wide)

    def _due(self, state: LandingState, k: int) -> float:
        """Return where mass 1 is to be in sample k of the present series [m or rad]."""
        return float(state.flights[-1].planned.position[k])

    def plan(self, request: PlanRequest, *, series: bool = True) -> PlanAnswer:
        """Answer a request: learn from the last series, and plan the next one if it is due."""
        state, swing = request.state, request.swing
        later = request.begin - request.made
        try:
            state = self._after_series(state, swing)
            planned = self._next_series(state, swing, later) if series else None
        except (ArithmeticError, MemoryError, np.linalg.LinAlgError, ValueError) as error:
            planned = f"no series could be planned ({type(error).__name__})"
        return self._answers.of(state, number=request.number, series=planned)

    def answered(self, state: LandingState, answer: PlanAnswer) -> LandingState:
        """Return the state with an answer to its request; one to an earlier request is ignored."""
        if state.request is None or answer.number != state.request.number:
            return state
        if state.phase.name in ("done", "stopped"):
            return replace(self._learned_of(state, answer), request=None, answer=None)
        return replace(state, answer=answer)

    def _learned_of(self, state: LandingState, answer: PlanAnswer) -> LandingState:
        """Return the state with what an answer has learned."""
        return replace(state, track=Growing(), **answer.learned())

    def _next_series(
        self, state: LandingState, swing: Swing, later: float = 0.0
    ) -> PulseSeries | str:
        """Return the series to fire some time from now, or why there is none.

        Mass 1 moves one way only, so that a series of travel d takes up a swing of amplitude A < d
        at most: mass 2 is driven by the spring as x1 moves from 0 to d, and the component at its
        frequency of a velocity that never turns is at most that travel. Otherwise, and where the
        travel is too short for a pulse that frees mass 1, mass 1 is first taken to a place beyond,
        from where another series comes back without a swing to take up.
        """
        travel = abs(state.target - swing.position) + swing.amplitude
        try:
            planner, smallest = self._planner(state, swing)
        except InputError as refusal:  # the estimate may be of no arm that could rest
            return str(refusal)
        longest = self._longest(state, travel)
        places = self._places(state, swing, max(travel, smallest))
        low, high = (-inf, inf) if self.travel is None else self.travel
        why = ""
        reachable = [each for each in places if low <= each <= high]
        for times, place in product(self._longer(state), reachable):
            slowest = self._slowest(state, abs(place - swing.position))
            for least_speed in dict.fromkeys((slowest, PulseSeriesPlanner.slowest)):
                each = replace(planner, slowest=least_speed, longest=times * longest)
                try:
                    return each.plan(swing.state(later), place)
                except StickslipError as refusal:
                    why = why or str(refusal)
        return why or "every place that a series could lead to is outside the travel"

    def _planner(self, state: LandingState, swing: Swing) -> tuple[PulseSeriesPlanner, float]:
        """Return the planner of series, and the least travel of one to a place beyond.

        Static friction is assumed, so it is limited to a part of the effort limit.
        """
        arm = self._estimated_arm(state)
        coulomb, viscous = self._friction(state)
        pulled = arm.stiffness * swing.amplitude + abs(arm.friction.offset)
        most = LANDING.most_static * self._plan_limit(state) - pulled
        static = max(coulomb, min(coulomb * state.static_ratio, most))
        friction = CoulombViscousFriction.symmetric(
            coulomb_friction=coulomb,
            viscous_friction=viscous,
            static_friction=static,
            offset=arm.friction.offset,
        )
        planner = PulseSeriesPlanner(
            arm=replace(arm, friction=friction),
            sampling_time=self.sampling_time,
            effort_limit=self._plan_limit(state),
            excess=LANDING.excess,
            impulse_gap=LANDING.impulse_gap,
            rest_on_the_way=True,
            losses=self._losses(state),
            pulse_samples=self._pulse_samples,
        )
        alone = PulseLaw(
            mass=arm.mass_1,
            coulomb_friction=coulomb,
            viscous_friction=viscous,
            static_friction=static,
            kind=arm.kind,
        )
        smallest = float(alone.smallest_displacement(self.sampling_time))
        return planner, LANDING.smallest_steps * smallest

    def _places(self, state: LandingState, swing: Swing, least: float) -> list[float]:
        """Return where a series may lead, in order of preference; ``least`` is a travel."""
        error = state.target - swing.position
        ahead = 1.0 if error > 0.0 else -1.0
        places = [state.target] if swing.amplitude < LANDING.direct_swing * abs(error) else []
        beyond = product(LANDING.beyond, (ahead, -ahead))
        return places + [swing.position + side * share * least for share, side in beyond]

    def _longer(self, state: LandingState) -> tuple[float, ...]:
        """Return how long a series may be, over its usual limit, one after the other."""
        del state
        return (1.0,)

    def _plan_limit(self, state: LandingState) -> float:
        """Return the largest effort of a series."""
        del state
        return self.effort_limit

    def _slowest(self, state: LandingState, travel: float) -> float:
        """Return the least speed of a series of a travel, over its mean speed."""
        del state, travel
        return PulseSeriesPlanner.slowest

    @property
    def _pulse_samples(self) -> int:
        """Samples in each pulse of a series."""
        return 1

    def _losses(self, state: LandingState) -> LoadLosses:
        """Return what brakes mass 2, as estimated."""
        del state
        return NO_LOSSES

    @property
    def _slack(self) -> float:
        """Longest series over the time of a rigid arm and a swing."""
        return LANDING.slack

    def _longest(self, state: LandingState, travel: float) -> float:
        """Return the longest duration of a series over a travel [s]."""
        if self.longest_series is not None:
            return self.longest_series
        arm, limit = self._estimated_arm(state), self._plan_limit(state)
        coulomb, _ = self._friction(state)
        mass = arm.mass_1 + arm.mass_2
        free = max(limit - coulomb, (1.0 - LANDING.most_static) * limit)
        rigid = 2.0 * sqrt(LANDING.beyond[-1] * travel * mass / free)
        return self._slack * (rigid + 2.0 * pi * sqrt(arm.mass_2 / arm.stiffness))

    def _launched(
        self, state: LandingState, sample: SensorSample, series: PulseSeries
    ) -> LandingState:
        coulomb, viscous = self._friction(state)
        flight = Flight(
            start=sample.time,
            planned=series,
            coulomb_friction=coulomb,
            viscous_friction=viscous,
        )
        return replace(
            state, flights=(*state.flights, flight), sent=0, track=Growing((), (sample,))
        )

    def _settled(self, state: LandingState, waited: float) -> bool:
        """Return whether mass 1 has rested long enough for the swing to be known.

        Near the target, or with much noise, it takes half a swing: the band in which noise lets a
        rest be seen then hides slow motion. Where the spring pulls about as hard as static friction
        holds, mass 1 gives way a little in every swing, for very long: after some of them a brief
        rest has to do.
        """
        left = abs(state.target - 0.5 * (state.window.low + state.window.high))
        share = LANDING.rest_swing if self._band <= LANDING.fine_band * left else 1.0
        rest = max(ceil(share * self.half_swing / self.sampling_time), LANDING.rest_samples)
        long_enough = waited >= LANDING.yielding_time * self.half_swing
        return state.window.count >= (LANDING.brief_rest if long_enough else rest)

    def _swing(self, state: LandingState) -> Swing:
        return Swing.seen(
            state.window.seen(),
            arm=self._estimated_arm(state),
            sampling_time=self.sampling_time,
            position_noise=self.position_noise,
            velocity_noise=self.velocity_noise,
        )

    @property
    def _band(self) -> float:
        farthest = NormalDist().inv_cdf(1.0 - LANDING.missed_rest / (2.0 * self._window))
        return 2.0 * farthest * self.position_noise

    @property
    def _window(self) -> int:
        """Samples in which rest is looked for."""
        kept = ceil(LANDING.window_length * self.half_swing / self.sampling_time)
        return max(kept, LANDING.rest_samples) + 1

    @property
    def _moving_speed(self) -> float:
        """Measured velocity of a mass that certainly moves [m/s or rad/s]."""
        return LANDING.moving_deviations * self.velocity_noise

    def _learns(self, state: LandingState) -> bool:
        """Return whether masses and spring are learned."""
        return self.arm_uncertainty > 0.0 or state.belief is not None

    def _estimated_arm(self, state: LandingState) -> FlexibleArm:
        """Return the arm with masses and spring as estimated now; `_friction` has its friction."""
        return self.arm if state.belief is None else state.belief.arm

    def _miss(self, state: LandingState, swing: Swing) -> float:
        """Return the larger of what mass 1 is off the target and mass 2 swings about mass 1."""
        return max(abs(state.target - swing.position), swing.amplitude)

    def _after_series(self, state: LandingState, swing: Swing) -> LandingState:
        """Note how the last series ended, if it is not known yet, and learn from it."""
        if not state.track:
            return state
        last = state.flights[-1]
        ended = replace(last, final_position=swing.position, final_swing=swing.amplitude)
        flight = self._flight(last.planned, state.seen())
        state = replace(state, flights=(*state.flights[:-1], ended), track=Growing())
        stayed = abs(swing.position - last.planned.position[0]) <= self._band
        if stayed or flight.late:
            coulomb, _ = self._friction(state)
            most = max(LANDING.most_static * self._plan_limit(state) / coulomb, state.static_ratio)
            state = replace(state, static_ratio=min(LANDING.static_step * state.static_ratio, most))
        missed = max(abs(swing.position - last.planned.target), swing.amplitude)
        unexplained = missed > max(self.tolerance, self._by_noise(last.planned))
        if stayed or not (self._learns(state) or unexplained):
            return state
        belief = self._belief(state)
        belief = belief.later() if state.series_since_target == 1 else belief
        return replace(state, belief=belief.after(flight, self._running(state)))

    def _flight(self, planned: PulseSeries, seen: Float[np.ndarray, "m 4"]) -> FlightLog:
        return FlightLog.of(
            planned,
            seen,
            position_noise=self.position_noise,
            velocity_noise=self.velocity_noise,
        )

    def _running(self, state: LandingState) -> RunningFriction | None:
        """Return friction by the running estimator; None before it has estimated any."""
        coulomb, viscous = self._estimated(state)
        P = self._covariance(state)
        (move,) = self.approach(0.0, 1.0, state.estimator_state).reference.moves
        travel = max(abs(float(np.ptp(each.planned.position))) for each in state.flights)
        if not (isfinite(coulomb) and isfinite(viscous) and np.isfinite(P).all()):
            return None
        return RunningFriction(
            coulomb_friction=coulomb,
            viscous_friction=viscous,
            covariance=P,
            speed=travel / move.duration,
        )

    def _by_noise(self, planned: PulseSeries) -> float:
        """Return how far a series may miss by what noise does to its start and to friction."""
        if self.position_noise == 0.0:
            return 0.0
        deviations, share = LEARNING.noise_deviations, LEARNING.noise_travel
        travel = abs(planned.target - float(planned.position[0]))
        return max(deviations * self.position_noise, share * travel)

    def _belief(self, state: LandingState) -> ArmBelief:
        """Return the estimate of the arm; before the first series that of the running estimator."""
        if state.belief is not None:
            return state.belief
        coulomb, viscous = self._friction(state)
        covariance = self._covariance(state)
        if not covariance[0, 0] < self.effort_limit**2:  # not informative
            covariance = np.full((2, 2), inf)
        return ArmBelief.first(
            self.arm,
            uncertainty=self.arm_uncertainty or LEARNING.body_uncertainty,
            coulomb_friction=coulomb,
            viscous_friction=viscous,
            covariance=covariance,
        )

    def _friction(self, state: LandingState) -> tuple[float, float]:
        """Return Coulomb and viscous friction as estimated, as far as a law can hold them."""
        coulomb, viscous = self._estimated(state)
        if state.belief is not None:
            law = state.belief.arm.friction
            coulomb, viscous = law.coulomb_friction_positive, law.viscous_friction_positive
        return max(coulomb, LEAST_FRICTION * self.effort_limit), max(viscous, 0.0)

    def estimates(self, state: LandingState) -> dict[str, float]:
        """Return friction as estimated, with masses and spring if they are learned [SI].

        The static friction is only what has been enough to free mass 1.
        """
        coulomb, viscous = self._friction(state)
        static = coulomb * state.static_ratio
        found: dict[str, float] = dict(zip(FRICTION, (coulomb, viscous, static), strict=True))
        if self._learns(state):
            body = self._belief(state).values
            found |= {name: body[name] for name in LEARNED[:3]}
        return found

    def deviations(self, state: LandingState) -> dict[str, float]:
        """Return standard deviations of the estimates, but for static friction [SI]."""
        found = super().deviations(state)
        if not self._learns(state):
            return found
        own = self._belief(state).deviations
        if state.belief is None:
            own |= {name: inf for name, spread in found.items() if not isfinite(spread)}
        return {name: own[name] for name in (*found, *LEARNED[:3])}

    def learned(self, state: LandingState) -> LearnedPulses:
        """Return what was learned, for the first guesses of the next run.

        The covariance is that of the estimator, or, where masses and spring are learned, of the
        logarithms of masses, spring, Coulomb and viscous friction.

        Raises
        ------
        InputError
            If nothing has been learned yet.
        """
        covariance = self._known_covariance(state) if state.belief is None else np.empty(0)
        return LearnedPulses(
            method="landing",
            kind=self.kind,
            values=self.estimates(state),
            covariance=self._belief(state).covariance if self._learns(state) else covariance,
        )
