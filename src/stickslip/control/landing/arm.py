"""Landing of a flexible arm: feedback moves it near its target, pulse series land it at rest."""

from dataclasses import dataclass, replace
from math import ceil, pi, sqrt
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from stickslip.control.checks import check_fields
from stickslip.control.feedback.controller import FeedbackController
from stickslip.control.feedback.linear_parts import PD, Notch
from stickslip.control.feedback.reference import Move
from stickslip.control.landing.arm_belief import (
    ArmBelief,
    Swing,
    check_learned,
)
from stickslip.control.landing.arm_plan import ArmPlans, LandingState, PlanRequest
from stickslip.control.landing.tuning import APPROACH, LANDING
from stickslip.numerics.growing import Growing
from stickslip.planning import PulseSeries
from stickslip.plants import FlexibleArm
from stickslip.records import (
    LearnedPulses,
    SensorSample,
    non_negative,
    positive,
    whole,
)


def scaled_pd(arm: FlexibleArm) -> PD:
    """Return the gains of the surrogate arm, scaled with the spring and masses of this arm."""
    mean = 0.5 * (arm.mass_1 + arm.mass_2)
    return PD(
        position_gain=APPROACH.arm_position_gain * arm.stiffness,
        velocity_gain=APPROACH.arm_velocity_gain * sqrt(arm.stiffness * mean),
    )


def scaled_notch(arm: FlexibleArm) -> Notch:
    """Return the shallow notch of the surrogate arm at the resonance of this arm."""
    return Notch.at_resonance(
        mass_1=arm.mass_1,
        mass_2=arm.mass_2,
        stiffness=arm.stiffness,
        depth=APPROACH.notch_depth,
        damping=APPROACH.notch_damping,
    )


@dataclass(frozen=True, kw_only=True)
class LandingController(ArmPlans):
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
        then the rest of it would act too late: resting again.
    done, stopped
        No effort. An arm that leaves the tolerance goes on to *resting*. A new target begins with
        feedback.

    A series is aborted, and mass 1 braked, when it leaves the corridor around the plan. A series
    moves mass 1 one way only, and takes up a swing of mass 2 that is smaller than its way;
    so feedback leaves some of the way to it. A larger swing is taken up on the way to a place
    beyond, from where a second series comes back. The estimator runs along through all phases, so
    that what a series did corrects what the next is planned with, and what was known before stays.
    Friction that has changed since is not found so: where two series have not landed the arm, the
    motion along each is explained anew, with masses and spring 2 % uncertain. The number of series
    is bounded: it cannot limit-cycle.

    It steps in the interpreter. A plan is a linear programme and takes longer than a sample. With a
    ``planning_time`` it is asked for in the state (``request``); `plan` answers it beside the loop,
    `answered` puts the answer into the state, and the series begins that time after the request.
    `PlannedBeside` does so in a thread.

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
    longest_series
        Longest duration of a series; None for four times that of a rigid arm with one swing.
    travel
        Lowest and highest position that a series may lead to; None for no limit.
    planning_time
        Time between the request of a plan and the begin of its series; 0 plans inside a step.
    plans_inside
        Whether the plan is made inside the step in which it is due, as in a simulation; otherwise
        it is awaited from outside.

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

    _driven: ClassVar[str] = "mass 1"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_fields(self, non_negative, {"arm_uncertainty": "(no unit)"})
        check_fields(self, positive, {"longest_series": "s"})
        check_fields(self, non_negative, {"planning_time": "s"})
        self._check_effort(max(self.arm.friction.breakaway()) + abs(self.arm.friction.offset))
        if self.experience is not None:
            check_learned(self.experience, self.kind)
        whole("most_series", self.most_series, least=1)

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
    def _left(self) -> float:
        return APPROACH.left_travel

    @property
    def channels(self) -> tuple[str, ...]:
        """Positions and velocities of both masses."""
        return SensorSample._fields[1:]

    def warm_up(self) -> None:
        """Compile and load all that steps and plans use."""
        super().warm_up()
        state = self.init()
        state = replace(state, target=state.target or 1.0)
        swing = Swing(position=0.0, offset=0.0, velocity=0.0, frequency=pi / self.half_swing)
        series = self._next_series(state, swing)
        if isinstance(series, PulseSeries):
            self._warm_up(state, series)

    def _warm_up(self, state: LandingState, series: PulseSeries) -> None:
        """Compile and load all that follows the plan of a series."""
        self._belief(state).after(self._flight(series, series.states))

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
            move=Move(target=end, duration=max(light, APPROACH.arm_periods * 2.0 * pi / resonance)),
            start=start,
            inertia=inertia,
            pd=scaled_pd(arm) if self.pd is None else self.pd,
            notch=scaled_notch(arm) if self.notch is None else self.notch,
        )

    def _landing(self, state: LandingState, sample: SensorSample) -> tuple[LandingState, float]:
        state = self._tracked(state, sample)
        state = self._transition(state, sample)
        return self._braked(state, sample) if state.braking else self._sent(state, sample)

    def _sent(self, state: LandingState, sample: SensorSample) -> tuple[LandingState, float]:
        """Return the state and the effort of an arm that is not braked."""
        del sample
        return self._planned_effort(state)

    def _planned_effort(self, state: LandingState) -> tuple[LandingState, float]:
        series = self._under_way(state)
        if series is None:
            return state, 0.0
        return replace(state, sent=state.sent + 1), float(series.effort[state.sent])

    def _under_way(self, state: LandingState) -> PulseSeries | None:
        """Return the series with an effort due; None if there is none."""
        if state.phase.name != "series":
            return None
        series = state.flights[-1].planned
        return series if state.sent < series.effort.size else None

    def blind(self, state: LandingState, time: float) -> tuple[LandingState, float]:
        """Take a sample at a time [s] of which nothing else is known; a series goes on."""
        if not state.renewed and state.feedback is None:
            state = self._tracked(state, SensorSample(time=time))
        return super().blind(state, time)

    def _tracked(self, state: LandingState, sample: SensorSample) -> LandingState:
        """Return the state with the sample among those of the last series, until it has ended."""
        if not state.track or len(state.track) > state.flights[-1].planned.effort.size:
            return state
        if state.phase.name != "series" and len(state.track) > state.sent:
            return state
        return replace(state, track=state.track.after(sample))

    def _braked(self, state: LandingState, sample: SensorSample) -> tuple[LandingState, float]:
        """Return the state and the effort that slows mass 1, until friction stops it at once."""
        mass, v = self.arm.mass_1, sample.measured_velocity
        coulomb, _ = self._friction(state)
        if abs(v) * mass <= coulomb * self.sampling_time + mass * self._moving_speed:
            return replace(state, braking=False), 0.0
        effort = -mass / (LANDING.braking_time * self.sampling_time) * v
        return state, min(max(effort, -self.effort_limit), self.effort_limit)

    def _after_approach(
        self, state: LandingState, sample: SensorSample, reason: str
    ) -> LandingState:
        # Of a series that a new target has cut short nothing is learned
        state = replace(state, track=Growing(), request=None, answer=None, braking=False)
        return self._enter(state, sample, "resting", reason)

    def _transition(self, state: LandingState, sample: SensorSample) -> LandingState:
        """Return the state, in the phase that is due: every transition but those of feedback."""
        phase = state.phase
        name, reason = phase.name, phase.reason
        if name == "series":
            flight = state.flights[-1]
            due = flight.start + state.sent * self.sampling_time
            if abs(sample.time - due) > 0.5 * self.sampling_time:
                state = replace(state, track=Growing())
                name, reason = "resting", "samples were missed"
            elif state.sent == flight.planned.effort.size:
                name, reason = "resting", "the last pulse was sent"
            elif self._off(state, sample):
                state = replace(state, braking=True)
                name, reason = "resting", "mass 1 has left the corridor of the series"
        elif name == "done":
            if self._strayed(state):
                name, reason = "resting", "the arm has left the tolerance"
        elif name == "resting" and state.request is not None:
            return self._awaited(state, sample)
        elif name == "resting" and not self._settled(state, sample.time - phase.start):
            longest = self.longest_wait + LANDING.rest_samples * self.sampling_time
            if sample.time - phase.start >= longest:
                name, reason = "stopped", "mass 1 does not come to rest"
        elif name == "resting":
            return self._judged(state, sample)
        return state if name == phase.name else self._enter(state, sample, name, reason)

    def _strayed(self, state: LandingState) -> bool:
        """Return whether an arm that had landed is no longer within the tolerance."""
        window, bound = state.window, LANDING.strayed_distance * self.tolerance
        off = abs(state.target - 0.5 * (window.low + window.high))
        if window.count > 1 and bool(off > bound + 0.5 * self._band):
            return True
        # The swing is fitted once in a half swing
        samples = max(ceil(self.half_swing / self.sampling_time), LANDING.rest_samples)
        if window.count == 0 or window.count % samples != 0:
            return False
        return bool(self._miss(state, self._swing(state)) > bound)

    def _judged(self, state: LandingState, sample: SensorSample) -> LandingState:
        """Return the state of an arm at rest: landed, stopped, or with a plan asked for."""
        swing = self._swing(state)
        landed = self._miss(state, swing) <= self.tolerance
        spent = self._spent(state)
        if not landed and spent is None:
            begin = sample.time + self.planning_time
            state, _ = self._requested(state, swing, sample.time, begin)
            return self._awaited(state, sample)
        state, request = self._requested(state, swing, sample.time, sample.time)
        # What was learned from the last series is for the next one: there is no hurry
        if self.planning_time == 0.0:
            answer = self.plan(request, series=False)
            state = replace(self._learned_of(state, answer), request=None)
        if landed:
            return self._enter(state, sample, "done", "both masses are within the tolerance")
        return self._enter(state, sample, "stopped", spent or "")

    def _requested(
        self, state: LandingState, swing: Swing, made: float, begin: float
    ) -> tuple[LandingState, PlanRequest]:
        """Return the state with the request of a plan for a later time [s], and the request."""
        request = PlanRequest(
            number=state.request_count + 1,
            state=state,
            swing=swing,
            made=made,
            begin=begin,
            samples=state.window.count,
        )
        made_of = replace(state, request=request, request_count=request.number, answer=None)
        return made_of, request

    def _spent(self, state: LandingState) -> str | None:
        """Return why no further series shall follow; None if one may."""
        if state.series_since_target < self.most_series:
            return None
        return f"{self.most_series} series have not landed it"

    def _awaited(self, state: LandingState, sample: SensorSample) -> LandingState:
        """Return the state while a plan is awaited, or with its series begun."""
        request, answer = state.request, state.answer
        if request is None:
            return state
        if state.window.count < request.samples:  # mass 1 has moved
            return replace(state, request=None, answer=None)
        if sample.time < request.begin - 0.5 * self.sampling_time:
            return state
        if self.plans_inside:
            answer = self.plan(request)
        if answer is None:
            # The plan is not there in time: it is asked for anew, with more time
            taken = max(sample.time - request.made, self.planning_time)
            again = replace(
                request,
                number=request.number + 1,
                swing=self._swing(state),
                made=sample.time,
                begin=sample.time + 2.0 * taken,
                samples=state.window.count,
            )
            return replace(state, request=again, request_count=again.number)
        state = replace(self._learned_of(state, answer), request=None, answer=None)
        if not isinstance(answer.series, PulseSeries):
            return self._enter(state, sample, "stopped", answer.series or "there is no series")
        reason = "a series leads to the target"
        if answer.series.target != state.target:
            reason = "mass 2 swings more than the way left: a series leads beyond, to come back"
        state = self._launched(state, sample, answer.series)
        return self._enter(state, sample, "series", reason)
