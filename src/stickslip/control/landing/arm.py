"""The conjunction of the report: feedback moves an arm near its target, pulses land it at rest."""

from dataclasses import dataclass, replace
from math import ceil, inf, isfinite, pi, sqrt
from statistics import NormalDist

import numpy as np
from jaxtyping import Float

from stickslip.control.feedback import FeedbackController
from stickslip.control.landing.approach import arm_approach, scaled_notch, scaled_pd
from stickslip.control.landing.belief import LEARNT, ArmBelief, FlightLog, check_learnt
from stickslip.control.landing.series import next_series
from stickslip.control.landing.state import Flight, LandingState, Window
from stickslip.control.landing.supervisor import FRICTION, Supervisor
from stickslip.control.landing.swing import Swing
from stickslip.control.notch import Notch
from stickslip.plants import FlexibleArm
from stickslip.records import (
    AxisKind,
    InputError,
    LearntPulses,
    SensorSample,
    non_negative,
)

__all__ = ["LandingController"]

_MISSED = 1e-3  # of the windows of an axis at rest are not seen as such
_LATE = 80  # samples at rest before a plan: an estimator that smooths has seen all by then
_REST = 0.4  # half swings at rest before a plan: a sine is known by then
_LEFT = 0.2  # of the way is left to the series: more than mass 2 usually swings
_KEPT = 2.0  # half swings kept in the window
_PATIENCE = 40.0  # half swings
_STATIC = 1.3  # static over Coulomb friction, where nothing is known
_STATIC_STEP = 1.25  # by which it is raised when a series has not freed mass 1
_LEAST_FRICTION = 1e-6  # of the effort limit: a law needs some


@dataclass(frozen=True, kw_only=True)
class LandingController(Supervisor[LandingState]):
    """Land a flexible arm: both masses at rest on the target, with friction learnt on the way.

    The supervisor of the report's concluding remarks. Its phases, and what ends each:

    feedback
        PD, notch and compensation of friction by the running estimate, along a smooth reference to
        short of the target. Ends when mass 1 rests after the reference, or when patience is out.
    resting
        No effort. Ends when mass 1 has rested for half a swing of mass 2, or for long enough to see
        that the spring will not move it. The swing is then fitted: both within the tolerance, it is
        *done*; otherwise a *series* is planned. It is *stopped* when there is none, after
        ``most_series``, or when mass 1 does not come to rest.
    series
        Pulses planned from the estimates. Ends with the last pulse: resting again.
    done, stopped
        No effort. A new target begins with feedback.

    A series moves mass 1 one way only, and takes up a swing of mass 2 that is smaller than its way;
    so feedback leaves some of the way to it. A larger swing is taken up on the way to a place
    beyond, from where a second series comes back. The estimator runs along through all phases, so
    that what a series did corrects what the next is planned with, and what was known before stays.
    The number of series is bounded: it cannot limit-cycle.

    It steps in the interpreter, as it solves a linear programme when a series is due.

    Attributes
    ----------
    sampling_time, target, effort_limit, estimator, position_noise, velocity_noise, pd
        As of `Supervisor`; gains by rule are those of the report's surrogate arm, scaled.
    tolerance
        How far from the target at most, each of mass 1 and the swing of mass 2 about mass 1.
    arm
        Masses and spring as they are believed to be; of its friction the offset and the ratio of
        static to Coulomb friction are used.
    arm_uncertainty
        Standard deviation of masses and spring, over their values [-]. Above 0 they and the
        friction are learned from the motion along each series.
    experience
        What an earlier run has learned of masses, spring and friction (`resumed`), that it goes on
        from; or None.
    notch
        Of the feedback phase; None scales that of the surrogate arm.
    most_series
        After so many it stops.
    patience
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
    experience: LearntPulses | None = None
    notch: Notch | None = None
    most_series: int = 6

    def __post_init__(self) -> None:
        super().__post_init__()
        uncertainty = non_negative("arm_uncertainty", self.arm_uncertainty, "(no unit)")
        object.__setattr__(self, "arm_uncertainty", uncertainty)
        if self.most_series < 1:
            raise InputError(
                f"most_series is {self.most_series}, it must be at least 1",
                remedy="allow some; 2 land an arm whose friction is known",
            )
        self._check_effort(max(self.arm.friction.breakaway()) + abs(self.arm.friction.offset))
        if self.experience is not None:
            check_learnt(self.experience, self.kind)

    @property
    def _learns(self) -> bool:
        """Whether masses and spring are learned."""
        return self.arm_uncertainty > 0.0 or self.experience is not None

    def resumed(self, learnt: LearntPulses) -> "LandingController":
        """Return the same controller, beginning with what an earlier run has learned of the arm.

        The estimator stays as it is, so that one of the learned masses and spring has to be given.

        Parameters
        ----------
        learnt
            From `learnt` of a controller with an ``arm_uncertainty``, or read from a file.

        Raises
        ------
        InputError
            If it was learned by another method, on another kind of axis, or cannot be.
        """
        check_learnt(learnt, self.kind)
        known = ArmBelief.resumed(self.arm, learnt)
        return replace(self, arm=known.arm, experience=learnt)

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
        """The patience, or 20 swings of mass 2 [s]."""
        return _PATIENCE * self.half_swing if self.patience is None else self.patience

    def init(self) -> LandingState:
        """Return the state before the first sample."""
        law, learnt = self.arm.friction, self.experience
        known = law.coulomb_friction_positive + law.coulomb_friction_negative
        static = law.static_friction_positive + law.static_friction_negative
        return LandingState(
            target=self.target,
            feedback_state=np.empty(0),
            estimator_state=self.estimator.init(sampling_time=self.sampling_time),
            window=Window.of(self._window),
            static_ratio=max(static / known, _STATIC) if known > 0.0 else _STATIC,
            belief=None if learnt is None else ArmBelief.resumed(self.arm, learnt),
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

    @property
    def _driven(self) -> str:
        return "mass 1"

    @property
    def _left(self) -> float:
        return _LEFT

    def _after_approach(
        self, state: LandingState, sample: SensorSample, reason: str
    ) -> LandingState:
        return self._enter(state, sample, "resting", reason)

    def _landing(self, state: LandingState, sample: SensorSample) -> tuple[LandingState, float]:
        state = self._decided(state, sample)
        if state.phase.name != "series":
            return state, 0.0
        planned = state.flights[-1].planned
        effort = float(planned.effort[state.sent])
        state = replace(state, sent=state.sent + 1)
        if state.sent == planned.effort.size:
            state = self._enter(state, sample, "resting", "the last pulse was sent")
        return state, effort

    def _decided(self, state: LandingState, sample: SensorSample) -> LandingState:
        """Return the state, in the next phase if mass 1 has rested long enough to judge."""
        if state.flights and len(state.track) <= state.flights[-1].planned.effort.size:
            state = replace(state, track=(*state.track, sample))
        if state.phase.name != "resting":
            return state
        if not self._settled(state):
            since = sample.time - state.phase.start
            if since >= self.longest_wait + _LATE * self.sampling_time:
                return self._enter(state, sample, "stopped", "mass 1 does not come to rest")
            return state
        swing = self._swing(state)
        state = self._judged(state, swing)
        error = state.target - swing.position
        if max(abs(error), swing.amplitude) <= self.tolerance:
            return self._enter(state, sample, "done", "both masses are within the tolerance")
        if self._series_since_target(state) >= self.most_series:
            return self._enter(
                state, sample, "stopped", f"{self.most_series} series have not landed it"
            )
        return self._launched(state, sample, swing)

    def _launched(self, state: LandingState, sample: SensorSample, swing: Swing) -> LandingState:
        """Return the state at the begin of a series, or stopped if there is none."""
        coulomb, viscous = self._friction(state)
        arm = self.arm if state.belief is None else state.belief.arm
        series = next_series(
            arm,
            swing,
            state.target,
            coulomb_friction=coulomb,
            viscous_friction=viscous,
            static_friction=coulomb * state.static_ratio,
            sampling_time=self.sampling_time,
            effort_limit=self.effort_limit,
        )
        if isinstance(series, str):
            return self._enter(state, sample, "stopped", series)
        flight = Flight(
            start=sample.time,
            planned=series,
            coulomb_friction=coulomb,
            viscous_friction=viscous,
        )
        state = replace(state, flights=(*state.flights, flight), sent=0, track=(sample,))
        reason = "a series leads to the target"
        if series.target != state.target:
            reason = "mass 2 swings more than the way left: a series leads beyond, to come back"
        return self._enter(state, sample, "series", reason)

    def _settled(self, state: LandingState) -> bool:
        """Return whether mass 1 has rested long enough for the swing to be known."""
        return state.window.count >= max(ceil(_REST * self.half_swing / self.sampling_time), _LATE)

    def _swing(self, state: LandingState) -> Swing:
        return Swing.seen(
            state.window.seen(),
            arm=self.arm if state.belief is None else state.belief.arm,
            sampling_time=self.sampling_time,
            position_noise=self.position_noise,
            velocity_noise=self.velocity_noise,
        )

    def _judged(self, state: LandingState, swing: Swing) -> LandingState:
        """Note how the last series ended, and learn from it."""
        if not state.flights or state.flights[-1].final_position is not None:
            return state
        last = state.flights[-1]
        ended = replace(last, final_position=swing.position, final_swing=swing.amplitude)
        state = replace(state, flights=(*state.flights[:-1], ended))
        if abs(swing.position - last.planned.position[0]) <= self._band:
            return replace(state, static_ratio=_STATIC_STEP * state.static_ratio)
        if not self._learns:
            return state
        flight = FlightLog.of(
            last.planned,
            state.track,
            sampling_time=self.sampling_time,
            position_noise=self.position_noise,
            velocity_noise=self.velocity_noise,
        )
        return replace(state, belief=self._belief(state).after(flight))

    def _belief(self, state: LandingState) -> ArmBelief:
        """Return what is believed of the arm, before the first series by the estimator."""
        if state.belief is not None:
            return state.belief
        coulomb, viscous = self._friction(state)
        return ArmBelief.first(
            self.arm,
            uncertainty=self.arm_uncertainty,
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
        return max(coulomb, _LEAST_FRICTION * self.effort_limit), max(viscous, 0.0)

    def _series_since_target(self, state: LandingState) -> int:
        """Return how many series have been fired since the last feedback phase."""
        names = [phase.name for phase in state.phases]
        since = len(names) - 1 - names[::-1].index("feedback")
        return names[since:].count("series")

    @property
    def _band(self) -> float:
        farthest = NormalDist().inv_cdf(1.0 - _MISSED / (2.0 * self._window))
        return 2.0 * farthest * self.position_noise

    @property
    def _window(self) -> int:
        """Samples in which rest is looked for."""
        return max(ceil(_KEPT * self.half_swing / self.sampling_time), _LATE) + 1

    def estimates(self, state: LandingState) -> dict[str, float]:
        """Return friction as estimated, with masses and spring if they are learned [SI].

        The static friction is only what has been enough to free mass 1.

        Parameters
        ----------
        state
            From `init` or a step.
        """
        coulomb, viscous = self._friction(state)
        static = coulomb * state.static_ratio
        found: dict[str, float] = dict(zip(FRICTION, (coulomb, viscous, static), strict=True))
        if self._learns:
            body = self._belief(state).values
            found |= {name: body[name] for name in LEARNT[:3]}
        return found

    def deviations(self, state: LandingState) -> dict[str, float]:
        """Return standard deviations of the estimates, but for static friction [SI].

        Parameters
        ----------
        state
            From `init` or a step.
        """
        found = super().deviations(state)
        if not self._learns:
            return found
        own = self._belief(state).deviations
        if state.belief is None:
            own |= {name: inf for name, spread in found.items() if not isfinite(spread)}
        return {name: own[name] for name in (*found, *LEARNT[:3])}

    def learnt(self, state: LandingState) -> LearntPulses:
        """Return what was learned, as of the base class.

        The covariance is that of the estimator, or, where masses and spring are learned, of the
        logarithms of masses, spring, Coulomb and viscous friction.

        Parameters
        ----------
        state
            As of the base class.

        Raises
        ------
        InputError
            As of the base class.
        """
        covariance = self._known_covariance(state) if state.belief is None else np.empty(0)
        return LearntPulses(
            method="landing",
            kind=self.kind,
            values=self.estimates(state),
            covariance=self._belief(state).covariance if self._learns else covariance,
        )
