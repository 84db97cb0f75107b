"""PID control of a position, as textbooks have it, and two remedies against friction."""

from dataclasses import dataclass
from math import atan, cos, isfinite, pi, sqrt, tan
from typing import Literal

import numpy as np
from jaxtyping import Float

from stickslip.control.base import PositionController
from stickslip.control.feedback import pid_kernel as at
from stickslip.control.feedback.dither import Dither
from stickslip.control.feedback.reset_integral import COULOMB, NO_RESET, STRIBECK, ResetIntegral
from stickslip.numerics.named_fields import places
from stickslip.records import InputError, non_negative, positive, quantity_field

__all__ = ["PIDController"]

_GAINS = {
    "position_gain": "N/m or N m/rad",
    "integral_gain": "N/(m s) or N m/(rad s)",
    "velocity_gain": "N s/m or N m s/rad",
}
_LAWS = {"coulomb": COULOMB, "stribeck": STRIBECK}


@dataclass(frozen=True, kw_only=True)
class PIDController(PositionController[Float[np.ndarray, " s"]]):
    """Proportional, integral and derivative action towards a target that stays where it is.

    At each sample ``u = position_gain (target - x) + I - velocity_gain v``, plus the dither, held
    to the effort limit. ``I`` is the integral of ``integral_gain (target - x)`` by trapezoids; it
    does not grow while the limit holds the effort back (anti-windup by clamping), nor within the
    dead band. The velocity ``v`` is measured, or the position differentiated and filtered.

    All that the controller is and remembers is one vector, which `init` returns and `step` takes
    and leaves as it is.

    Attributes
    ----------
    sampling_time
        That of the loop [s].
    target
        Where the axis is to be [m or rad].
    position_gain, integral_gain, velocity_gain
        [N/m or N m/rad], positive; [N/(m s) or N m/(rad s)] and [N s/m or N m s/rad], not negative.
    effort_limit
        Largest magnitude of the effort [N or N m].
    velocity
        ``"differentiated"``, from the measured position through ``s/(1 + filter_time s)``, or
        ``"measured"``, which a velocity sensor shows.
    filter_time
        Time constant of the derivative's filter [s], positive where the differentiated velocity
        counts; without use where the velocity is measured.
    dead_band
        Error within which the integral stands still [m or rad]; 0 for none.
    dither
        Oscillation added to the effort; None for none.
    reset
        Resets of the integral; None for none.

    Raises
    ------
    InputError
        If a value is out of its range, a part is not of its class, a derivative has no filter, or
        the dither is too fast for the sampling time.

    Examples
    --------
    >>> from stickslip.friction import CoulombViscousFriction
    >>> from stickslip.plants import SingleMass
    >>> from stickslip.simulation import simulate_closed_loop
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=100.0, viscous_friction=700.0)
    >>> controller = PIDController.for_mass(
    ...     sampling_time=0.01, target=0.01, mass=150.0, bandwidth=4.0, effort_limit=300.0)
    >>> run = simulate_closed_loop(SingleMass(mass=150.0, friction=law), controller,
    ...                            sampling_time=0.01, samples=1000)
    >>> bool(abs(0.01 - run.motion.position[-1]) < 5e-4)
    True
    """

    sampling_time: float = quantity_field("sampling_time")
    target: float = quantity_field("position")
    position_gain: float
    integral_gain: float
    velocity_gain: float
    effort_limit: float = quantity_field("effort")
    velocity: Literal["differentiated", "measured"] = "differentiated"
    filter_time: float = quantity_field("time", default=0.0)
    dead_band: float = quantity_field("position", default=0.0)
    dither: Dither | None = None
    reset: ResetIntegral | None = None

    def __post_init__(self) -> None:
        T = positive("sampling_time", self.sampling_time, "s")
        object.__setattr__(self, "sampling_time", T)
        object.__setattr__(self, "target", _target(self.target))
        for name, unit in _GAINS.items():
            check = positive if name == "position_gain" else non_negative
            object.__setattr__(self, name, check(name, getattr(self, name), unit))
        limit = positive("effort_limit", self.effort_limit, "N or N m")
        object.__setattr__(self, "effort_limit", limit)
        if self.velocity not in ("differentiated", "measured"):
            raise InputError(
                f"velocity is {self.velocity!r}", remedy="give 'differentiated' or 'measured'"
            )
        object.__setattr__(self, "filter_time", non_negative("filter_time", self.filter_time, "s"))
        band = non_negative("dead_band", self.dead_band, "m or rad")
        object.__setattr__(self, "dead_band", band)
        for name, kind in (("dither", Dither), ("reset", ResetIntegral)):
            part = getattr(self, name)
            if not (part is None or isinstance(part, kind)):
                raise InputError(
                    f"{name} must be a {kind.__name__}, it is a {type(part).__name__}",
                    remedy=f"give {kind.__name__}(...), or None for none",
                )
        derived = self.velocity_gain > 0.0 or self.reset is not None
        if self.velocity == "differentiated" and derived and self.filter_time == 0.0:
            raise InputError(
                "filter_time is 0 s, and the velocity is differentiated: without a filter the "
                "derivative of sampled positions alternates for ever",
                remedy=f"give a filter_time of {0.5 * T:g} s or more, or measure the velocity",
            )
        if self.dither is not None and self.dither.frequency * T > 0.5:
            raise InputError(
                f"the dither's frequency is {self.dither.frequency:g} Hz, samples {T:g} s apart "
                f"reach up to {0.5 / T:g} Hz only",
                remedy="sample faster, or dither more slowly",
            )

    @classmethod
    def for_mass(
        cls,
        *,
        sampling_time: float,
        target: float,
        mass: float,
        bandwidth: float,
        effort_limit: float,
        phase_margin: float = pi / 4,
        integral_ratio: float = 10.0,
        dead_band: float = 0.0,
        dither: Dither | None = None,
        reset: ResetIntegral | None = None,
    ) -> "PIDController":
        """Return the controller shaped for a free mass of which only the position is measured.

        The open loop ``K (1 + 1/(T_i s)) (1 + T_d s)/(1 + tau s)`` times the mass under the held
        effort crosses gain 1 at the bandwidth, with the phase margin asked for; zero and pole of
        the lead, ``1/T_d`` and ``1/tau``, lie evenly about the crossover, ``1/T_i`` lies
        ``integral_ratio`` below it. Everything is computed in ``w = (2/T) tan(W T/2)``, the
        frequency that Tustin's substitution makes of ``W``: on the sampled loop crossover and
        margin are exact. Friction is left out: viscous friction only adds to the margin.

        Parameters
        ----------
        sampling_time, target, effort_limit, dead_band, dither, reset
            As of the class [s], [m or rad], [N or N m], [m or rad].
        mass
            Moving mass or inertia [kg or kg m^2].
        bandwidth
            Crossover frequency [Hz].
        phase_margin
            [rad].
        integral_ratio
            Crossover frequency over that of the integral, ``W T_i`` [-].

        Raises
        ------
        InputError
            If a value is out of its range, or no lead gives the phase margin at this bandwidth.
        """
        T = positive("sampling_time", sampling_time, "s")
        m = positive("mass", mass, "kg or kg m^2")
        f = positive("bandwidth", bandwidth, "Hz")
        beta = positive("integral_ratio", integral_ratio, "(no unit)")
        margin = positive("phase_margin", phase_margin, "rad")
        lag = pi * f * T  # half a sample: what the held effort costs, exactly, at the crossover
        lead = margin + lag + atan(1.0 / beta)
        if not (lag < pi / 2 and lead < pi / 2):
            raise InputError(
                f"the bandwidth is {f:g} Hz: with samples {T:g} s apart and the integral it takes "
                f"a lead of {np.degrees(lead):.3g} degrees for a phase margin of "
                f"{np.degrees(margin):.3g} degrees, it must be below 90",
                remedy="ask for less bandwidth, or shorten the sampling time",
            )
        w = 2.0 / T * tan(lag)
        alpha = tan(0.5 * lead + pi / 4)
        T_i, T_d, tau = beta / w, alpha / w, 1.0 / (alpha * w)
        # The sampled mass has the gain 1/(m w^2 cos(W T/2)) at the crossover
        K = m * w * w * cos(lag) / (alpha * sqrt(1.0 + 1.0 / (beta * beta)))
        K_i = K / T_i
        K_p = K * (1.0 + T_d / T_i) - K_i * tau
        return cls(
            sampling_time=T,
            target=target,
            position_gain=K_p,
            integral_gain=K_i,
            velocity_gain=K * T_d - K_p * tau,
            effort_limit=effort_limit,
            filter_time=tau,
            dead_band=dead_band,
            dither=dither,
            reset=reset,
        )

    @property
    def step(self) -> at.Step:
        """The pure step ``step(state, sample) -> (state, effort)`` of a `SensorSample`.

        A sample whose position, or velocity if it is to be measured, is not finite gives the effort
        NaN and leaves the state as it was; a vector that is not its state is a ValueError.
        """
        return at.pid_step

    def init(self) -> Float[np.ndarray, " s"]:
        """Return the state before the first sample."""
        state = np.zeros(places(at.STATE))
        s = at.fields(state)
        s.method, s.period, s.target = at.METHOD, self.sampling_time, self.target
        s.K_p, s.K_i, s.K_d = self.position_gain, self.integral_gain, self.velocity_gain
        s.filter_time = self.filter_time
        s.measured = self.velocity == "measured"
        s.effort_limit, s.dead_band = self.effort_limit, self.dead_band
        if self.dither is not None:
            s.dither_amplitude = self.dither.amplitude
            s.dither_cycles = self.dither.frequency * self.sampling_time
            s.dither_square = self.dither.shape == "square"
        s.reset_law = NO_RESET
        if self.reset is not None:
            s.reset_law = _LAWS[self.reset.law]
            s.reset_factor = self.reset.factor
            s.rest_speed, s.rest_samples = self.reset.rest_speed, self.reset.rest_samples
        s.armed = 1.0
        return state

    def integral_action(self, state: Float[np.ndarray, " s"]) -> float:
        """Return the integral's part of the effort [N or N m].

        Parameters
        ----------
        state
            From `init`, a step, or a run's ``controller_state``.
        """
        return float(at.fields(state).integral)

    def integrates(self, tolerance: float) -> bool:
        """Return whether the effort grows while the axis rests outside a tolerance.

        Parameters
        ----------
        tolerance
            [m or rad].
        """
        return self.integral_gain > 0.0 and self.dead_band <= tolerance

    def retargeted(self, state: Float[np.ndarray, " s"], target: float) -> Float[np.ndarray, " s"]:
        """Return the state that goes on to another target, with its integral as it is.

        Parameters
        ----------
        state
            From `init`, a step, or a run's ``controller_state``.
        target
            [m or rad].

        Raises
        ------
        InputError
            If the target is not finite.
        """
        vector = state.copy()
        s = at.fields(vector)
        s.target, s.armed = _target(target), 1.0
        return vector


def _target(target: float) -> float:
    if not isfinite(target):
        raise InputError(
            f"target is {target:g} m or rad, it must be finite",
            remedy="give the place where the axis is to be",
        )
    return float(target)
