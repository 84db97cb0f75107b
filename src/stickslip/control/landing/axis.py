"""The landing of a single mass: feedback near the target, then pulses by the exact law."""

from dataclasses import dataclass, field, replace
from math import sqrt
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from stickslip.control.feedback.controller import FeedbackController
from stickslip.control.feedback.linear_parts import PD
from stickslip.control.feedback.reference import Move
from stickslip.control.landing.supervisor import (
    LEAST_FRICTION,
    Supervisor,
    SupervisorState,
    Window,
)
from stickslip.control.landing.tuning import APPROACH
from stickslip.control.pulses.exact import ExactPulseController
from stickslip.control.rest_detection import RestDetection
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import (
    AxisKind,
    LearnedPulses,
    PositioningOutcome,
    PulseRecord,
    SensorSample,
    quantity_field,
)


@dataclass(frozen=True, kw_only=True)
class AxisLandingState(SupervisorState):
    """State of a landing controller of a single mass."""

    #: The controller of the pulses; None before the first of them.
    pulses: ExactPulseController | None = None
    #: Its state [as of the controller].
    pulse_state: Float[np.ndarray, " p"] = field(default_factory=lambda: np.empty(0))
    #: When the phase of pulses began, or since when there is no effort in it [s].
    idle_since: float = quantity_field("time", default=0.0)
    #: Whether the mass did not come to rest, so that there are no more pulses.
    gave_up: bool = False


@dataclass(frozen=True, kw_only=True)
class AxisLandingController(Supervisor[AxisLandingState]):
    """Land a single mass: feedback near its target, then pulses, with friction learned on the way.

    The same supervisor as `LandingController`'s, for an axis without a load on a spring. Its
    phases, and what ends each:

    feedback
        PD and compensation of friction by the running estimate, along a smooth reference to the
        target. Ends when the mass rests after the reference, or at the wait limit.
    pulses
        Of `ExactPulseController`, that begins with the friction estimated in the feedback phase, or
        with what it has learned on the way to an earlier target. It is *done* within the tolerance,
        and *stopped* when no pulse can help, or when the mass has not come to rest in ten times the
        wait limit.
    done, stopped
        No effort. Where the mass leaves its place, pulses begin again, unless it did not come to
        rest. A new target begins with feedback.

    Attributes
    ----------
    sampling_time, target, tolerance, effort_limit, estimator, velocity_noise, pd, wait_limit
        As of `Supervisor`; the wait limit is 100 samples by the rule.
    position_noise
        Standard deviation of a sampled position, its rounding to encoder steps included; 0 for
        none.
    axis
        First guess of the mass; of its friction the offset and the ratio of static to Coulomb
        friction are used.
    rest
        Detection of rest by the pulses; None for a sensor without noise.
    mass_uncertainty
        Standard deviation of the mass, over its value, that the pulses begin with [-].
    longest_width
        Of a pulse; None for no limit.
    experience
        What the pulses of an earlier run have learned (`resumed`), that those of this one go on
        from; or None.

    Raises
    ------
    InputError
        If a value is out of its range.

    Examples
    --------
    >>> from stickslip.estimation import EnergyEstimator
    >>> from stickslip.simulation import simulate_closed_loop
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=100.0, static_friction=130.0,
    ...                                        viscous_friction=700.0)
    >>> axis = SingleMass(mass=150.0, friction=law)
    >>> controller = AxisLandingController(
    ...     sampling_time=0.01, target=0.1, tolerance=1e-6, axis=axis, effort_limit=300.0,
    ...     estimator=EnergyEstimator(inertia=150.0, offset=False))
    >>> run = simulate_closed_loop(axis, controller, sampling_time=0.01, samples=600)
    >>> controller.outcome(run.controller_state).value
    'reached'
    """

    axis: SingleMass[CoulombViscousFriction]
    rest: RestDetection | None = None
    mass_uncertainty: float = ExactPulseController.mass_uncertainty
    longest_width: float | None = quantity_field("time", default=None)
    experience: LearnedPulses | None = None
    _driven: ClassVar[str] = "the mass"

    def __post_init__(self) -> None:
        super().__post_init__()
        law = self.axis.friction
        self._check_effort(max(law.breakaway()) + abs(law.offset))
        self._first_pulses(self.init())  # which refuses what it cannot begin with

    @property
    def kind(self) -> AxisKind:
        """``"linear"`` or ``"rotary"``, as the axis."""
        return self.axis.kind

    @property
    def longest_wait(self) -> float:
        """The wait limit, or 100 samples [s]."""
        by_rule = APPROACH.mass_wait * self.sampling_time
        return by_rule if self.wait_limit is None else self.wait_limit

    @property
    def _rest(self) -> RestDetection:
        if self.rest is None:
            return RestDetection(samples=1, spread=0.0, speed=0.0)
        return self.rest

    def init(self) -> AxisLandingState:
        """Return the state before the first sample."""
        return AxisLandingState(
            target=self.target,
            estimator_state=self.estimator.init(sampling_time=self.sampling_time),
            window=Window.of(self._rest.samples),
        )

    @property
    def channels(self) -> tuple[str, ...]:
        """Position and velocity."""
        return ("measured_position", "measured_velocity")

    def _planned_effort(self, state: AxisLandingState) -> tuple[AxisLandingState, float]:
        if state.pulses is None:
            return state, 0.0
        memory, effort = state.pulses.blind(state.pulse_state, np.nan)
        return replace(state, pulse_state=memory), effort

    @property
    def _band(self) -> float:
        return self._rest.spread

    def approach(
        self, start: float, end: float, estimator_state: Float[np.ndarray, " e"]
    ) -> FeedbackController:
        """Return PD and compensation from a place to another [m or rad].

        Gains that are not given make a double pole that is fast beside the reference.
        """
        m = self.axis.mass
        light = self._light_duration(m, end - start)
        duration = max(light, APPROACH.mass_samples * self.sampling_time)
        w = min(APPROACH.mass_pole / duration, APPROACH.fastest_mass_pole / self.sampling_time)
        return self._feedback(
            estimator_state,
            move=Move(target=end, duration=duration),
            start=start,
            inertia=m,
            pd=PD(position_gain=m * w**2, velocity_gain=2.0 * m * w)
            if self.pd is None
            else self.pd,
        )

    def _after_approach(
        self, state: AxisLandingState, sample: SensorSample, reason: str
    ) -> AxisLandingState:
        if state.pulses is None:
            pulses = self._first_pulses(state)
        else:
            learned = state.pulses.learned(state.pulse_state)
            pulses = replace(state.pulses, target=state.target).resumed(learned)
        state = replace(
            state,
            pulses=pulses,
            pulse_state=pulses.init(),
            idle_since=sample.time,
            gave_up=False,
        )
        return self._enter(state, sample, "pulses", reason)

    def _first_pulses(self, state: AxisLandingState) -> ExactPulseController:
        """Return the controller of pulses that begins with the friction as estimated."""
        guess = self.axis.friction
        coulomb, viscous = self._estimated(state)
        coulomb = max(coulomb, LEAST_FRICTION * self.effort_limit, 1.01 * abs(guess.offset))
        known = guess.coulomb_friction_positive
        static = coulomb * (guess.static_friction_positive / known if known > 0.0 else 1.0)
        highest = 0.99 * self.effort_limit - abs(guess.offset)
        spread = sqrt(max(self._covariance(state)[0, 0], 0.0)) / max(coulomb, 1e-300)
        return ExactPulseController(
            kind=self.kind,
            sampling_time=self.sampling_time,
            target=state.target,
            tolerance=self.tolerance,
            rest=self._rest,
            effort_limit=self.effort_limit,
            mass=self.axis.mass,
            friction=CoulombViscousFriction.symmetric(
                coulomb_friction=min(coulomb, highest),
                viscous_friction=max(viscous, 0.0),
                static_friction=min(max(static, coulomb), highest),
                offset=guess.offset,
            ),
            friction_uncertainty=min(max(spread, APPROACH.friction_uncertainty), 1.0),
            mass_uncertainty=self.mass_uncertainty,
            position_noise=self.position_noise,
            longest_width=self.longest_width,
            experience=self.experience,
        )

    def _pulses(
        self, state: AxisLandingState
    ) -> tuple[ExactPulseController, Float[np.ndarray, " p"]]:
        """Return the controller of pulses with its state, the first one before it has begun."""
        if state.pulses is not None:
            return state.pulses, state.pulse_state
        first = self._first_pulses(state)
        return first, first.init()

    def _landing(
        self, state: AxisLandingState, sample: SensorSample
    ) -> tuple[AxisLandingState, float]:
        pulses = state.pulses
        if pulses is None or state.gave_up:
            return state, 0.0
        # The pulses watch the axis in every phase: it may creep or be pushed out of the tolerance
        memory, effort = pulses.step(state.pulse_state, sample)
        idle = state.idle_since if effort == 0.0 else sample.time
        state = replace(state, pulse_state=memory, idle_since=idle)
        outcome, phase = pulses.outcome(memory), state.phase.name
        if outcome is PositioningOutcome.MOVING and phase != "pulses":
            state = replace(state, idle_since=sample.time)
            state = self._enter(state, sample, "pulses", "the mass has left its place")
        elif outcome is PositioningOutcome.REACHED and phase != "done":
            state = self._enter(state, sample, "done", "the mass is within the tolerance")
        elif outcome is PositioningOutcome.STOPPED and phase != "stopped":
            why = pulses.why(memory) or "the pulses have ended"
            state = self._enter(state, sample, "stopped", why)
        elif phase == "pulses" and sample.time - idle >= APPROACH.mass_coasting * self.longest_wait:
            state = replace(state, gave_up=True)
            state = self._enter(state, sample, "stopped", "the mass does not come to rest")
            effort = 0.0
        return state, effort

    def estimates(self, state: AxisLandingState) -> dict[str, float]:
        """Return friction as estimated along the way, and mass and friction as of the pulses [SI].

        Before the first pulse the latter are what pulses would begin with.
        """
        coulomb, viscous = self._estimated(state)
        pulses, memory = self._pulses(state)
        own = {"coulomb_friction": coulomb, "viscous_friction": viscous}
        return own | pulses.estimates(memory)

    def pulse_count(self, state: AxisLandingState) -> int:
        """Return the number of pulses to the present target whose outcome is known."""
        return 0 if state.pulses is None else state.pulses.pulse_count(state.pulse_state)

    def last_pulse(self, state: AxisLandingState) -> PulseRecord | None:
        """Return the last of these pulses, or None."""
        return None if state.pulses is None else state.pulses.last_pulse(state.pulse_state)

    def learned(self, state: AxisLandingState) -> LearnedPulses:
        """Return what the pulses have learned, as `ExactPulseController.learned` does.

        Before the first pulse it is what they would begin with.

        Raises
        ------
        InputError
            If nothing has been learned yet.
        """
        if state.pulses is None and self.experience is None:
            self._known_covariance(state)
        pulses, memory = self._pulses(state)
        return pulses.learned(memory)

    def resumed(self, learned: LearnedPulses) -> "AxisLandingController":
        """Return the same controller, whose pulses begin with what an earlier run has learned.

        The estimator and the axis that the feedback is made for stay as they are.
        What was learned is from `learned`, of an `ExactPulseController` too, or read from a file.

        Raises
        ------
        InputError
            If it was learned by another method, on another kind of axis, or cannot be.
        """
        return replace(self, experience=learned)
