"""PID control of a position, and two remedies against friction: dither and a reset integral."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from math import atan, cos, pi, sqrt, tan
from types import NoneType
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.base import PositionController
from stickslip.control.checks import check_fields
from stickslip.errors import check_class
from stickslip.numerics.named_fields import fields_at, places
from stickslip.records import (
    InputError,
    SensorSample,
    finite,
    non_negative,
    one_of,
    positive,
    quantity_field,
    whole,
)

_METHOD = 4  # of a vector of this kernel
_LAWS = {"coulomb": 1.0, "stribeck": 2.0}  # of the resets; 0 for none
_COULOMB, _STRIBECK = _LAWS.values()

_STATE = np.dtype(
    [
        # Settings
        ("method", "i8"),  # whose vector it is
        ("period", "f8"),  # T
        ("target", "f8"),
        ("K_p", "f8"),
        ("K_i", "f8"),
        ("K_d", "f8"),
        ("filter_time", "f8"),  # tau, time constant of the derivative
        ("measured", "i8"),  # 1 if the velocity is measured, not differentiated
        ("effort_limit", "f8"),
        ("dead_band", "f8"),
        ("dither_amplitude", "f8"),
        ("dither_cycles", "f8"),  # a sample
        ("dither_square", "i8"),
        ("reset_law", "f8"),
        ("reset_factor", "f8"),
        ("rest_speed", "f8"),
        ("rest_samples", "i8"),
        # What changes
        ("samples", "i8"),  # taken so far
        ("x", "f8"),  # position and velocity of the last sample
        ("v", "f8"),
        ("integral", "f8"),  # integral action, an effort
        ("armed", "f8"),  # logic state of the resets
        ("rested", "i8"),  # samples in a row within the speed of rest
    ]
)
_fields = fields_at(_STATE)
_SIZE = places(_STATE)
Step = Callable[[Float[np.ndarray, " s"], SensorSample], tuple[Float[np.ndarray, " s"], float]]


@compiled(inline=True)
def _dither(A: float, cycles: float, square: bool) -> float:
    """Return the effort of a dither after so many cycles: A sign(sin) or A sin of 2 pi cycles."""
    phase = cycles - np.floor(cycles)
    if square:
        return A if phase < 0.5 else -A
    return A * np.sin(2.0 * np.pi * phase)


@compiled(inline=True)
def _reset(
    s: Any, u_p: float, u_i: float, e: float, e_last: float, moving: bool, stopped: bool
) -> float:
    """Return the integral action after the reset that is due, if any; the logic state follows.

    With phi = u_p + u_i, the force of proportional and integral action:

    Coulomb law: the mass has stopped and phi points away from the target, phi e < 0, because the
    integral is still that of the approach: phi+ = -alpha phi.

    Stribeck law, of which the logic state b says which reset is next: b = 1, the error crosses
    zero while the mass moves: phi+ = -phi, b+ = -1, so that the force brakes; b = -1, the mass
    stops: u_i+ = 0, b+ = 1.
    """
    if s.reset_law == _COULOMB:
        if stopped and abs(e) > s.dead_band and (u_p + u_i) * e < 0.0:
            u_i = -s.reset_factor * (u_p + u_i) - u_p
    elif s.reset_law == _STRIBECK:
        if s.armed > 0.0:
            if moving and e * e_last < 0.0:
                u_i = -(u_p + u_i) - u_p
                s.armed = -1.0
        elif stopped:
            u_i = 0.0
            s.armed = 1.0
    return u_i


@compiled()
def _step(
    state: Float[np.ndarray, " s"], sample: SensorSample
) -> tuple[Float[np.ndarray, " s"], float]:
    """Take a sample: u = u_p + u_i - K_d v + dither, limited, with u_p = K_p e.

    Tustin's substitution s = (2/T) (z - 1)/(z + 1) turns K_i/s and s/(1 + tau s) into
    u_i(k) = u_i(k-1) + K_i T/2 [e(k) + e(k-1)] and
    v(k) = {(2 tau - T) v(k-1) + 2 [x(k) - x(k-1)]}/(2 tau + T).
    The integral does not grow while the limit holds the effort back and it would grow further
    beyond it, nor while the error is within the dead band.

    Raises
    ------
    ValueError
        If the vector is not one of this kernel.
    """
    if state.size != _SIZE or _fields(state).method != _METHOD:
        raise ValueError("not a state of a PIDController: begin with the one of its init()")
    vector = state.copy()
    s = _fields(vector)
    x, v = sample.measured_position, sample.measured_velocity
    T, r = s.period, s.target
    started = s.samples > 0
    x_last = s.x if started else x
    v_last = s.v
    if not s.measured:
        tau = s.filter_time
        v = ((2.0 * tau - T) * v_last + 2.0 * (x - x_last)) / (2.0 * tau + T)
    if not math.isfinite(x) or not math.isfinite(v):
        return vector, math.nan
    e, e_last = r - x, r - x_last
    u_p, u_i = s.K_p * e, s.integral
    growth = 0.5 * s.K_i * T * (e + e_last)
    if not started or abs(e) <= s.dead_band:
        growth = 0.0

    moving = abs(v) > s.rest_speed
    s.rested = 0 if moving else s.rested + 1
    stopped = s.rested >= s.rest_samples or v * v_last < 0.0
    u_i = _reset(s, u_p, u_i + growth, e, e_last, moving, stopped)

    u = u_p + u_i - s.K_d * v
    u += _dither(s.dither_amplitude, s.dither_cycles * (s.samples + 0.5), s.dither_square > 0)
    limit = s.effort_limit
    if abs(u) > limit:
        if u * growth > 0.0:
            u_i -= growth
        u = math.copysign(limit, u)
    s.integral = u_i
    s.x, s.v = x, v
    s.samples += 1
    return vector, u


@dataclass(frozen=True, kw_only=True)
class Dither:
    """An oscillation added to the effort, whatever the error.

    Its value at sample k is that of the wave in the middle of the sample, ``(k + 1/2) T``: the
    fastest one possible, half the sampling rate, then alternates between ``+-amplitude``.

    Attributes
    ----------
    amplitude
        Peak of the oscillation [N or N m].
    frequency
        [Hz]; at most half the sampling rate of the controller it is used in.
    shape
        ``"square"`` or ``"sine"``.

    Raises
    ------
    InputError
        If a value is out of its range.

    Examples
    --------
    >>> Dither(amplitude=50.0, frequency=25.0, shape="square").frequency
    25.0
    """

    amplitude: float = quantity_field("effort")
    frequency: float
    shape: Literal["square", "sine"]

    def __post_init__(self) -> None:
        check_fields(self, positive, {"amplitude": "N or N m", "frequency": "Hz"})
        one_of("shape", self.shape, ("square", "sine"))


@dataclass(frozen=True, kw_only=True)
class ResetIntegral:
    """Resets of a PID controller's integral action on an axis with friction.

    A mass that has overshot sticks until the integral action, which still pushes the way of the
    approach, has been emptied and filled again the other way. Let phi be the sum of proportional
    and integral action.

    ``law="coulomb"``: when the mass has stopped beyond its target and phi points away from it, phi
    becomes ``-factor * phi`` (Beerens, Bisoffi, Zaccarian, Heemels, Nijmeijer, van de Wouw, "Reset
    integral control for improved settling of PID-based motion systems with friction", Automatica
    107, 2019). It shortens the rests; where static friction exceeds Coulomb friction the axis hunts
    as without it, only faster.

    ``law="stribeck"``: when the error crosses zero, phi changes its sign, which brakes; when the
    mass has then stopped, the integral action becomes zero (the same authors, "Reset PID design for
    motion systems with Stribeck friction", IEEE Transactions on Control Systems Technology, 2021).

    Both laws are of continuous time, with the velocity known. Here a crossing is seen at the first
    sample after it, and a stop when the controller's velocity has changed its sign or stayed within
    ``rest_speed`` for ``rest_samples`` samples.

    Attributes
    ----------
    law
        ``"coulomb"`` or ``"stribeck"``.
    rest_speed
        Largest velocity taken for rest [m/s or rad/s]; above the noise of the controller's
        velocity.
    rest_samples
        So many samples within it are a rest, 1 at least.
    factor
        Of the law for Coulomb friction [-], 0 to 1.

    Raises
    ------
    InputError
        If a value is out of its range.

    Examples
    --------
    >>> ResetIntegral(law="stribeck", rest_speed=1e-3, rest_samples=2).factor
    1.0
    """

    law: Literal["coulomb", "stribeck"]
    rest_speed: float = quantity_field("velocity")
    rest_samples: int
    factor: float = 1.0

    def __post_init__(self) -> None:
        one_of("law", self.law, _LAWS)
        check_fields(self, positive, {"rest_speed": "m/s or rad/s"})
        whole("rest_samples", self.rest_samples, least=1)
        if not 0.0 <= self.factor <= 1.0:
            raise InputError(
                "out_of_range", name="factor", value=self.factor, least=0, most=1, unit="-"
            )


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
        check_fields(self, positive, {"sampling_time": "s"})
        object.__setattr__(self, "target", _target(self.target))
        check_fields(self, positive, {"position_gain": "N/m or N m/rad"})
        gains = {"integral_gain": "N/(m s) or N m/(rad s)", "velocity_gain": "N s/m or N m s/rad"}
        check_fields(self, non_negative, gains)
        check_fields(self, positive, {"effort_limit": "N or N m"})
        one_of("velocity", self.velocity, ("differentiated", "measured"))
        check_fields(self, non_negative, {"filter_time": "s", "dead_band": "m or rad"})
        for name, kind in (("dither", Dither), ("reset", ResetIntegral)):
            check_class(name, getattr(self, name), kind, NoneType)
        T = self.sampling_time
        derived = self.velocity_gain > 0.0 or self.reset is not None
        if self.velocity == "differentiated" and derived and self.filter_time == 0.0:
            raise InputError("derivative_without_filter", least=0.5 * T)
        if self.dither is not None and self.dither.frequency * T > 0.5:
            raise InputError(
                "frequency_above_nyquist",
                part="dither",
                value=self.dither.frequency,
                limit=0.5 / T,
                unit="Hz",
                sampling_time=T,
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
        sampling_time, target, effort_limit
            As of the class [s], [m or rad], [N or N m].
        mass
            Moving mass or inertia [kg or kg m^2].
        bandwidth
            Crossover frequency [Hz].
        phase_margin
            [rad].
        integral_ratio
            Crossover frequency over that of the integral, ``W T_i`` [-].
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
                "bandwidth_too_high",
                bandwidth=f,
                sampling_time=T,
                lead=np.degrees(lead),
                margin=np.degrees(margin),
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
        )

    @property
    def step(self) -> Step:
        """The pure step ``step(state, sample) -> (state, effort)`` of a `SensorSample`.

        A sample whose position, or velocity if it is to be measured, is not finite gives the effort
        NaN and leaves the state as it was; a vector that is not its state is a ValueError.
        """
        return _step

    @property
    def channels(self) -> tuple[str, ...]:
        """Position, and velocity if it is measured."""
        velocity = ("measured_velocity",) if self.velocity == "measured" else ()
        return ("measured_position", *velocity)

    def init(self) -> Float[np.ndarray, " s"]:
        """Return the state before the first sample."""
        state = np.zeros(places(_STATE))
        s = _fields(state)
        s.method, s.period, s.target = _METHOD, self.sampling_time, self.target
        s.K_p, s.K_i, s.K_d = self.position_gain, self.integral_gain, self.velocity_gain
        s.filter_time = self.filter_time
        s.measured = self.velocity == "measured"
        s.effort_limit, s.dead_band = self.effort_limit, self.dead_band
        if self.dither is not None:
            s.dither_amplitude = self.dither.amplitude
            s.dither_cycles = self.dither.frequency * self.sampling_time
            s.dither_square = self.dither.shape == "square"
        if self.reset is not None:
            s.reset_law = _LAWS[self.reset.law]
            s.reset_factor = self.reset.factor
            s.rest_speed, s.rest_samples = self.reset.rest_speed, self.reset.rest_samples
        s.armed = 1.0
        return state

    def integral_action(self, state: Float[np.ndarray, " s"]) -> float:
        """Return the integral's part of the effort [N or N m]."""
        return float(_fields(state).integral)

    def integrates(self, tolerance: float) -> bool:
        """Return whether the effort grows while the axis rests outside a tolerance [m or rad]."""
        return self.integral_gain > 0.0 and self.dead_band <= tolerance

    def retargeted(self, state: Float[np.ndarray, " s"], target: float) -> Float[np.ndarray, " s"]:
        """Return the state with another target [m or rad], its integral as it is."""
        vector = state.copy()
        s = _fields(vector)
        s.target, s.armed = _target(target), 1.0
        return vector


def _target(target: float) -> float:
    return finite("target", target, "m or rad")
