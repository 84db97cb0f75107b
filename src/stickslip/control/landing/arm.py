"""Landing of a flexible arm: feedback moves it near its target, pulse series land it at rest."""

from dataclasses import dataclass, replace
from math import ceil, inf, isfinite, pi, sqrt
from statistics import NormalDist
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from stickslip.control.feedback.controller import FeedbackController
from stickslip.control.feedback.linear_parts import PD, Notch
from stickslip.control.feedback.reference import Move
from stickslip.control.landing.arm_belief import LEARNED, ArmBelief, FlightLog, Swing, check_learned
from stickslip.control.landing.supervisor import (
    FRICTION,
    LEAST_FRICTION,
    Supervisor,
    SupervisorState,
    Window,
)
from stickslip.friction import CoulombViscousFriction
from stickslip.planning import PulseLaw, PulseSeries, PulseSeriesPlanner
from stickslip.plants import FlexibleArm
from stickslip.records import (
    AxisKind,
    InputError,
    LearnedPulses,
    SensorSample,
    StickslipError,
    non_negative,
    quantity_field,
    whole,
)

# Rest
_MISSED = 1e-3  # of the windows of an axis at rest are not seen as such
_LATE = 80  # samples at rest before a plan: an estimator that smooths has seen all by then
_REST = 0.4  # half swings at rest before a plan: a sine is known by then
_FINE = 0.01  # of the travel left: a wider band of noise hides motion that matters
_GIVES, _BRIEF = 6.0, 8  # half swings in which mass 1 may give way; samples that must do then
_KEPT = 2.0  # half swings kept in the window
_WAIT_RULE = 40.0  # half swings
_STATIC = 1.3  # static over Coulomb friction, where nothing is known

# The gains of the surrogate arm of the demonstration, without units
_STIFFNESS_SHARE = 1.5  # of the position gain
_DAMPING_SHARE = 2.5  # of the velocity gain, over the root of stiffness times mean mass
_NOTCH_DEPTH, _NOTCH_DAMPING = 0.5, 0.4
_PERIODS = 1.5  # of the free arm that the reference takes at least

# Learning from series
_STATIC_STEP = 1.25  # by which static friction is raised when a series has not freed mass 1
_BY_NOISE = (10.0, 0.05)  # deviations of a position, of the travel: noise explains no larger miss
_UNCERTAIN = 0.02  # relative deviation of masses and spring where none was given

# The next series
_DIRECT = 0.8  # of the travel left: a swing below it can be taken up on the way
_BEYOND = (1.5, 3.0)  # of the travel left and the swing, to a place to come back from
_SMALLEST = 4.0  # smallest steps there at least
_EXCESS, _GAP = 0.1, 0.3  # over the shortest time and the least impulse: found with little work


@dataclass(frozen=True, kw_only=True)
class Flight:
    """A series of pulses as planned and as it went.

    Attributes
    ----------
    start
        When it began [s].
    planned
        The series; its target may lie beyond that of the landing, to come back from.
    coulomb_friction, viscous_friction
        With which it was planned [N or N m, N s/m or N m s/rad].
    final_position
        Where mass 1 came to rest; None as long as it has not, or if the series was cut short.
    final_swing
        Amplitude of mass 2 about that place; None likewise.
    """

    start: float = quantity_field("time")
    planned: PulseSeries
    coulomb_friction: float = quantity_field("coulomb_friction")
    viscous_friction: float = quantity_field("viscous_friction")
    final_position: float | None = quantity_field("position", default=None)
    final_swing: float | None = quantity_field("position", default=None)


@dataclass(frozen=True, kw_only=True)
class LandingState(SupervisorState):
    """State of a landing controller of an arm.

    Attributes
    ----------
    flights
        All series so far.
    sent
        Samples of the present series that have been sent.
    track
        The samples of the last series, the one at its begin first; none once it has been judged, or
        if there is nothing to learn from it.
    static_ratio
        Static over Coulomb friction, as assumed so far [-].
    belief
        Masses, spring and friction as learned from the series; None if they are taken as given.
    """

    flights: tuple[Flight, ...] = ()
    sent: int = 0
    track: tuple[SensorSample, ...] = ()
    static_ratio: float
    belief: ArmBelief | None = None

    @property
    def series_since_target(self) -> int:
        """How many series have begun since the last feedback phase."""
        names = [phase.name for phase in self.phases]
        since = len(names) - 1 - names[::-1].index("feedback")
        return names[since:].count("series")


def scaled_pd(arm: FlexibleArm) -> PD:
    """Return the gains of the surrogate arm, scaled with the spring and masses of this arm."""
    mean = 0.5 * (arm.mass_1 + arm.mass_2)
    return PD(
        position_gain=_STIFFNESS_SHARE * arm.stiffness,
        velocity_gain=_DAMPING_SHARE * sqrt(arm.stiffness * mean),
    )


def scaled_notch(arm: FlexibleArm) -> Notch:
    """Return the shallow notch of the surrogate arm at the resonance of this arm."""
    return Notch.at_resonance(
        mass_1=arm.mass_1,
        mass_2=arm.mass_2,
        stiffness=arm.stiffness,
        depth=_NOTCH_DEPTH,
        damping=_NOTCH_DAMPING,
    )


@dataclass(frozen=True, kw_only=True)
class LandingController(Supervisor[LandingState]):
    """Land a flexible arm: both masses at rest on the target, with friction learned on the way.

    The supervisor that the concluding remarks of van de Wijdeven (2002) sketch. Its phases, and
    what ends each:

    feedback
        PD, notch and compensation of friction by the running estimate, along a smooth reference to
        short of the target. Ends when mass 1 rests after the reference, or at the wait limit.
    resting
        No effort. Ends when mass 1 has rested for 0.4 of a half swing of mass 2 (a whole one where
        noise is not far below the way left), and for 80 samples at least (after six half swings,
        for 8 samples). The swing is then fitted: both within the tolerance, it is *done*;
        otherwise a *series* is planned. It is *stopped* when there is none, after ``most_series``,
        or when mass 1 does not come to rest.
    series
        Pulses planned from the estimates. Ends with the last pulse, or when samples are missed, as
        then the rest of it comes too late: resting again.
    done, stopped
        No effort. A new target begins with feedback.

    A series moves mass 1 one way only, and takes up a swing of mass 2 that is smaller than its way;
    so feedback leaves some of the way to it. A larger swing is taken up on the way to a place
    beyond, from where a second series comes back. The estimator runs along through all phases, so
    that what a series did corrects what the next is planned with, and what was known before stays.
    Friction that has changed since is not found so: where two series have not landed the arm, the
    motion along each is explained anew, with masses and spring 2 % uncertain. The number of series
    is bounded: it cannot limit-cycle.

    It steps in the interpreter, as it solves a linear programme when a series is due.

    Attributes
    ----------
    sampling_time, target, effort_limit, estimator, position_noise, velocity_noise, pd
        As of `Supervisor`; gains by rule are those of the surrogate arm of
        the demonstration, scaled.
    tolerance
        How far from the target at most, each of mass 1 and the swing of mass 2 about mass 1.
    arm
        First guess of masses and spring; of its friction the offset and the ratio of
        static to Coulomb friction are used.
    arm_uncertainty
        Standard deviation of masses and spring, over their values [-]. Above 0 they and the
        friction are learned from the motion along each series, from the first on.
    experience
        What an earlier run has learned of masses, spring and friction (`resumed`), that it goes on
        from; or None.
    notch
        Of the feedback phase; None scales that of the surrogate arm.
    most_series
        After so many it stops.
    wait_limit
        How long mass 1 may take to come to rest after the reference or a series; None for 20 swings
        of mass 2.

    Raises
    ------
    InputError
        If a value is out of its range.

    Examples
    --------
    >>> from stickslip.estimation import EnergyEstimator
    >>> from stickslip.friction import CoulombViscousFriction
    >>> from stickslip.plants import FlexibleArm
    >>> from stickslip.simulation import simulate_closed_loop
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)
    >>> arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
    >>> controller = LandingController(
    ...     sampling_time=0.02, target=1.0, tolerance=1e-5, arm=arm, effort_limit=2.0,
    ...     estimator=EnergyEstimator(
    ...         inertia=1.0, load_inertia=1.0, stiffness=1.0, offset=False))
    >>> run = simulate_closed_loop(arm, controller, sampling_time=0.02, samples=2500)
    >>> controller.outcome(run.controller_state).value
    'reached'
    """

    arm: FlexibleArm
    arm_uncertainty: float = 0.0
    experience: LearnedPulses | None = None
    notch: Notch | None = None
    most_series: int = 6
    _driven: ClassVar[str] = "mass 1"
    _left: ClassVar[float] = 0.2  # more than mass 2 usually swings

    def __post_init__(self) -> None:
        super().__post_init__()
        uncertainty = non_negative("arm_uncertainty", self.arm_uncertainty, "(no unit)")
        object.__setattr__(self, "arm_uncertainty", uncertainty)
        self._check_effort(max(self.arm.friction.breakaway()) + abs(self.arm.friction.offset))
        if self.experience is not None:
            check_learned(self.experience, self.kind)
        whole("most_series", self.most_series, least=1)

    @property
    def kind(self) -> AxisKind:
        """``"linear"`` or ``"rotary"``, as the arm."""
        return self.arm.kind

    @property
    def half_swing(self) -> float:
        """Half a period of mass 2 while mass 1 rests [s]."""
        return pi * sqrt(self.arm.mass_2 / self.arm.stiffness)

    def resumed(self, learned: LearnedPulses) -> "LandingController":
        """Return the same controller, beginning with what an earlier run has learned of the arm.

        The estimator stays as it is, so that one of the learned masses and spring has to be given.

        It is from `learned` of a controller with an ``arm_uncertainty``, or read from a file.

        Raises
        ------
        InputError
            If it was learned by another method, on another kind of axis, or cannot be.
        """
        check_learned(learned, self.kind)
        known = ArmBelief.resumed(self.arm, learned)
        return replace(self, arm=known.arm, experience=learned)

    @property
    def longest_wait(self) -> float:
        """The wait limit, or 20 swings of mass 2 [s]."""
        return _WAIT_RULE * self.half_swing if self.wait_limit is None else self.wait_limit

    def init(self) -> LandingState:
        """Return the state before the first sample."""
        law, learned = self.arm.friction, self.experience
        known = law.coulomb_friction_positive + law.coulomb_friction_negative
        static = law.static_friction_positive + law.static_friction_negative
        return LandingState(
            target=self.target,
            feedback_state=np.empty(0),
            estimator_state=self.estimator.init(sampling_time=self.sampling_time),
            window=Window.of(self._window),
            static_ratio=max(static / known, _STATIC) if known > 0.0 else _STATIC,
            belief=None if learned is None else ArmBelief.resumed(self.arm, learned),
        )

    def _readable(self, sample: SensorSample) -> bool:
        return all(isfinite(value) for value in sample)

    def approach(
        self, start: float, end: float, estimator_state: Float[np.ndarray, " e"]
    ) -> FeedbackController:
        """Return PD, notch and compensation from a place to another (of mass 1) [m or rad].

        The reference takes long enough that its acceleration of both masses needs no more than a
        part of the effort limit, and does not excite the resonance.
        """
        arm = self.arm
        inertia = arm.mass_1 + arm.mass_2
        resonance = sqrt(arm.stiffness * (1.0 / arm.mass_1 + 1.0 / arm.mass_2))
        light = self._light_duration(inertia, end - start)
        return self._feedback(
            estimator_state,
            move=Move(target=end, duration=max(light, _PERIODS * 2.0 * pi / resonance)),
            start=start,
            inertia=inertia,
            pd=scaled_pd(arm) if self.pd is None else self.pd,
            notch=scaled_notch(arm) if self.notch is None else self.notch,
        )

    def _landing(self, state: LandingState, sample: SensorSample) -> tuple[LandingState, float]:
        if state.track and len(state.track) <= state.flights[-1].planned.effort.size:
            state = replace(state, track=(*state.track, sample))
        state = self._transition(state, sample)
        if state.phase.name != "series":
            return state, 0.0
        effort = float(state.flights[-1].planned.effort[state.sent])
        return replace(state, sent=state.sent + 1), effort

    def _after_approach(
        self, state: LandingState, sample: SensorSample, reason: str
    ) -> LandingState:
        # Of a series that a new target has cut short nothing is learned
        return self._enter(replace(state, track=()), sample, "resting", reason)

    def _transition(self, state: LandingState, sample: SensorSample) -> LandingState:
        """Return the state, in the phase that is due: every transition but those of feedback."""
        phase = state.phase
        name, reason = phase.name, phase.reason
        if name == "series":
            flight = state.flights[-1]
            due = flight.start + state.sent * self.sampling_time
            if abs(sample.time - due) > 0.5 * self.sampling_time:
                state, name, reason = replace(state, track=()), "resting", "samples were missed"
            elif state.sent == flight.planned.effort.size:
                name, reason = "resting", "the last pulse was sent"
        elif name == "resting" and not self._settled(state, sample.time - phase.start):
            if sample.time - phase.start >= self.longest_wait + _LATE * self.sampling_time:
                name, reason = "stopped", "mass 1 does not come to rest"
        elif name == "resting":
            swing = self._swing(state)
            state = self._after_series(state, swing)
            if self._miss(state, swing) <= self.tolerance:
                name, reason = "done", "both masses are within the tolerance"
            elif state.series_since_target >= self.most_series:
                name, reason = "stopped", f"{self.most_series} series have not landed it"
            elif isinstance(series := self._next_series(state, swing), str):
                name, reason = "stopped", series
            else:
                state, name = self._launched(state, sample, series), "series"
                reason = "a series leads to the target"
                if series.target != state.target:
                    reason = (
                        "mass 2 swings more than the way left: a series leads beyond, to come back"
                    )
        return state if name == phase.name else self._enter(state, sample, name, reason)

    def _next_series(self, state: LandingState, swing: Swing) -> PulseSeries | str:
        """Return the series to fire, or why there is none.

        Mass 1 moves one way only, so that a series of travel d takes up a swing of amplitude A < d
        at most: mass 2 is driven by the spring as x1 moves from 0 to d, and the component at its
        frequency of a velocity that never turns is at most that travel. Otherwise, and where the
        travel is too short for a pulse that frees mass 1, mass 1 is first taken to a place beyond,
        from where another series comes back without a swing to take up.
        """
        arm, target = self._estimated_arm(state), state.target
        coulomb, viscous = self._friction(state)
        static = coulomb * state.static_ratio
        error, amplitude = target - swing.position, swing.amplitude
        try:
            friction = CoulombViscousFriction.symmetric(
                coulomb_friction=coulomb,
                viscous_friction=viscous,
                static_friction=static,
                offset=arm.friction.offset,
            )
            planner = PulseSeriesPlanner(
                arm=replace(arm, friction=friction),
                sampling_time=self.sampling_time,
                effort_limit=self.effort_limit,
                excess=_EXCESS,
                impulse_gap=_GAP,
                rest_on_the_way=True,
            )
            alone = PulseLaw(
                mass=arm.mass_1,
                coulomb_friction=coulomb,
                viscous_friction=viscous,
                static_friction=static,
                kind=arm.kind,
            )
        except InputError as refusal:  # what is estimated may be no arm that could rest
            return str(refusal)
        smallest = _SMALLEST * float(alone.smallest_displacement(self.sampling_time))
        least = max(abs(error) + amplitude, smallest)
        ahead = 1.0 if error > 0.0 else -1.0
        places = [target] if amplitude < _DIRECT * abs(error) else []
        places += [
            swing.position + side * share * least for share in _BEYOND for side in (ahead, -ahead)
        ]
        why = ""
        for place in places:
            try:
                return planner.plan(swing.state(), place)
            except StickslipError as refusal:
                why = why or str(refusal)
        return why

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
        return replace(state, flights=(*state.flights, flight), sent=0, track=(sample,))

    def _settled(self, state: LandingState, waited: float) -> bool:
        """Return whether mass 1 has rested long enough for the swing to be known.

        Near the target, or with much noise, it takes half a swing: the band in which noise lets a
        rest be seen then hides slow motion. Where the spring pulls about as hard as static friction
        holds, mass 1 gives way a little in every swing, for very long: after some of them a brief
        rest has to do.
        """
        left = abs(state.target - 0.5 * (state.window.low + state.window.high))
        share = _REST if self._band <= _FINE * left else 1.0
        rest = max(ceil(share * self.half_swing / self.sampling_time), _LATE)
        return state.window.count >= (rest if waited < _GIVES * self.half_swing else _BRIEF)

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
        farthest = NormalDist().inv_cdf(1.0 - _MISSED / (2.0 * self._window))
        return 2.0 * farthest * self.position_noise

    @property
    def _window(self) -> int:
        """Samples in which rest is looked for."""
        return max(ceil(_KEPT * self.half_swing / self.sampling_time), _LATE) + 1

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
        flight = FlightLog.of(
            last.planned,
            state.track,
            position_noise=self.position_noise,
            velocity_noise=self.velocity_noise,
        )
        state = replace(state, flights=(*state.flights[:-1], ended), track=())
        stayed = abs(swing.position - last.planned.position[0]) <= self._band
        if stayed or flight.late:
            state = replace(state, static_ratio=_STATIC_STEP * state.static_ratio)
        missed = max(abs(swing.position - last.planned.target), swing.amplitude)
        unexplained = missed > max(self.tolerance, self._by_noise(last.planned))
        if stayed or not (self._learns(state) or unexplained):
            return state
        belief = self._belief(state)
        belief = belief.later() if state.series_since_target == 1 else belief
        return replace(state, belief=belief.after(flight))

    def _by_noise(self, planned: PulseSeries) -> float:
        """Return how far a series may miss by what noise does to its start and to friction."""
        if self.position_noise == 0.0:
            return 0.0
        deviations, share = _BY_NOISE
        travel = abs(planned.target - float(planned.position[0]))
        return max(deviations * self.position_noise, share * travel)

    def _belief(self, state: LandingState) -> ArmBelief:
        """Return the estimate of the arm; before the first series that of the running estimator."""
        if state.belief is not None:
            return state.belief
        coulomb, viscous = self._friction(state)
        return ArmBelief.first(
            self.arm,
            uncertainty=self.arm_uncertainty or _UNCERTAIN,
            coulomb_friction=coulomb,
            viscous_friction=viscous,
            covariance=self._covariance(state),
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
