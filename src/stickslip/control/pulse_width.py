"""Adaptive pulse width control of Yang and Tomizuka (van de Wijdeven 2002, B, Eqs. 4-13)."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf, sqrt
from typing import Literal

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.pulse_controller import PulseController
from stickslip.control.pulse_kernel import (
    AT_ACHIEVED,
    AT_MOVED,
    ERROR,
    FRESH,
    IDLE,
    LAST,
    MOVING,
    OUTCOME,
    OWN,
    add_level,
    emit,
    fire,
    readable,
    stop,
    watch,
    whole_samples,
)
from stickslip.control.pulse_settings import (
    checked_first_friction,
    checked_patience,
    checked_share,
    longest_samples,
)
from stickslip.control.rest_detection import RestDetection
from stickslip.records import (
    AxisKind,
    InputError,
    LearntPulses,
    PulseMethod,
    SensorSample,
    positive,
    quantity_field,
)

__all__ = ["PulseWidthController"]

_METHOD = 1.0  # in the vector

(
    _EFFORT,
    _T,
    _LONGEST,
    _GAIN,
    _LAMBDA_1,
    _LAMBDA_2,
    _APPLIED,
    _PATIENCE,
    _B,
    _F_INVERSE,
    _U,  # regressor of the pulse on its way
) = range(OWN, OWN + 11)


@compiled()
def _learn(s: Float[np.ndarray, " s"]) -> None:
    """Take in what the last pulse did (Eqs. 11-13)."""
    u, d = s[_U], s[LAST + AT_ACHIEVED]
    s[_F_INVERSE] = s[_LAMBDA_1] * s[_F_INVERSE] + s[_LAMBDA_2] * u * u
    s[_B] += u * (d - s[_B] * u) / s[_F_INVERSE]


@compiled()
def _plan(s: Float[np.ndarray, " s"]) -> None:
    """Fire the pulse of Eqs. 7, 9 and 10, its width rounded up to whole samples."""
    e, b, T = s[ERROR], s[_B], s[_T]
    if not b > 0.0 or s[IDLE] >= s[_PATIENCE]:
        stop(s)
        return
    sign = 1.0 if e > 0.0 else -1.0
    t_p = min(sqrt(s[_GAIN] * abs(e) / b), s[_LONGEST])
    n = whole_samples(t_p, T)
    if s[_APPLIED] > 0.0:
        t_p = n * T
    s[_U] = sign * t_p * t_p
    fire(s, b * s[_U])
    add_level(s, sign * s[_EFFORT], n)


@compiled()
def _step(
    state: Float[np.ndarray, " s"], sample: SensorSample
) -> tuple[Float[np.ndarray, " s"], float]:
    """Take a sample."""
    s = state.copy()
    if not readable(s, _METHOD, sample):
        return s, np.nan
    if watch(s, sample):
        if s[FRESH] > 0.0 and s[LAST + AT_MOVED] > 0.0:
            _learn(s)
        if s[OUTCOME] == MOVING:
            _plan(s)
    return s, emit(s)


@dataclass(frozen=True, kw_only=True)
class PulseWidthController(PulseController):
    """Adaptive pulse width control, PWC: pulses of one effort and of many widths.

    A pulse of width ``t_p`` is taken to move the axis by ``b t_p^2``, without viscous friction;
    ``b`` is estimated pulse by pulse. The width that the error asks for is rounded up to whole
    samples, so that the smallest motion is that of one sample at full effort. With a tolerance
    below it the axis goes to and fro across the target for ever (`PulseAmplitudeWidthController`
    does so rarely).

    Attributes
    ----------
    pulse_effort
        Of every pulse; more than the axis needs to break away.
    first_gain
        First guess of ``b``, the displacement of a pulse over its squared width; `from_friction`
        takes it from mass and Coulomb friction.
    gain
        Share of the error that a pulse is to take away, ``K_c`` [-]; between 0 and 2.
    longest_width
        Of a pulse, rounded down to whole samples; None for no limit.
    forgetting, new_data_weight
        ``lambda_1``, in (0, 1], and ``lambda_2``, in [0, 2), of the recursion [-].
    initial_covariance
        ``F(0)`` of the recursion [1/s^4]: the larger, the less the first guess counts.
    regressor
        Whether to learn from the width as calculated (``"nominal"``, as published) or from
        whole samples (``"applied"``).
    patience
        After so many pulses in a row that did not move the axis it stops; None to go on, as
        published.

    Raises
    ------
    InputError
        If a value is out of its range.

    Examples
    --------
    >>> from stickslip.friction import CoulombViscousFriction
    >>> from stickslip.plants import SingleMass
    >>> from stickslip.simulation import simulate_closed_loop
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=100.0, static_friction=130.0,
    ...                                        viscous_friction=700.0)
    >>> controller = PulseWidthController.from_friction(
    ...     mass=150.0, coulomb_friction=80.0, pulse_effort=300.0, sampling_time=0.01,
    ...     target=0.01, tolerance=2e-4, rest=RestDetection(samples=1, spread=0.0, speed=0.0))
    >>> run = simulate_closed_loop(SingleMass(mass=150.0, friction=law), controller,
    ...                            sampling_time=0.01, samples=200)
    >>> controller.outcome(run.controller_state).value
    'reached'
    """

    pulse_effort: float = quantity_field("effort")
    first_gain: float = quantity_field("pulse_gain")
    gain: float = 1.0
    longest_width: float | None = quantity_field("time", default=None)
    forgetting: float = 1.0
    new_data_weight: float = 1.0
    initial_covariance: float = 1e5
    regressor: Literal["nominal", "applied"] = "nominal"
    patience: int | None = 3

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("pulse_effort", "first_gain"):
            self._check_positive(name)
        checked_share("gain", self.gain, 2.0, ends="", usual=1.0)
        checked_share("forgetting", self.forgetting, 1.0, ends="high", usual=1.0)
        checked_share("new_data_weight", self.new_data_weight, 2.0, ends="low", usual=1.0)
        longest_samples(self.longest_width, self.sampling_time)
        positive("initial_covariance", self.initial_covariance, "1/s^4")
        if self.regressor not in ("nominal", "applied"):
            raise InputError(
                f"regressor is {self.regressor!r}", remedy="give 'nominal' or 'applied'"
            )
        checked_patience(self.patience)

    @classmethod
    def from_friction(
        cls,
        *,
        mass: float,
        coulomb_friction: float,
        static_friction: float | None = None,
        pulse_effort: float,
        sampling_time: float,
        target: float,
        tolerance: float,
        rest: RestDetection,
        kind: AxisKind = "linear",
        gain: float = 1.0,
        longest_width: float | None = None,
        patience: int | None = 3,
    ) -> "PulseWidthController":
        """Return one whose first guess follows from mass and friction (Eq. 4).

        Parameters
        ----------
        mass
            Moving mass or inertia [kg or kg m^2].
        coulomb_friction
            First guess of it [N or N m].
        static_friction
            Effort it takes to break away, if known; the pulses must exceed it [N or N m].
        pulse_effort, sampling_time, target, tolerance, gain, longest_width
            As of the class [N or N m, s, m or rad, m or rad, -, s].
        rest, kind, patience
            As of the class.

        Raises
        ------
        InputError
            If a value is out of its range, or the pulses cannot overcome the friction.
        """
        f_p, f_c = pulse_effort, coulomb_friction
        checked_first_friction(mass, f_c, static_friction, f_p, kind)
        return cls(
            first_gain=f_p * (f_p - f_c) / (2.0 * mass * f_c),
            pulse_effort=f_p,
            sampling_time=sampling_time,
            target=target,
            tolerance=tolerance,
            rest=rest,
            kind=kind,
            gain=gain,
            longest_width=longest_width,
            patience=patience,
        )

    @property
    def method(self) -> PulseMethod:
        """``"pwc"``."""
        return "pwc"

    @property
    def step(
        self,
    ) -> Callable[[Float[np.ndarray, " s"], SensorSample], tuple[Float[np.ndarray, " s"], float]]:
        """As of the base class."""
        return _step

    def init(self) -> Float[np.ndarray, " s"]:
        """Return the state before the first sample."""
        T = self.sampling_time
        return self._first_state(
            _METHOD,
            (
                self.pulse_effort,
                T,
                longest_samples(self.longest_width, T) * T,
                self.gain,
                self.forgetting,
                self.new_data_weight,
                float(self.regressor == "applied"),
                inf if self.patience is None else float(self.patience),
                self.first_gain,
                1.0 / self.initial_covariance,
                0.0,
            ),
        )

    def estimates(self, state: Float[np.ndarray, " s"]) -> dict[str, float]:
        """Return the estimate of ``b`` as ``pulse_gain`` [m/s^2 or rad/s^2].

        Parameters
        ----------
        state
            From `init`, a step, or a run's ``controller_state``.
        """
        return {"pulse_gain": float(state[_B])}

    def learnt(self, state: Float[np.ndarray, " s"]) -> LearntPulses:
        """Return the estimate, and the effort that it is for.

        Parameters
        ----------
        state
            As for `estimates`.
        """
        return LearntPulses(
            method=self.method,
            kind=self.kind,
            values={**self.estimates(state), "effort": self.pulse_effort},
            covariance=np.array([[1.0 / state[_F_INVERSE]]]),
        )

    def resumed(
        self, learnt: LearntPulses, *, keep_covariance: bool = True
    ) -> "PulseWidthController":
        """Return the same controller, beginning with what an earlier run has learned.

        Parameters
        ----------
        learnt, keep_covariance
            As of the base class.

        Raises
        ------
        InputError
            If it was learned by another method, on another kind of axis, for another effort, or
            is no possible estimate.
        """
        self._check_learnt(learnt, ("pulse_gain", "effort"), 1)
        if learnt.values["effort"] != self.pulse_effort:
            unit = self._unit("pulse_effort")
            raise InputError(
                f"this was learned with pulses of {learnt.values['effort']:g} {unit}, the "
                f"controller's are of {self.pulse_effort:g} {unit}",
                where="values.effort",
                remedy="resume with the same pulse_effort, or learn anew",
            )
        covariance = float(learnt.covariance[0, 0])
        return replace(
            self,
            first_gain=learnt.values["pulse_gain"],
            initial_covariance=covariance if keep_covariance else self.initial_covariance,
        )
