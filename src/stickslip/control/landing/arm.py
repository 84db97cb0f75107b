"""Landing of a flexible arm: feedback moves it near its target, pulse series land it at rest."""

from dataclasses import dataclass, replace
from math import ceil, isfinite
from statistics import NormalDist
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from stickslip.control.feedback.controller import FeedbackController
from stickslip.control.feedback.linear_parts import Notch
from stickslip.control.landing.approach import arm_approach, scaled_notch, scaled_pd
from stickslip.control.landing.arm_learning import ArmLearning
from stickslip.control.landing.belief import ArmBelief, check_learned
from stickslip.control.landing.series import next_series
from stickslip.control.landing.state import Flight, LandingState, Window
from stickslip.control.landing.swing import Swing
from stickslip.planning import PulseSeries
from stickslip.records import InputError, LearnedPulses, SensorSample

__all__ = ["LandingController"]

_MISSED = 1e-3  # of the windows of an axis at rest are not seen as such
_LATE = 80  # samples at rest before a plan: an estimator that smooths has seen all by then
_REST = 0.4  # half swings at rest before a plan: a sine is known by then
_FINE = 0.01  # of the way left: a wider band of noise hides motion that matters
_GIVES, _BRIEF = 6.0, 8  # half swings in which mass 1 may give way; samples that must do then
_KEPT = 2.0  # half swings kept in the window
_WAIT_RULE = 40.0  # half swings
_STATIC = 1.3  # static over Coulomb friction, where nothing is known


@dataclass(frozen=True, kw_only=True)
class LandingController(ArmLearning):
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
        Masses and spring as they are believed to be; of its friction the offset and the ratio of
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

    notch: Notch | None = None
    most_series: int = 6
    _driven: ClassVar[str] = "mass 1"
    _left: ClassVar[float] = 0.2  # more than mass 2 usually swings

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.most_series < 1:
            raise InputError(
                f"most_series is {self.most_series}, it must be at least 1",
                remedy="allow some; 2 land an arm whose friction is known",
            )

    def resumed(self, learned: LearnedPulses) -> "LandingController":
        """Return the same controller, beginning with what an earlier run has learned of the arm.

        The estimator stays as it is, so that one of the learned masses and spring has to be given.

        Parameters
        ----------
        learned
            From `learned` of a controller with an ``arm_uncertainty``, or read from a file.

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
        self, start: float, aim: float, estimator_state: Float[np.ndarray, " e"]
    ) -> FeedbackController:
        """Return PD, notch and compensation from a place to another, as of the base class.

        Parameters
        ----------
        start, aim, estimator_state
            As of the base class.
        """
        return arm_approach(
            self.arm,
            sampling_time=self.sampling_time,
            effort_limit=self.effort_limit,
            start=start,
            target=aim,
            pd=scaled_pd(self.arm) if self.pd is None else self.pd,
            notch=scaled_notch(self.arm) if self.notch is None else self.notch,
            estimator=self.estimator,
            estimator_state=estimator_state,
        )

    def _landing(self, state: LandingState, sample: SensorSample) -> tuple[LandingState, float]:
        if state.track and len(state.track) <= state.flights[-1].planned.effort.size:
            state = replace(state, track=(*state.track, sample))
        state = self._decided(state, sample)
        if state.phase.name != "series":
            return state, 0.0
        effort = float(state.flights[-1].planned.effort[state.sent])
        return replace(state, sent=state.sent + 1), effort

    def _after_approach(
        self, state: LandingState, sample: SensorSample, reason: str
    ) -> LandingState:
        # Of a series that a new target has cut short nothing is learned
        return self._enter(replace(state, track=()), sample, "resting", reason)

    def _decided(self, state: LandingState, sample: SensorSample) -> LandingState:
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
            state = self._judged(state, swing)
            if self._off(state, swing) <= self.tolerance:
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
        """Return the series from here, or why there is none."""
        coulomb, viscous = self._friction(state)
        return next_series(
            self._believed(state),
            swing,
            state.target,
            coulomb_friction=coulomb,
            viscous_friction=viscous,
            static_friction=coulomb * state.static_ratio,
            sampling_time=self.sampling_time,
            effort_limit=self.effort_limit,
        )

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
            arm=self._believed(state),
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
