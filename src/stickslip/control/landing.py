"""The conjunction of the report: feedback moves an arm near its target, pulses land it at rest."""

from dataclasses import dataclass, replace
from math import ceil, isfinite, pi, sqrt
from statistics import NormalDist

import numpy as np
from jaxtyping import Float

from stickslip.control.feedback import FeedbackController
from stickslip.control.landing_approach import approach, scaled_notch, scaled_pd
from stickslip.control.landing_plan import next_series
from stickslip.control.landing_state import Flight, LandingState, Phase, PhaseName, Window
from stickslip.control.notch import Notch
from stickslip.control.online_friction import RunningEstimator
from stickslip.control.pd import PD
from stickslip.control.swing import Swing
from stickslip.plants import FlexibleArm
from stickslip.records import (
    AxisKind,
    InputError,
    LearntPulses,
    PositioningOutcome,
    SensorSample,
    non_negative,
    positive,
    quantity_field,
    unit_of,
)

__all__ = ["LandingController"]

_NAMES = ("coulomb_friction", "viscous_friction", "static_friction")
_OUTCOMES = {"done": PositioningOutcome.REACHED, "stopped": PositioningOutcome.STOPPED}

_MISSED = 1e-3  # of the windows of an axis at rest are not seen as such
_LATE = 80  # samples at rest before a plan: an estimator that smooths has seen all by then
_KEPT = 2.0  # half swings kept in the window
_PATIENCE = 40.0  # half swings
_STATIC = 1.3  # static over Coulomb friction, where nothing is known
_STATIC_STEP = 1.25  # by which it is raised when a series has not freed mass 1
_LEAST_FRICTION = 1e-6  # of the effort limit: a law needs some


@dataclass(frozen=True, kw_only=True)
class LandingController:
    """Land a flexible arm: both masses at rest on the target, with friction learnt on the way.

    The supervisor of the report's concluding remarks. Its phases, and what ends each:

    feedback
        PD, notch and compensation of friction by the running estimate, along a smooth reference to
        the target. Ends when mass 1 has rested for half a swing of mass 2 after the reference, or
        when patience is out.
    resting
        No effort. Ends when mass 1 has rested for half a swing of mass 2, which is then fitted:
        both within the tolerance, it is *done*; otherwise a *series* is planned. It is *stopped*
        when there is none, after ``most_series``, or when mass 1 does not come to rest.
    series
        Pulses planned from the estimates. Ends with the last pulse: resting again.
    done, stopped
        No effort. A new target begins with feedback.

    A series moves mass 1 one way only, and takes up a swing of mass 2 that is smaller than its way.
    A larger one is taken up on the way to a place beyond, from where a second series comes back.
    The estimator runs along through all phases, so that what a series did corrects what the next is
    planned with, and what was known before stays. The number of series is bounded: it cannot
    limit-cycle.

    It steps in the interpreter, as it solves a linear programme when a series is due.

    Attributes
    ----------
    sampling_time
        That of the loop.
    target
        Where both masses shall rest.
    tolerance
        How far from it at most, each of mass 1 and the swing of mass 2 about mass 1.
    arm
        Masses and spring as they are believed to be; of its friction the offset and the ratio of
        static to Coulomb friction are used.
    effort_limit
        Largest magnitude of effort.
    estimator
        Of Coulomb and viscous friction, that runs along.
    position_noise, velocity_noise
        Standard deviations of one sample of either mass; 0 for none.
    pd, notch
        Of the feedback phase; None scales those of the report's surrogate arm.
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

    sampling_time: float = quantity_field("sampling_time")
    target: float = quantity_field("position")
    tolerance: float = quantity_field("position")
    arm: FlexibleArm
    effort_limit: float = quantity_field("effort")
    estimator: RunningEstimator
    position_noise: float = quantity_field("position", default=0.0)
    velocity_noise: float = quantity_field("velocity", default=0.0)
    pd: PD | None = None
    notch: Notch | None = None
    most_series: int = 6
    patience: float | None = quantity_field("time", default=None)

    def __post_init__(self) -> None:
        for name, check in (
            ("sampling_time", positive),
            ("tolerance", positive),
            ("effort_limit", positive),
            ("position_noise", non_negative),
            ("velocity_noise", non_negative),
        ):
            unit = self.__dataclass_fields__[name].metadata["quantity"].unit(self.kind)
            object.__setattr__(self, name, check(name, getattr(self, name), unit))
        if self.patience is not None:
            object.__setattr__(self, "patience", positive("patience", self.patience, "s"))
        self._check_target(self.target)
        if self.most_series < 1:
            raise InputError(
                f"most_series is {self.most_series}, it must be at least 1",
                remedy="allow some; 2 land an arm whose friction is known",
            )
        held = max(self.arm.friction.breakaway()) + abs(self.arm.friction.offset)
        if not self.effort_limit > held:
            unit = unit_of("effort", self.kind)
            raise InputError(
                f"effort_limit is {self.effort_limit:g} {unit}, not above what frees the driven "
                f"mass, {held:g} {unit}",
                remedy="allow more effort",
            )

    @property
    def kind(self) -> AxisKind:
        """``"linear"`` or ``"rotary"``, as the arm."""
        return self.arm.kind

    @property
    def half_swing(self) -> float:
        """Half a period of mass 2 while mass 1 rests [s]."""
        return pi * sqrt(self.arm.mass_2 / self.arm.stiffness)

    def init(self) -> LandingState:
        """Return the state before the first sample."""
        law, samples = self.arm.friction, ceil(self.half_swing / self.sampling_time)
        known = law.coulomb_friction_positive + law.coulomb_friction_negative
        static = law.static_friction_positive + law.static_friction_negative
        return LandingState(
            target=self.target,
            feedback_state=np.empty(0),
            estimator_state=self.estimator.init(sampling_time=self.sampling_time),
            window=Window(samples=np.zeros((max(ceil(_KEPT * samples), _LATE) + 1, 3))),
            static_ratio=max(static / known, _STATIC) if known > 0.0 else _STATIC,
        )

    def step(self, state: LandingState, sample: SensorSample) -> tuple[LandingState, float]:
        """Take a sample; return the state after it and the effort until the next.

        A sample that lacks a channel gives the effort NaN and changes nothing.

        Parameters
        ----------
        state
            From `init`, `retargeted` or a step.
        sample
            What the sensors show.
        """
        if not all(isfinite(value) for value in sample):
            return state, np.nan
        if state.renewed:
            state = self._towards(state, sample)
        state = replace(state, window=state.window.after(sample, self._spread(state)))
        if state.feedback is not None:
            state = self._after_feedback(state, state.feedback, sample)
        elif state.phase.name == "resting":
            state = self._after_rest(state, sample)
        return self._act(state, sample)

    def _act(self, state: LandingState, sample: SensorSample) -> tuple[LandingState, float]:
        """Return the effort of the present phase; let the estimator see it."""
        if state.feedback is not None:
            since = sample._replace(time=sample.time - state.phase.start)
            memory, effort = state.feedback.step(state.feedback_state, since)
            return replace(state, feedback_state=memory), float(effort)
        effort = 0.0
        if state.phase.name == "series":
            planned = state.flights[-1].planned
            effort = float(planned.effort[state.sent])
            state = replace(state, sent=state.sent + 1)
            if state.sent == planned.effort.size:
                state = self._enter(state, sample, "resting", "the last pulse was sent")
        learned = state.estimator_state.copy()
        self.estimator.kernel(
            learned,
            effort,
            sample.measured_position,
            sample.measured_velocity,
            sample.measured_load_position,
            sample.measured_load_velocity,
        )
        return replace(state, estimator_state=learned), effort

    def _after_feedback(
        self, state: LandingState, controller: FeedbackController, sample: SensorSample
    ) -> LandingState:
        """Return the state, in the resting phase if the feedback has done what it can."""
        (move,) = controller.reference.moves
        since = sample.time - state.phase.start - move.duration
        rested = state.window.count * self.sampling_time >= self.half_swing
        if since < 0.0 or not (rested or since >= self._patience):
            return state
        learned = controller.estimator_state(state.feedback_state)
        state = replace(state, estimator_state=learned, feedback=None, feedback_state=np.empty(0))
        reason = "mass 1 rests" if rested else "mass 1 did not come to rest, so its effort is taken"
        return self._enter(state, sample, "resting", reason)

    def _after_rest(self, state: LandingState, sample: SensorSample) -> LandingState:
        """Return the state, in the next phase if mass 1 has rested long enough to judge."""
        T = self.sampling_time
        if state.window.count < max(ceil(self.half_swing / T), _LATE):
            if sample.time - state.phase.start >= self._patience + _LATE * T:
                return self._enter(state, sample, "stopped", "mass 1 does not come to rest")
            return state
        swing = Swing.seen(
            state.window.seen(),
            arm=self.arm,
            sampling_time=T,
            position_noise=self.position_noise,
            velocity_noise=self.velocity_noise,
        )
        state = self._judged(state, swing)
        error = state.target - swing.position
        if max(abs(error), swing.amplitude) <= self.tolerance:
            return self._enter(state, sample, "done", "both masses are within the tolerance")
        if self._series_since_target(state) >= self.most_series:
            return self._enter(
                state, sample, "stopped", f"{self.most_series} series have not landed it"
            )
        coulomb, viscous = self._friction(state)
        series = next_series(
            self.arm,
            swing,
            state.target,
            coulomb_friction=coulomb,
            viscous_friction=viscous,
            static_friction=coulomb * state.static_ratio,
            sampling_time=T,
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
        state = replace(state, flights=(*state.flights, flight), sent=0)
        reason = "a series leads to the target"
        if series.target != state.target:
            reason = "mass 2 swings more than the way left: a series leads beyond, to come back"
        return self._enter(state, sample, "series", reason)

    def _judged(self, state: LandingState, swing: Swing) -> LandingState:
        """Note how the last series ended; believe in more static friction if it moved nothing."""
        if not state.flights or state.flights[-1].final_position is not None:
            return state
        last = state.flights[-1]
        ended = replace(last, final_position=swing.position, final_swing=swing.amplitude)
        state = replace(state, flights=(*state.flights[:-1], ended))
        if abs(swing.position - last.planned.position[0]) > self._spread(state):
            return state
        return replace(state, static_ratio=_STATIC_STEP * state.static_ratio)

    def _friction(self, state: LandingState) -> tuple[float, float]:
        """Return Coulomb and viscous friction as estimated, as far as a law can hold them."""
        values = self._estimator_state(state)[self.estimator.values_at]
        least = _LEAST_FRICTION * self.effort_limit
        return max(float(values[0]), least), max(float(values[1]), 0.0)

    def _estimator_state(self, state: LandingState) -> Float[np.ndarray, " e"]:
        if state.feedback is None:
            return state.estimator_state
        return state.feedback.estimator_state(state.feedback_state)

    def _series_since_target(self, state: LandingState) -> int:
        """Return how many series have been fired since the last feedback phase."""
        names = [phase.name for phase in state.phases]
        since = len(names) - 1 - names[::-1].index("feedback")
        return names[since:].count("series")

    @property
    def _patience(self) -> float:
        return _PATIENCE * self.half_swing if self.patience is None else self.patience

    def _spread(self, state: LandingState) -> float:
        """Return the width of the band in which a resting mass 1 is seen."""
        count = len(state.window.samples)
        farthest = NormalDist().inv_cdf(1.0 - _MISSED / (2.0 * count))
        return 2.0 * farthest * self.position_noise

    def _towards(self, state: LandingState, sample: SensorSample) -> LandingState:
        """Return the state at the begin of a feedback phase."""
        controller = approach(
            self.arm,
            sampling_time=self.sampling_time,
            effort_limit=self.effort_limit,
            start=sample.measured_position,
            target=state.target,
            pd=scaled_pd(self.arm) if self.pd is None else self.pd,
            notch=scaled_notch(self.arm) if self.notch is None else self.notch,
            estimator=self.estimator,
            estimator_state=state.estimator_state,
        )
        state = replace(state, feedback=controller, feedback_state=controller.init(), renewed=False)
        return self._enter(state, sample, "feedback", "the target is new")

    def _enter(
        self, state: LandingState, sample: SensorSample, name: PhaseName, reason: str
    ) -> LandingState:
        """Return the state at the begin of a phase; rest is looked for anew."""
        phase = Phase(name=name, start=sample.time, reason=reason)
        return replace(state, phases=(*state.phases, phase), window=state.window.empty())

    def retargeted(self, state: LandingState, target: float) -> LandingState:
        """Return the state with another target; feedback begins with the next sample.

        Parameters
        ----------
        state
            From `init` or a step.
        target
            Where both masses shall rest now [m or rad].

        Raises
        ------
        InputError
            If it is not finite.
        """
        self._check_target(target)
        learned = self._estimator_state(state)
        return replace(
            state,
            target=float(target),
            estimator_state=learned,
            feedback=None,
            feedback_state=np.empty(0),
            renewed=True,
        )

    def outcome(self, state: LandingState) -> PositioningOutcome:
        """Return how far the landing has come.

        Parameters
        ----------
        state
            From `init` or a step.
        """
        if state.renewed:
            return PositioningOutcome.MOVING
        return _OUTCOMES.get(state.phase.name, PositioningOutcome.MOVING)

    def why(self, state: LandingState) -> str | None:
        """Return why it has stopped short of the target; None if it has not.

        Parameters
        ----------
        state
            From `init` or a step.
        """
        stopped = self.outcome(state) is PositioningOutcome.STOPPED
        return state.phase.reason if stopped else None

    def estimates(self, state: LandingState) -> dict[str, float]:
        """Return the friction as estimated [N or N m, N s/m or N m s/rad, N or N m].

        The static friction is only what has been enough to free mass 1.

        Parameters
        ----------
        state
            From `init` or a step.
        """
        coulomb, viscous = self._friction(state)
        static = coulomb * state.static_ratio
        return dict(zip(_NAMES, (coulomb, viscous, static), strict=True))

    def deviations(self, state: LandingState) -> dict[str, float]:
        """Return standard deviations of Coulomb and viscous friction; infinite while unknown.

        Parameters
        ----------
        state
            From `init` or a step.
        """
        return dict(zip(_NAMES, np.sqrt(np.diag(self._covariance(state))).tolist(), strict=False))

    def learnt(self, state: LandingState) -> LearntPulses:
        """Return what was learned, for the first guesses of the next run's estimator.

        Parameters
        ----------
        state
            From `init` or a step.

        Raises
        ------
        InputError
            If nothing has been learned yet.
        """
        P = self._covariance(state)
        if not np.isfinite(P).all():
            raise InputError(
                "nothing has been learned yet, as mass 1 has not moved", remedy="let it move first"
            )
        return LearntPulses(
            method="landing", kind=self.kind, values=self.estimates(state), covariance=P
        )

    def _covariance(self, state: LandingState) -> Float[np.ndarray, "2 2"]:
        """Return the covariance of Coulomb and viscous friction, in this order."""
        memory = self._estimator_state(state)
        places = list(range(*self.estimator.values_at.indices(memory.size)))
        order = [place - min(places) for place in places]
        return self.estimator.covariance(memory)[np.ix_(order, order)]

    def _check_target(self, target: float) -> None:
        if not isfinite(target):
            raise InputError(
                f"target is {target} {unit_of('position', self.kind)}, it must be finite",
                remedy="give where both masses are to rest",
            )
