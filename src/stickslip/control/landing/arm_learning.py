"""What the landing of an arm knows of it, and what each series teaches."""

from dataclasses import dataclass, replace
from math import inf, isfinite, pi, sqrt

import numpy as np

from stickslip.control.landing.belief import LEARNED, ArmBelief, FlightLog, check_learned
from stickslip.control.landing.state import LandingState
from stickslip.control.landing.supervisor import FRICTION, LEAST_FRICTION, Supervisor
from stickslip.control.landing.swing import Swing
from stickslip.planning import PulseSeries
from stickslip.plants import FlexibleArm
from stickslip.records import AxisKind, LearnedPulses, non_negative

__all__ = ["ArmLearning"]

_STATIC_STEP = 1.25  # by which static friction is raised when a series has not freed mass 1
_BY_NOISE = (10.0, 0.05)  # deviations of a position, of the way: noise explains no larger miss
_DOUBT = 0.02  # by which masses and spring may be wrong, where nothing was said


@dataclass(frozen=True, kw_only=True)
class ArmLearning(Supervisor[LandingState]):
    """The supervisor of an arm, as far as knowledge goes.

    Friction is that of the estimator that runs along. Where masses and spring are uncertain, or
    where that friction has not landed the arm, masses, spring and friction are those that explain
    the motion along each series (`ArmBelief`).

    Attributes
    ----------
    arm, arm_uncertainty, experience
        As of `LandingController`.
    """

    arm: FlexibleArm
    arm_uncertainty: float = 0.0
    experience: LearnedPulses | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        uncertainty = non_negative("arm_uncertainty", self.arm_uncertainty, "(no unit)")
        object.__setattr__(self, "arm_uncertainty", uncertainty)
        self._check_effort(max(self.arm.friction.breakaway()) + abs(self.arm.friction.offset))
        if self.experience is not None:
            check_learned(self.experience, self.kind)

    @property
    def kind(self) -> AxisKind:
        """``"linear"`` or ``"rotary"``, as the arm."""
        return self.arm.kind

    @property
    def half_swing(self) -> float:
        """Half a period of mass 2 while mass 1 rests [s]."""
        return pi * sqrt(self.arm.mass_2 / self.arm.stiffness)

    def _learns(self, state: LandingState) -> bool:
        """Return whether masses and spring are learned."""
        return self.arm_uncertainty > 0.0 or state.belief is not None

    def _believed(self, state: LandingState) -> FlexibleArm:
        """Return the arm as it is believed to be now; `_friction` says its friction."""
        return self.arm if state.belief is None else state.belief.arm

    def _off(self, state: LandingState, swing: Swing) -> float:
        """Return the larger of what mass 1 is off the target and mass 2 swings about mass 1."""
        return max(abs(state.target - swing.position), swing.amplitude)

    def _judged(self, state: LandingState, swing: Swing) -> LandingState:
        """Note how the last series ended, if it is not known yet, and learn from it."""
        if not state.track:
            return state
        last = state.flights[-1]
        ended = replace(last, final_position=swing.position, final_swing=swing.amplitude)
        flight = FlightLog.of(
            last.planned,
            state.track,
            sampling_time=self.sampling_time,
            position_noise=self.position_noise,
            velocity_noise=self.velocity_noise,
        )
        state = replace(state, flights=(*state.flights[:-1], ended), track=())
        stayed = abs(swing.position - last.planned.position[0]) <= self._band
        if stayed or flight.late:
            state = replace(state, static_ratio=_STATIC_STEP * state.static_ratio)
        missed = max(abs(swing.position - last.planned.target), swing.amplitude)
        doubtful = missed > max(self.tolerance, self._by_noise(last.planned))
        if stayed or not (self._learns(state) or doubtful):
            return state
        belief = self._belief(state)
        belief = belief.later() if state.series_since_target == 1 else belief
        return replace(state, belief=belief.after(flight))

    def _by_noise(self, planned: PulseSeries) -> float:
        """Return how far a series may miss by what noise does to its start and to friction."""
        if self.position_noise == 0.0:
            return 0.0
        deviations, share = _BY_NOISE
        way = abs(planned.target - float(planned.position[0]))
        return max(deviations * self.position_noise, share * way)

    def _belief(self, state: LandingState) -> ArmBelief:
        """Return what is believed of the arm, before it was learned by the estimator."""
        if state.belief is not None:
            return state.belief
        coulomb, viscous = self._friction(state)
        return ArmBelief.first(
            self.arm,
            uncertainty=self.arm_uncertainty or _DOUBT,
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

        Parameters
        ----------
        state
            From `init` or a step.
        """
        coulomb, viscous = self._friction(state)
        static = coulomb * state.static_ratio
        found: dict[str, float] = dict(zip(FRICTION, (coulomb, viscous, static), strict=True))
        if self._learns(state):
            body = self._belief(state).values
            found |= {name: body[name] for name in LEARNED[:3]}
        return found

    def deviations(self, state: LandingState) -> dict[str, float]:
        """Return standard deviations of the estimates, but for static friction [SI].

        Parameters
        ----------
        state
            From `init` or a step.
        """
        found = super().deviations(state)
        if not self._learns(state):
            return found
        own = self._belief(state).deviations
        if state.belief is None:
            own |= {name: inf for name, spread in found.items() if not isfinite(spread)}
        return {name: own[name] for name in (*found, *LEARNED[:3])}

    def learned(self, state: LandingState) -> LearnedPulses:
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
        return LearnedPulses(
            method="landing",
            kind=self.kind,
            values=self.estimates(state),
            covariance=self._belief(state).covariance if self._learns(state) else covariance,
        )
