"""The supervisor of a landing: feedback first, then what lands the axis, and the log of phases."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from math import isfinite, sqrt
from typing import ClassVar, Generic, TypeVar

import numpy as np
from jaxtyping import Float

from stickslip.control.base import Phase, PositionController
from stickslip.control.checks import check_fields
from stickslip.control.feedback.controller import FeedbackController
from stickslip.control.feedback.friction_compensation import (
    FrictionCompensation,
    OnlineFriction,
    RunningEstimator,
)
from stickslip.control.feedback.linear_parts import PD, Notch
from stickslip.control.feedback.reference import Move, PointToPoint
from stickslip.control.landing.tuning import APPROACH
from stickslip.records import (
    AxisKind,
    InputError,
    LandingPhaseName,
    LearnedPulses,
    PositioningOutcome,
    SensorSample,
    finite,
    non_negative,
    positive,
    quantity_field,
    unit_of,
)

FRICTION = ("coulomb_friction", "viscous_friction", "static_friction")  # order of the estimates
_OUTCOMES = {"done": PositioningOutcome.REACHED, "stopped": PositioningOutcome.STOPPED}
LEAST_FRICTION = 1e-6  # of the effort limit: a law needs some
_PEAK = 5.7735  # peak acceleration of a minimum-jerk move over length/duration^2: 10/sqrt(3)


@dataclass(frozen=True, kw_only=True)
class Window:
    """The last samples, and since when mass 1 has rested."""

    samples: Float[np.ndarray, "n 3"]  # a ring of position, load position and load velocity
    count: int = 0  # samples taken since mass 1 last moved
    low: float = np.inf  # ends of the band that its measured position has stayed in since then
    high: float = -np.inf

    @classmethod
    def of(cls, samples: int) -> "Window":
        """Return an empty window with room for so many samples."""
        return cls(samples=np.zeros((samples, 3)))

    def after(self, sample: SensorSample, spread: float) -> "Window":
        """Return the window with one more sample.

        A position that makes the band wider than ``spread`` [m or rad] begins it anew.
        """
        x = sample.measured_position
        low, high, count = min(self.low, x), max(self.high, x), self.count + 1
        if high - low > spread:
            low, high, count = x, x, 1
        samples = self.samples.copy()
        samples[(count - 1) % len(samples)] = (
            x,
            sample.measured_load_position,
            sample.measured_load_velocity,
        )
        return replace(self, samples=samples, count=count, low=low, high=high)

    def empty(self) -> "Window":
        """Return the window without samples."""
        return replace(self, count=0, low=np.inf, high=-np.inf)

    def seen(self) -> Float[np.ndarray, "k 3"]:
        """Return the samples since mass 1 last moved, the oldest first, as far as they fit."""
        if self.count <= len(self.samples):
            return self.samples[: self.count]
        return np.roll(self.samples, -(self.count % len(self.samples)), axis=0)


@dataclass(frozen=True, kw_only=True)
class SupervisorState:
    """State of a landing controller, of any axis."""

    target: float = quantity_field("position")  #: Where the axis shall rest.
    phases: tuple[Phase, ...] = ()  #: All so far, the last is the present one.
    #: The controller of the feedback phase, whose time begins with that phase; None outside it.
    feedback: FeedbackController | None = None
    #: Its state [as of the controller]; else empty.
    feedback_state: Float[np.ndarray, " f"] = field(default_factory=lambda: np.empty(0))
    #: Of the estimator that runs along [its own units]; in a feedback phase that of its begin.
    estimator_state: Float[np.ndarray, " e"]
    window: Window  #: Where rest is looked for.
    renewed: bool = True  #: Whether feedback to a new target begins with the next sample.

    @property
    def phase(self) -> Phase:
        """The present phase."""
        return self.phases[-1]


S = TypeVar("S", bound=SupervisorState)


@dataclass(frozen=True, kw_only=True)
class Supervisor(PositionController[S], ABC, Generic[S]):
    """Feedback near the target while friction is estimated, then what lands the axis.

    What landings of an arm and of a single mass have in common: the feedback phase, the estimator
    that runs along through all phases, targets, and the log of phases.
    """

    sampling_time: float = quantity_field("sampling_time")  #: That of the loop.
    target: float = quantity_field("position")  #: Where the axis shall rest.
    tolerance: float = quantity_field("position")  #: How far from it at most.
    effort_limit: float = quantity_field("effort")  #: Largest magnitude of effort.
    estimator: RunningEstimator  #: Of Coulomb and viscous friction, that runs along.
    #: Standard deviations of one sample; 0 for none.
    position_noise: float = quantity_field("position", default=0.0)
    #: Standard deviations of one sample; 0 for none.
    velocity_noise: float = quantity_field("velocity", default=0.0)
    pd: PD | None = None  #: Of the feedback phase; None for gains by a rule.
    #: How long the driven mass may take to come to rest; None for a time by a rule.
    wait_limit: float | None = quantity_field("time", default=None)
    _driven: ClassVar[str]  # name of the driven mass

    def __post_init__(self) -> None:
        position, velocity, effort = (
            unit_of(quantity, self.kind) for quantity in ("position", "velocity", "effort")
        )
        check_fields(
            self, positive, {"sampling_time": "s", "tolerance": position, "effort_limit": effort}
        )
        check_fields(self, non_negative, {"position_noise": position, "velocity_noise": velocity})
        check_fields(self, positive, {"wait_limit": "s"})
        self._check_target(self.target)

    @property
    @abstractmethod
    def kind(self) -> AxisKind:
        """``"linear"`` or ``"rotary"``."""

    @property
    def _left(self) -> float:
        """Share of the travel that feedback leaves to the pulses."""
        return 0.0

    @property
    @abstractmethod
    def longest_wait(self) -> float:
        """The wait limit, or that of a rule [s]."""

    @abstractmethod
    def init(self) -> S:
        """Return the state before the first sample."""

    @abstractmethod
    def learned(self, state: S) -> LearnedPulses:
        """Return what was learned, for the first guesses of the next run.

        Raises
        ------
        InputError
            If nothing has been learned yet.
        """

    @abstractmethod
    def approach(
        self, start: float, end: float, estimator_state: Float[np.ndarray, " e"]
    ) -> FeedbackController:
        """Return the feedback from a place to another (of the driven mass) [m or rad].

        The estimator runs along from its state on.
        """

    def _feedback(
        self,
        estimator_state: Float[np.ndarray, " e"],
        *,
        move: Move,
        start: float,
        inertia: float,
        pd: PD,
        notch: Notch | None = None,
    ) -> FeedbackController:
        """Return feedback along a smooth reference, with friction compensated as estimated.

        A state of the estimator that is not finite begins anew.
        """
        if not np.isfinite(estimator_state).all():
            estimator_state = self.estimator.init(sampling_time=self.sampling_time)
        return FeedbackController(
            sampling_time=self.sampling_time,
            pd=pd,
            notch=notch,
            compensation=FrictionCompensation(
                friction=OnlineFriction(
                    kernel=self.estimator.kernel,
                    first_state=estimator_state,
                    sampling_time=self.sampling_time,
                    values_at=self.estimator.values_at,
                    needs_load=notch is not None,
                    covariance=self.estimator.covariance,
                )
            ),
            inertia=inertia,
            effort_limit=self.effort_limit,
            reference=PointToPoint(start=start, moves=(move,)),
        )

    def _light_duration(self, mass: float, travel: float) -> float:
        """Return how long a reference takes whose acceleration needs a share of the effort."""
        return sqrt(_PEAK * abs(travel) * mass / (APPROACH.effort_share * self.effort_limit))

    def _readable(self, sample: SensorSample) -> bool:
        """Return whether a sample has all that is needed."""
        values = sample._asdict()
        return isfinite(sample.time) and all(isfinite(values[name]) for name in self.channels)

    def blind(self, state: S, time: float) -> tuple[S, float]:  # noqa: ARG002 - as of the base class
        """Take a sample at a time [s] of which nothing else is known.

        Outside feedback the effort goes on as planned. The estimator takes a sample without values.
        """
        if state.renewed or state.feedback is not None:
            return state, np.nan
        state, effort = self._planned_effort(state)
        return self._estimated_along(state, effort, (np.nan,) * 4), effort

    @abstractmethod
    def _planned_effort(self, state: S) -> tuple[S, float]:
        """Return the state and the effort outside feedback where a sample is lost."""

    def _estimated_along(self, state: S, effort: float, channels: tuple[float, ...]) -> S:
        """Return the state after the estimator has taken a sample and the effort held from it."""
        learned = state.estimator_state.copy()
        self.estimator.kernel(learned, effort, *channels)
        return replace(state, estimator_state=learned)

    @abstractmethod
    def _after_approach(self, state: S, sample: SensorSample, reason: str) -> S:
        """Return the state in the phase that follows feedback."""

    @abstractmethod
    def _landing(self, state: S, sample: SensorSample) -> tuple[S, float]:
        """Return the state and the effort outside feedback, in the next phase where it is due."""

    @property
    @abstractmethod
    def _band(self) -> float:
        """Width of the band in which a resting mass is seen [m or rad]."""

    def step(self, state: S, sample: SensorSample) -> tuple[S, float]:
        """Take a sample; return the state after it and the effort until the next [N or N m].

        A sample that lacks a channel gives the effort NaN and changes nothing.
        """
        if not self._readable(sample):
            return state, np.nan
        if state.renewed:
            state = self._towards(state, sample)
        state = replace(state, window=state.window.after(sample, self._band))
        if state.feedback is not None:
            state = self._after_feedback(state, state.feedback, sample)
        if state.feedback is not None:
            since = sample._replace(time=sample.time - state.phase.start)
            memory, effort = state.feedback.step(state.feedback_state, since)
            return replace(state, feedback_state=memory), float(effort)
        state, effort = self._landing(state, sample)
        channels = tuple(value if isfinite(value) else 0.0 for value in sample[1:])
        return self._estimated_along(state, effort, channels), effort

    def _towards(self, state: S, sample: SensorSample) -> S:
        """Return the state at the begin of a feedback phase."""
        start = sample.measured_position
        end = state.target - self._left * (state.target - start)
        controller = self.approach(start, end, state.estimator_state)
        state = replace(state, feedback=controller, feedback_state=controller.init(), renewed=False)
        return self._enter(state, sample, "feedback", "the target is new")

    def _after_feedback(self, state: S, controller: FeedbackController, sample: SensorSample) -> S:
        """Return the state, in the next phase if the feedback has done what it can."""
        (move,) = controller.reference.moves
        since = sample.time - state.phase.start - move.duration
        rested = state.window.count >= APPROACH.settled_samples
        if since < 0.0 or not (rested or since >= self.longest_wait):
            return state
        state = self._without_feedback(state)
        came = "rests" if rested else "did not come to rest, so its effort is taken"
        reason = f"{self._driven} {came}"
        return self._after_approach(state, sample, reason)

    def _without_feedback(self, state: S) -> S:
        """Return the state after feedback, with the estimates that it ended with."""
        estimates = self._estimator_state(state)
        return replace(state, estimator_state=estimates, feedback=None, feedback_state=np.empty(0))

    def _enter(self, state: S, sample: SensorSample, name: LandingPhaseName, reason: str) -> S:
        """Return the state at the begin of a phase; rest is looked for anew."""
        phase = Phase(name=name, start=sample.time, reason=reason)
        return replace(state, phases=(*state.phases, phase), window=state.window.empty())

    def retargeted(self, state: S, target: float) -> S:
        """Return the state with another target [m or rad]; feedback begins with the next sample.

        Raises
        ------
        InputError
            If it is not finite.
        """
        self._check_target(target)
        return replace(self._without_feedback(state), target=float(target), renewed=True)

    def outcome(self, state: S) -> PositioningOutcome:
        """Return how far the landing has come."""
        if state.renewed:
            return PositioningOutcome.MOVING
        return _OUTCOMES.get(state.phase.name, PositioningOutcome.MOVING)

    def why(self, state: S) -> str | None:
        """Return why it has stopped short of the target; None if it has not."""
        stopped = self.outcome(state) is PositioningOutcome.STOPPED
        return state.phase.reason if stopped else None

    def phases(self, state: S) -> tuple[Phase, ...]:
        """Return the phases so far, the last is the present one."""
        return state.phases

    def deviations(self, state: S) -> dict[str, float]:
        """Return standard deviations of the estimated friction [SI]; infinite while unknown."""
        return dict(zip(FRICTION, np.sqrt(np.diag(self._covariance(state))).tolist(), strict=False))

    def _estimated(self, state: S) -> tuple[float, float]:
        """Return Coulomb and viscous friction as the estimator has them."""
        coulomb, viscous = self._estimator_state(state)[self.estimator.values_at].tolist()
        return coulomb, viscous

    def _estimator_state(self, state: S) -> Float[np.ndarray, " e"]:
        if state.feedback is None:
            return state.estimator_state
        return state.feedback.estimator_state(state.feedback_state)

    def _covariance(self, state: S) -> Float[np.ndarray, "2 2"]:
        """Return the covariance of Coulomb and viscous friction, in this order."""
        memory = self._estimator_state(state)
        places = list(range(*self.estimator.values_at.indices(memory.size)))
        order = [place - min(places) for place in places]
        return self.estimator.covariance(memory)[np.ix_(order, order)]

    def _known_covariance(self, state: S) -> Float[np.ndarray, "2 2"]:
        """Return the covariance, if anything is known."""
        P = self._covariance(state)
        if not np.isfinite(P).all():
            raise InputError("nothing_learned")
        return P

    def _check_effort(self, held: float) -> None:
        """Check that the effort limit is above what frees the axis."""
        if not self.effort_limit > held:
            unit = unit_of("effort", self.kind)
            raise InputError(
                "effort_below_breakaway",
                name="effort_limit",
                value=self.effort_limit,
                limit_name="breakaway of the driven mass",
                limit=held,
                unit=unit,
            )

    def _check_target(self, target: float) -> None:
        finite("target", target, unit_of("position", self.kind))
