"""Zero-vibration shaping of a move, for a load that swings on a spring."""

from collections.abc import Callable
from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from stickslip.compiled import compiled
from stickslip.control.feedback.friction_compensation import compensating_effort
from stickslip.control.feedback.linear_parts import PD, pd_effort
from stickslip.control.feedback.reference import PointToPoint, Reference, reference_at
from stickslip.plants import FlexibleArm, check_affine
from stickslip.records import InputError, SensorSample, positive, quantity_field

(
    _SAMPLING_TIME,
    _MASS_1,
    _STIFFNESS,
    _POSITION_GAIN,
    _VELOCITY_GAIN,
    _EFFORT_LIMIT,
    _DELAY,
    _COULOMB,  # in positive, in negative direction
    _,
    _VISCOUS,  # likewise
    _,
    _OFFSET,
    _MOVES,
    _REFERENCE,  # the moves
) = range(14)


@compiled(inline=True)
def _shaped_at(
    s: Float[np.ndarray, " s"], first: int, moves: int, delay: float, t: float
) -> tuple[float, float, float]:
    """Return [r(t) + r(t - delay)]/2 and its two derivatives: two impulses of a half."""
    r, r_dot, r_ddot = reference_at(s, first, moves, t)
    q, q_dot, q_ddot = reference_at(s, first, moves, t - delay)
    return 0.5 * (r + q), 0.5 * (r_dot + q_dot), 0.5 * (r_ddot + q_ddot)


@compiled()
def _step(
    state: Float[np.ndarray, " s"], sample: SensorSample
) -> tuple[Float[np.ndarray, " s"], float]:
    """Take a sample: u = m_1 r'' + k_s (x_1 - x_2) + K_p (r - x_1) + K_d (r' - v_1) + friction.

    What is fed forward is taken half a sample later, where it is held on the average; so is the
    spring's force.
    """
    s = state
    x1, v1 = sample.measured_position, sample.measured_velocity
    x2, v2 = sample.measured_load_position, sample.measured_load_velocity
    moves, half = int(s[_MOVES]), 0.5 * s[_SAMPLING_TIME]
    r, r_dot, _ = _shaped_at(s, _REFERENCE, moves, s[_DELAY], sample.time)
    _, w, a = _shaped_at(s, _REFERENCE, moves, s[_DELAY], sample.time + half)
    u = s[_MASS_1] * a + s[_STIFFNESS] * (x1 - x2 + half * (v1 - v2)) + s[_OFFSET]
    u += pd_effort(s[_POSITION_GAIN], s[_VELOCITY_GAIN], r, x1, r_dot, v1)
    u += compensating_effort(
        s[_COULOMB], s[_COULOMB + 1], s[_VISCOUS], s[_VISCOUS + 1], w, 0.0
    )  # fmt: skip
    if not np.isfinite(u):
        return s, np.nan
    limit = s[_EFFORT_LIMIT]
    return s, min(max(u, -limit), limit)


@compiled()
def _shaped_references(
    table: Float[np.ndarray, " s"], moves: int, delay: float, times: Float[np.ndarray, " n"]
) -> Float[np.ndarray, "3 n"]:
    """Return `_shaped_at` for many times."""
    out = np.empty((3, times.size))
    for k in range(times.size):
        out[0, k], out[1, k], out[2, k] = _shaped_at(table, 0, moves, delay, times[k])
    return out


@dataclass(frozen=True, kw_only=True)
class ZeroVibrationController:
    """Moves the driven mass of an arm so that the load is left without swing, if nothing is amiss.

    A load on a spring whose other end moves as ``r`` is at rest after ``[r(t) + r(t - h)]/2``, with
    the half period ``h = pi sqrt(mass_2/stiffness)``: the swings that the two halves leave cancel
    (N. C. Singer and W. P. Seering, Preshaping Command Inputs to Reduce System Vibration, ASME
    Journal of Dynamic Systems, Measurement, and Control 112(1):76-82, 1990; two impulses, no
    damping). That the driven mass moves so is left to what is fed forward (its inertia, its
    friction, and the spring's force as measured) and to a PD action on what is missing.

    Where static friction holds the driven mass short of the target, nothing moves it any more:
    its last error, and the swing that goes with it, stay.

    Raises
    ------
    InputError
        If a value is out of its range or a part is not of its class.

    Examples
    --------
    >>> from stickslip.control import Move
    >>> from stickslip.friction import CoulombViscousFriction
    >>> from stickslip.simulation import simulate_closed_loop
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=0.1, viscous_friction=0.1)
    >>> arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
    >>> controller = ZeroVibrationController(
    ...     sampling_time=0.02, arm=arm, pd=PD(position_gain=100.0, velocity_gain=20.0),
    ...     reference=PointToPoint(moves=(Move(target=1.0, duration=4.0),)), effort_limit=1.0)
    >>> run = simulate_closed_loop(arm, controller, sampling_time=0.02, samples=1000)
    >>> bool(abs(run.motion.load_position[500:] - 1.0).max() < 1e-3)
    True
    """

    sampling_time: float = quantity_field("sampling_time")  #: That of the loop [s].
    #: Masses, spring and friction as they are guessed to be; static friction is not used.
    arm: FlexibleArm
    pd: PD  #: Gains, on the driven mass alone: the spring's force is balanced.
    #: The moves before they are shaped, from time 0 of the samples on; shaped, each takes `delay`
    #: longer.
    reference: PointToPoint
    effort_limit: float = quantity_field("effort")  #: Largest magnitude of the effort [N or N m].

    def __post_init__(self) -> None:
        for name, unit in (("sampling_time", "s"), ("effort_limit", "N or N m")):
            object.__setattr__(self, name, positive(name, getattr(self, name), unit))
        for name, kind in (("arm", FlexibleArm), ("pd", PD), ("reference", PointToPoint)):
            part = getattr(self, name)
            if not isinstance(part, kind):
                found, needed = type(part).__name__, [kind.__name__]
                raise InputError("wrong_type", name=name, found=found, needed=needed)
        check_affine(self.arm)

    @property
    def delay(self) -> float:
        """Half a period of the load on its spring, by which each move takes longer [s]."""
        return pi * sqrt(self.arm.mass_2 / self.arm.stiffness)

    @property
    def step(
        self,
    ) -> Callable[[Float[np.ndarray, " s"], SensorSample], tuple[Float[np.ndarray, " s"], float]]:
        """The pure step, a compiled kernel: ``step(state, sample) -> (state, effort)``.

        A sample that lacks a position or a velocity gives the effort NaN. The state never changes.
        """
        return _step

    def init(self) -> Float[np.ndarray, " s"]:
        """Return the state: all settings."""
        table, law = self.reference.table, self.arm.friction
        s = np.empty(_REFERENCE + table.size)
        s[:_REFERENCE] = (
            self.sampling_time,
            self.arm.mass_1,
            self.arm.stiffness,
            self.pd.position_gain,
            self.pd.velocity_gain,
            self.effort_limit,
            self.delay,
            law.coulomb_friction_positive,
            law.coulomb_friction_negative,
            law.viscous_friction_positive,
            law.viscous_friction_negative,
            law.offset,
            len(self.reference.moves),
        )
        s[_REFERENCE:] = table
        return s

    def shaped_at(self, times: ArrayLike) -> Reference:
        """Return the motion of the driven mass at times [s] from the begin of the first move on."""
        t = np.atleast_1d(np.asarray(times, dtype=np.float64))
        table, moves = self.reference.table, len(self.reference.moves)
        r, v, a = _shaped_references(table, moves, self.delay, t)
        return Reference(position=r, velocity=v, acceleration=a)
