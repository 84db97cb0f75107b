"""A servo with a profile, feedforward of inertia and friction, PID, and dither where it sticks."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, sqrt

import numpy as np
from jaxtyping import Float

from stickslip.control.base import PositionController
from stickslip.control.checks import check_fields
from stickslip.control.feedback import profile_kernels as at
from stickslip.control.feedback.pid import PIDController
from stickslip.errors import check_class
from stickslip.friction import CoulombViscousFriction
from stickslip.records import (
    InputError,
    PositioningOutcome,
    SensorSample,
    finite,
    non_negative,
    positive,
    quantity_field,
)

# Of the feedback
_LAG = 0.4  # rad at the crossover: of the hold, the delay and two samples of reserve
_MARGIN = 0.75  # rad of phase at the crossover beside that; 0.2 rad less reach the limit cycle
_INTEGRAL_RATIO = 5.0  # crossover over that of the integral: faster costs phase, slower time
# Of the profile
_PLANNED = 0.85  # of the effort limit: the rest is for the feedback
_FRICTION_ROOM = 1.15  # planned effort over friction at least, where the limit allows it
_WINDOW = 4.0  # samples of rising acceleration at least
# Of the dither
_DEAD_BAND = 0.5  # of the tolerance
_DITHER = 1.0  # amplitude over static friction
_STRONGER = 0.35  # dither over friction, of which one half wave moves a quarter of the tolerance
_MOST_DITHER = 0.9  # of the effort limit
_REST_MOTION, _REST_SAMPLES = 0.02, 5  # motion at rest over the tolerance; samples of a rest


@dataclass(frozen=True, kw_only=True)
class ProfileController(PositionController[Float[np.ndarray, " s"]]):
    """A servo that goes to its target along a profile with limited jerk.

    The profile begins at rest where the axis is at the first sample. After `retargeted` it begins
    with the speed of the axis, as far as a stop at the target is possible from it, or at rest if
    the axis moves away from the target. It uses up to 85 % of the effort limit. The feedforward is
    that of inertia and friction along it. The PID controller, tuned for the mass, keeps its
    stability with a delay of two samples beyond the known one. After the profile the axis is left
    alone within half of the tolerance. Outside the tolerance a square wave as large as static
    friction is added while the axis sticks, until it is inside.

    Everything follows from the estimate of the axis, the sampling time, the effort limit and the
    tolerance.

    Attributes
    ----------
    sampling_time
        Of the loop.
    target
        Where the axis is to rest.
    tolerance
        How far from it at most.
    mass
        Moving mass or inertia.
    friction
        Friction of each direction, with static friction and offset.
    effort_limit
        Largest magnitude of the effort.
    speed_limit
        Of the profile; None for no limit.
    delay
        Known delay of drive and sensors.
    position_noise
        Largest error of a position by noise and encoder step.
    velocity_measured
        Whether the velocity is measured, and not the position differentiated.
    dither
        Whether an axis that sticks outside the tolerance is shaken.
    reset_factor
        Share of the sum of proportional and integral action that is left, with the other sign,
        when the axis has stopped beyond the target (Beerens et al., Automatica 107, 2019); 0 for no
        reset [-].

    Raises
    ------
    InputError
        If a value is out of its range, or the effort limit does not exceed static friction.

    Examples
    --------
    >>> from stickslip.plants import SingleMass
    >>> from stickslip.simulation import simulate_closed_loop
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=100.0, viscous_friction=700.0)
    >>> controller = ProfileController(
    ...     sampling_time=0.001, target=0.01, tolerance=2e-5, mass=150.0, friction=law,
    ...     effort_limit=300.0)
    >>> run = simulate_closed_loop(SingleMass(mass=150.0, friction=law), controller,
    ...                            sampling_time=0.001, samples=600)
    >>> controller.outcome(run.controller_state).value
    'reached'
    """

    sampling_time: float = quantity_field("sampling_time")
    target: float = quantity_field("position")
    tolerance: float = quantity_field("position")
    mass: float = quantity_field("mass")
    friction: CoulombViscousFriction
    effort_limit: float = quantity_field("effort")
    speed_limit: float | None = quantity_field("velocity", default=None)
    delay: float = quantity_field("time", default=0.0)
    position_noise: float = quantity_field("position", default=0.0)
    velocity_measured: bool = False
    dither: bool = True
    reset_factor: float = 0.0

    def __post_init__(self) -> None:
        units = {
            "sampling_time": "s",
            "tolerance": "m or rad",
            "mass": "kg or kg m^2",
            "effort_limit": "N or N m",
            "speed_limit": "m/s or rad/s",
        }
        check_fields(self, positive, units)
        object.__setattr__(self, "target", finite("target", self.target, "m or rad"))
        units = {"delay": "s", "position_noise": "m or rad", "reset_factor": "(no unit)"}
        check_fields(self, non_negative, units)
        check_class("friction", self.friction, CoulombViscousFriction)
        for direction, limit in zip(("positive", "negative"), self._static(), strict=True):
            if not self.effort_limit > limit:
                raise InputError(
                    "effort_below_breakaway",
                    name="effort_limit",
                    value=self.effort_limit,
                    limit_name=f"breakaway in {direction} direction",
                    limit=limit,
                    unit="N or N m",
                )

    def _static(self) -> tuple[float, float]:
        """Return the static friction of each direction, with the offset [N or N m]."""
        law = self.friction
        return (
            law.static_friction_positive + law.offset,
            law.static_friction_negative - law.offset,
        )

    @property
    def feedback(self) -> PIDController:
        """The PID controller whose gains are used."""
        T = self.sampling_time
        crossover = _LAG / (at.OWN_DELAY * T + self.delay)
        return PIDController.for_mass(
            sampling_time=T,
            target=self.target,
            mass=self.mass,
            bandwidth=crossover / (2.0 * np.pi),
            effort_limit=self.effort_limit,
            phase_margin=_MARGIN + _LAG - 0.5 * crossover * T,
            integral_ratio=_INTEGRAL_RATIO,
        )

    @property
    def step(
        self,
    ) -> Callable[[Float[np.ndarray, " s"], SensorSample], tuple[Float[np.ndarray, " s"], float]]:
        """The pure step ``step(state, sample) -> (state, effort)``, a compiled kernel."""
        return at.step

    @property
    def channels(self) -> tuple[str, ...]:
        """Position, and velocity if it is measured."""
        velocity = ("measured_velocity",) if self.velocity_measured else ()
        return ("measured_position", *velocity)

    def init(self) -> Float[np.ndarray, " s"]:
        """Return the state before the first sample."""
        state = np.zeros(at.SIZE)
        s, law, T, pid = at.fields(state), self.friction, self.sampling_time, self.feedback
        s.method, s.period, s.target, s.tolerance = at.METHOD, T, self.target, self.tolerance
        s.effort_limit = self.effort_limit
        s.speed_limit = inf if self.speed_limit is None else self.speed_limit
        s.mass, s.offset, s.delay = self.mass, law.offset, self.delay
        s.coulomb = (
            law.coulomb_friction_positive + law.offset,
            law.coulomb_friction_negative - law.offset,
        )
        s.viscous = law.viscous_friction_positive, law.viscous_friction_negative
        planned = max(_PLANNED * self.effort_limit, _FRICTION_ROOM * float(np.max(s.coulomb)))
        s.planned_effort = min(planned, self.effort_limit)
        s.K_p, s.K_i, s.K_d = pid.position_gain, pid.integral_gain, pid.velocity_gain
        s.filter_time, s.measured = pid.filter_time, self.velocity_measured
        s.dead_band, s.reset_factor = _DEAD_BAND * self.tolerance, self.reset_factor
        static = max(self._static()) - abs(law.offset)
        if self.dither and static > 0.0:
            s.dither_amplitude = min(_DITHER * static, _MOST_DITHER * self.effort_limit)
            half = sqrt(0.5 * self.tolerance * self.mass / (_STRONGER * static))
            s.dither_samples = max(int(half / T), 1)
        else:
            s.dither_samples = 1
        s.least_window = _WINDOW * T
        s.rest_motion = max(self.position_noise, _REST_MOTION * self.tolerance)
        s.rest_samples = _REST_SAMPLES
        return state

    def retargeted(self, state: Float[np.ndarray, " s"], target: float) -> Float[np.ndarray, " s"]:
        """Return the state with another target [m or rad], to which a profile begins."""
        vector = state.copy()
        s = at.fields(vector)
        s.target = finite("target", target, "m or rad")
        s.phase = at.HELD if s.phase == at.HELD else at.RETARGETED
        return vector

    def outcome(self, state: Float[np.ndarray, " s"]) -> PositioningOutcome:
        """Return whether the axis rests within the tolerance."""
        reached = at.rests_at_target(at.fields(state))
        return PositioningOutcome.REACHED if reached else PositioningOutcome.MOVING
