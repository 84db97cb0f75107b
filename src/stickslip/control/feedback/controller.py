"""The feedback controller of van de Wijdeven (2002): PD, notch and friction compensation.

Settings and memory are one vector, so that one piece of machine code serves all controllers,
whatever their settings: the fields of `_HEAD`, the moves of the reference, and the state of the
estimator that runs along.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from types import NoneType
from typing import Any

import numpy as np
from jaxtyping import Float
from numba.extending import is_jitted

from stickslip.compiled import compiled
from stickslip.control.base import PositionController
from stickslip.control.checks import check_fields
from stickslip.control.feedback.friction_compensation import (
    FrictionCompensation,
    OnlineFriction,
    compensating_effort,
    physical,
)
from stickslip.control.feedback.linear_parts import (
    PD,
    Notch,
    NotchCoefficients,
    notch_step,
    pd_effort,
)
from stickslip.control.feedback.reference import PointToPoint, reference_at
from stickslip.errors import check_class, check_sampling_time
from stickslip.numerics.named_fields import fields_at, places
from stickslip.records import InputError, SensorSample, non_negative, positive, quantity_field

_METHOD = 5  # of a vector of these kernels
_STRAIGHT_THROUGH = NotchCoefficients(b0=1.0, b1=0.0, b2=0.0, a1=0.0, a2=0.0)

_HEAD = np.dtype(
    [
        # Settings
        ("method", "i8"),  # whose vector it is
        ("length", "i8"),  # of the vector
        ("position_gain", "f8"),
        ("velocity_gain", "f8"),
        ("inertia", "f8"),
        ("effort_limit", "f8"),
        ("notch", [(name, "f8") for name in NotchCoefficients._fields]),
        ("coulomb", "f8", (2,)),  # in positive, in negative direction
        ("viscous", "f8", (2,)),  # likewise
        ("offset", "f8"),
        ("measured", "i8"),  # 1: the measured velocity is compensated for, not the reference's
        ("dead_band", "f8"),
        ("coulomb_at", "i8"),  # places of the running estimates in the vector; 0 without any
        ("viscous_at", "i8"),
        ("needs_load", "i8"),
        ("estimator", "i8"),  # where the estimator's state begins, which is the rest of the vector
        ("moves", "i8"),
        # What changes
        ("z", "f8", (2,)),  # memory of the notch
        ("refused", "i8"),  # samples that the estimator did not take
    ]
)
_head = fields_at(_HEAD)
_REFERENCE = places(_HEAD)  # place of the first move
Vector = Float[np.ndarray, " s"]
Step = Callable[[Vector, SensorSample], tuple[Vector, float]]


@compiled()
def _command(vector: Float[np.ndarray, " s"], t: float, x: float, v: float) -> float:
    """Return the effort at time t, and advance the notch in place unless the effort is not finite.

    u = H(z) [K_p (r - x) + K_d (r' - v)] + J r'' + f_c sign(w) + c w + f_0, limited; w is the
    velocity compensated for (van de Wijdeven 2002 A section 6.2).

    Raises
    ------
    ValueError
        If the vector is not one of these kernels.
    """
    s = _head(vector)
    if vector.size < _REFERENCE or s.method != _METHOD or s.length != vector.size:
        raise ValueError("not a state of a FeedbackController: begin with the one of its init()")
    r, r_dot, r_ddot = reference_at(vector, _REFERENCE, s.moves, t)
    e = pd_effort(s.position_gain, s.velocity_gain, r, x, r_dot, v)
    y, z1, z2 = notch_step(s.notch, s.z[0], s.z[1], e)
    if s.coulomb_at > 0:
        f_pos = physical(float(vector[s.coulomb_at]))
        c_pos = physical(float(vector[s.viscous_at]))
        f_neg, c_neg = f_pos, c_pos
    else:
        f_pos, f_neg = s.coulomb[0], s.coulomb[1]
        c_pos, c_neg = s.viscous[0], s.viscous[1]
    w = v if s.measured else r_dot
    u = y + s.inertia * r_ddot + s.offset
    u += compensating_effort(f_pos, f_neg, c_pos, c_neg, w, s.dead_band)
    if not np.isfinite(u):
        return np.nan
    s.z[0], s.z[1] = z1, z2
    limit = s.effort_limit
    return min(max(u, -limit), limit)


@compiled()
def _step_alone(
    state: Float[np.ndarray, " s"], sample: SensorSample
) -> tuple[Float[np.ndarray, " s"], float]:
    """Take a sample, with no estimator running along."""
    vector = state.copy()
    return vector, _command(vector, sample.time, sample.measured_position, sample.measured_velocity)


def _step_for(kernel: Any) -> Step:
    """Return the step that feeds an estimator's kernel; compiled, and only once, when that is."""
    if kernel is None:
        return _step_alone
    return _compiled_step(kernel) if is_jitted(kernel) else _step_with(kernel)


@cache
def _compiled_step(kernel: Any) -> Step:
    return compiled(cached=False)(_step_with(kernel))


def _step_with(kernel: Any) -> Step:
    def step(state: Vector, sample: SensorSample) -> tuple[Vector, float]:
        vector = state.copy()
        x, v = sample.measured_position, sample.measured_velocity
        u = _command(vector, sample.time, x, v)
        if np.isfinite(u):
            s = _head(vector)
            x2, v2 = sample.measured_load_position, sample.measured_load_velocity
            if not s.needs_load:
                x2 = 0.0 if np.isnan(x2) else x2
                v2 = 0.0 if np.isnan(v2) else v2
            if not kernel(vector[s.estimator :], u, x, v, x2, v2):
                s.refused += 1
        return vector, u

    return step


@dataclass(frozen=True, kw_only=True)
class FeedbackController(PositionController[Float[np.ndarray, " s"]]):
    """PD action through a notch, plus friction compensation (van de Wijdeven 2002 A section 6.2).

    At each sample ``u = H [position_gain (r - x) + velocity_gain (r' - x')] + inertia r'' +
    friction``, held to the effort limit, with the notch ``H``. When the friction comes from a
    running estimate, the sample and the effort as limited are then handed to its estimator; the
    next sample's compensation uses what it has learned.

    All that the controller is and remembers is one vector, which `init` returns and `step` takes
    and leaves as it is. `step` is a compiled kernel (unless the estimator's is not): it serves a
    loop in Python as well as one that is compiled as a whole.

    Attributes
    ----------
    sampling_time
        That of the loop [s]; the notch is sampled with it.
    pd
        Gains.
    reference
        Where the axis is to be, from time 0 of the samples on.
    notch
        Filter of the PD action; None for none.
    compensation
        Of friction; None for none.
    inertia
        Fed forward with the reference's acceleration [kg or kg m^2]: the whole moving inertia or
        part of it; 0, as published, for none.
    effort_limit
        Largest magnitude of the effort [N or N m]; None for no limit.

    Raises
    ------
    InputError
        If a value is out of its range, a part is not of its class, the notch is too fast for the
        sampling time, or the estimator's state was made for another one.

    Examples
    --------
    >>> from stickslip.control import Move
    >>> from stickslip.friction import CoulombViscousFriction
    >>> from stickslip.plants import SingleMass
    >>> from stickslip.simulation import simulate_closed_loop
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=20.0)
    >>> controller = FeedbackController(
    ...     sampling_time=0.001,
    ...     pd=PD(position_gain=500.0, velocity_gain=30.0),
    ...     reference=PointToPoint(moves=(Move(target=0.1, duration=0.5, dwell=0.5),)),
    ...     compensation=FrictionCompensation(friction=law),
    ...     inertia=1.0,
    ...     effort_limit=10.0,
    ... )
    >>> run = simulate_closed_loop(SingleMass(mass=1.0, friction=law), controller,
    ...                            sampling_time=0.001, samples=1000)
    >>> error = run.motion.position - controller.reference.at(run.log.time).position
    >>> bool(abs(error).max() < 1e-3)
    True
    """

    sampling_time: float = quantity_field("sampling_time")
    pd: PD
    reference: PointToPoint
    notch: Notch | None = None
    compensation: FrictionCompensation | None = None
    inertia: float = quantity_field("inertia", default=0.0)
    effort_limit: float | None = quantity_field("effort", default=None)

    def __post_init__(self) -> None:
        check_fields(self, positive, {"sampling_time": "s"})
        check_fields(self, non_negative, {"inertia": "kg or kg m^2"})
        check_fields(self, positive, {"effort_limit": "N or N m"})
        check_class("pd", self.pd, PD)
        check_class("reference", self.reference, PointToPoint)
        check_class("notch", self.notch, Notch, NoneType)
        check_class("compensation", self.compensation, FrictionCompensation, NoneType)
        T = self.sampling_time
        if self.notch is not None:
            self.notch.coefficients(T)
        own = T if self.online is None else self.online.sampling_time
        check_sampling_time("the estimator's first state", own, "the controller", T)

    @property
    def online(self) -> OnlineFriction | None:
        """The estimator that runs along, if there is one."""
        friction = None if self.compensation is None else self.compensation.friction
        return friction if isinstance(friction, OnlineFriction) else None

    @property
    def step(self) -> Step:
        """The pure step ``step(state, sample) -> (state, effort)`` of a `SensorSample`.

        A sample whose position or velocity is not finite gives the effort NaN and leaves the state
        as it was; a vector that is not its state is a ValueError. The effort is for the time from
        this sample to the next.
        """
        online = self.online
        return _step_for(None if online is None else online.kernel)

    @property
    def channels(self) -> tuple[str, ...]:
        """Position and velocity."""
        return ("measured_position", "measured_velocity")

    def init(self) -> Float[np.ndarray, " s"]:
        """Return the state before the first sample."""
        online, table = self.online, self.reference.table
        learned = np.empty(0) if online is None else online.first_state
        estimator = _REFERENCE + table.size
        state = np.zeros(estimator + learned.size)
        s = _head(state)
        s.method, s.length = _METHOD, state.size
        s.position_gain, s.velocity_gain = self.pd.position_gain, self.pd.velocity_gain
        s.inertia = self.inertia
        s.effort_limit = np.inf if self.effort_limit is None else self.effort_limit
        s.notch = tuple(
            _STRAIGHT_THROUGH if self.notch is None else self.notch.coefficients(self.sampling_time)
        )
        if self.compensation is not None:
            s.measured = self.compensation.velocity == "measured"
            s.dead_band = self.compensation.dead_band
            law = self.compensation.friction
            if isinstance(law, OnlineFriction):
                coulomb, viscous = law.places
                s.coulomb_at, s.viscous_at = estimator + coulomb, estimator + viscous
                s.needs_load = law.needs_load
            else:
                s.coulomb = law.coulomb_friction_positive, law.coulomb_friction_negative
                s.viscous = law.viscous_friction_positive, law.viscous_friction_negative
                s.offset = law.offset
        s.estimator, s.moves = estimator, len(self.reference.moves)
        state[_REFERENCE:estimator] = table
        state[estimator:] = learned
        return state

    def estimator_state(self, state: Float[np.ndarray, " s"]) -> Float[np.ndarray, " e"]:
        """Return a copy of the state of the estimator that runs along, which there must be."""
        self._running()
        return state[int(_head(state).estimator) :].copy()

    def estimates(self, state: Float[np.ndarray, " s"]) -> dict[str, float]:
        """Return friction as estimated by the estimator that runs along [SI]; empty without one."""
        if self.online is None:
            return {}
        coulomb, viscous = self.estimator_state(state)[self.online.values_at].tolist()
        return {"coulomb_friction": coulomb, "viscous_friction": viscous}

    def deviations(self, state: Float[np.ndarray, " s"]) -> dict[str, float]:
        """Return standard deviations of these estimates [SI]; empty if they are not known."""
        online = self.online
        if online is None or online.covariance is None:
            return {}
        spread = np.sqrt(np.diag(online.covariance(self.estimator_state(state)))).tolist()
        order = [place - min(online.places) for place in online.places]
        return dict(zip(self.estimates(state), (spread[k] for k in order), strict=True))

    def refused_samples(self, state: Float[np.ndarray, " s"]) -> int:
        """Return how many samples the estimator could not take: not finite, or without the load."""
        self._running()
        return int(_head(state).refused)

    def resumed(self, estimator_state: Float[np.ndarray, " e"]) -> "FeedbackController":
        """Return the same controller, its estimator beginning with the given state.

        The state is that of an earlier run, from `estimator_state` [units of the estimator].
        """
        compensation, online = self._running()
        if estimator_state.shape != online.first_state.shape:
            raise InputError(
                "state_of_other_estimator",
                shape=estimator_state.shape,
                needed=online.first_state.shape,
            )
        again = replace(online, first_state=estimator_state)
        return replace(self, compensation=replace(compensation, friction=again))

    def _running(self) -> tuple[FrictionCompensation, OnlineFriction]:
        compensation, online = self.compensation, self.online
        if compensation is None or online is None:
            raise InputError("no_estimator")
        return compensation, online
