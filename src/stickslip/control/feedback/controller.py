"""The feedback controller of van de Wijdeven (2002): PD, notch and friction compensation."""

from dataclasses import dataclass, replace
from math import isclose

import numpy as np
from jaxtyping import Float

from stickslip.control.base import PositionController
from stickslip.control.feedback import kernel as at
from stickslip.control.feedback.friction_compensation import FrictionCompensation
from stickslip.control.feedback.notch import Notch, NotchCoefficients
from stickslip.control.feedback.online_friction import OnlineFriction
from stickslip.control.feedback.pd import PD
from stickslip.control.feedback.reference import PointToPoint
from stickslip.records import InputError, non_negative, positive, quantity_field

__all__ = ["FeedbackController"]

_STRAIGHT_THROUGH = NotchCoefficients(b0=1.0, b1=0.0, b2=0.0, a1=0.0, a2=0.0)
_SAME_SAMPLING_TIME = 1e-6  # relative; more than its rounding
# Name, class, whether None will do, and what to give
_PARTS = (
    ("pd", PD, False, "give PD(position_gain=..., velocity_gain=...)"),
    (
        "reference",
        PointToPoint,
        False,
        "give PointToPoint(moves=(Move(target=..., duration=...),)), or for another profile a "
        "controller of your own, with init() and step(state, sample)",
    ),
    ("notch", Notch, True, "give Notch(...) or Notch.at_resonance(...), or None for none"),
    (
        "compensation",
        FrictionCompensation,
        True,
        "give FrictionCompensation(friction=...), or None for none",
    ),
)


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
        T = positive("sampling_time", self.sampling_time, "s")
        object.__setattr__(self, "sampling_time", T)
        object.__setattr__(self, "inertia", non_negative("inertia", self.inertia, "kg or kg m^2"))
        if self.effort_limit is not None:
            limit = positive("effort_limit", self.effort_limit, "N or N m")
            object.__setattr__(self, "effort_limit", limit)
        for name, kind, optional, remedy in _PARTS:
            part = getattr(self, name)
            if not (isinstance(part, kind) or (optional and part is None)):
                raise InputError(
                    f"{name} must be a {kind.__name__}, it is a {type(part).__name__}",
                    remedy=remedy,
                )
        if self.notch is not None:
            self.notch.coefficients(T)
        own = T if self.online is None else self.online.sampling_time
        if not isclose(own, T, rel_tol=_SAME_SAMPLING_TIME):
            raise InputError(
                f"the estimator's first state was made for a sampling time of {own:.9g} s, the "
                f"controller has {T:.9g} s",
                remedy="make both for the sampling time of the loop",
            )

    @property
    def online(self) -> OnlineFriction | None:
        """The estimator that runs along, if there is one."""
        friction = None if self.compensation is None else self.compensation.friction
        return friction if isinstance(friction, OnlineFriction) else None

    @property
    def step(self) -> at.Step:
        """The pure step ``step(state, sample) -> (state, effort)`` of a `SensorSample`.

        A sample whose position or velocity is not finite gives the effort NaN and leaves the state
        as it was; a vector that is not its state is a ValueError. The effort is for the time from
        this sample to the next.
        """
        online = self.online
        return at.step_for(None if online is None else online.kernel)

    def init(self) -> Float[np.ndarray, " s"]:
        """Return the state before the first sample."""
        online, table = self.online, self.reference.table
        learned = np.empty(0) if online is None else online.first_state
        estimator = at.REFERENCE + table.size
        state = np.zeros(estimator + learned.size)
        s = at.head(state)
        s.method, s.length = at.METHOD, state.size
        s.position_gain, s.velocity_gain = self.pd.position_gain, self.pd.velocity_gain
        s.inertia = self.inertia
        s.effort_limit = np.inf if self.effort_limit is None else self.effort_limit
        s.notch = (
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
        state[at.REFERENCE : estimator] = table
        state[estimator:] = learned
        return state

    def estimator_state(self, state: Float[np.ndarray, " s"]) -> Float[np.ndarray, " e"]:
        """Return a copy of the state of the estimator that runs along.

        Parameters
        ----------
        state
            From `init`, a step, or a run's ``controller_state``.

        Raises
        ------
        InputError
            If no estimator runs along.
        """
        self._running()
        return state[int(at.head(state).estimator) :].copy()

    def estimates(self, state: Float[np.ndarray, " s"]) -> dict[str, float]:
        """Return friction as estimated by the estimator that runs along [SI]; empty without one.

        Parameters
        ----------
        state
            From `init`, a step, or a run's ``controller_state``.
        """
        if self.online is None:
            return {}
        coulomb, viscous = self.estimator_state(state)[self.online.values_at].tolist()
        return {"coulomb_friction": coulomb, "viscous_friction": viscous}

    def deviations(self, state: Float[np.ndarray, " s"]) -> dict[str, float]:
        """Return standard deviations of these estimates [SI]; empty if they are not known.

        Parameters
        ----------
        state
            From `init`, a step, or a run's ``controller_state``.
        """
        online = self.online
        if online is None or online.covariance is None:
            return {}
        spread = np.sqrt(np.diag(online.covariance(self.estimator_state(state)))).tolist()
        order = [place - min(online.places) for place in online.places]
        return dict(zip(self.estimates(state), (spread[k] for k in order), strict=True))

    def refused_samples(self, state: Float[np.ndarray, " s"]) -> int:
        """Return how many samples the estimator could not take: not finite, or without the load.

        Parameters
        ----------
        state
            From a step, or a run's ``controller_state``.

        Raises
        ------
        InputError
            If no estimator runs along.
        """
        self._running()
        return int(at.head(state).refused)

    def resumed(self, estimator_state: Float[np.ndarray, " e"]) -> "FeedbackController":
        """Return the same controller, its estimator beginning with the given state.

        Parameters
        ----------
        estimator_state
            Of an earlier run, from `estimator_state` [units of the estimator].

        Raises
        ------
        InputError
            If no estimator runs along, or the state has not the size of its first state.
        """
        compensation, online = self._running()
        if estimator_state.shape != online.first_state.shape:
            raise InputError(
                f"the estimator's state has shape {estimator_state.shape}, its first state has "
                f"{online.first_state.shape}",
                remedy="give what estimator_state returned for a run of this controller",
            )
        again = replace(online, first_state=estimator_state)
        return replace(self, compensation=replace(compensation, friction=again))

    def _running(self) -> tuple[FrictionCompensation, OnlineFriction]:
        compensation, online = self.compensation, self.online
        if compensation is None or online is None:
            raise InputError(
                "no estimator runs along with this controller",
                remedy="give compensation=FrictionCompensation(friction=OnlineFriction(...))",
            )
        return compensation, online
