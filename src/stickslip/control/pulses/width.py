"""Adaptive pulse width control of Yang and Tomizuka (van de Wijdeven 2002, B, Eqs. 4-13)."""

from dataclasses import dataclass, replace
from math import sqrt
from typing import Any, ClassVar, Literal

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.pulses.kernel import (
    MOVING,
    OWN,
    add_level,
    emit,
    fire,
    head,
    readable,
    stop,
    watch,
    whole_samples,
)
from stickslip.control.pulses.published import PublishedPulseController
from stickslip.control.pulses.settings import checked_share
from stickslip.numerics.named_fields import fields_at, places
from stickslip.records import (
    InputError,
    LearnedPulses,
    PulseMethod,
    SensorSample,
    positive,
    quantity_field,
)

__all__ = ["PulseWidthController"]

_METHOD = 1  # in the vector

_OWN = np.dtype(
    [
        ("effort", "f8"),
        ("period", "f8"),  # sampling time
        ("longest", "f8"),  # pulse [s]
        ("gain", "f8"),  # K_c
        ("lambda_1", "f8"),
        ("lambda_2", "f8"),
        ("applied", "i8"),  # 1 to learn from whole samples
        ("max_idle_pulses", "f8"),
        ("b", "f8"),
        ("F_inverse", "f8"),
        ("u", "f8"),  # regressor of the pulse on its way
    ]
)
_own_fields = fields_at(_OWN, start=OWN)


@compiled()
def _learn(s: Any, own: Any) -> None:
    """Take in what the last pulse did (Eqs. 11-13)."""
    u, d = own.u, s.last.achieved
    own.F_inverse = own.lambda_1 * own.F_inverse + own.lambda_2 * u * u
    own.b += u * (d - own.b * u) / own.F_inverse


@compiled()
def _plan(s: Any, own: Any) -> None:
    """Fire the pulse of Eqs. 7, 9 and 10, its width rounded up to whole samples."""
    e, b, T = s.error, own.b, own.period
    if not b > 0.0 or s.idle >= own.max_idle_pulses:
        stop(s)
        return
    sign = 1.0 if e > 0.0 else -1.0
    t_p = min(sqrt(own.gain * abs(e) / b), own.longest)
    n = whole_samples(t_p, T)
    if own.applied:
        t_p = n * T
    own.u = sign * t_p * t_p
    fire(s, b * own.u)
    add_level(s, sign * own.effort, n)


@compiled()
def _step(
    state: Float[np.ndarray, " s"], sample: SensorSample
) -> tuple[Float[np.ndarray, " s"], float]:
    """Take a sample."""
    vector = state.copy()
    if not readable(vector, _METHOD, sample):
        return vector, np.nan
    s, own = head(vector), _own_fields(vector)
    if watch(vector, sample):
        if s.fresh and s.last.moved:
            _learn(s, own)
        if s.outcome == MOVING:
            _plan(s, own)
    return vector, emit(s)


@dataclass(frozen=True, kw_only=True)
class PulseWidthController(PublishedPulseController):
    """Adaptive pulse width control, PWC: pulses of one effort and of many widths.

    A pulse of width ``t_p`` is taken to move the axis by ``b t_p^2``, without viscous friction;
    ``b`` is estimated pulse by pulse. The width that the error asks for is rounded up to whole
    samples, so that the smallest motion is that of one sample at full effort. With a tolerance
    below it the axis goes to and fro across the target for ever (`PulseAmplitudeWidthController`
    does so rarely).

    Attributes
    ----------
    first_gain
        First guess of ``b``, the displacement of a pulse over its squared width; `from_friction`
        takes it from mass and Coulomb friction.
    new_data_weight
        ``lambda_2``, in [0, 2), of the recursion [-]; the forgetting factor is ``lambda_1``.
    initial_covariance
        ``F(0)`` of the recursion [1/s^4]: the larger, the less the first guess counts.
    regressor
        Whether to learn from the width as calculated (``"nominal"``, as published) or from
        whole samples (``"applied"``).

    Raises
    ------
    InputError
        If a value is out of its range.

    Examples
    --------
    >>> from stickslip.control import RestDetection
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

    first_gain: float = quantity_field("pulse_gain")
    new_data_weight: float = 1.0
    initial_covariance: float = 1e5
    regressor: Literal["nominal", "applied"] = "nominal"
    method: ClassVar[PulseMethod] = "pwc"
    _kernel: ClassVar[Any] = _step

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_positive("first_gain")
        checked_share("new_data_weight", self.new_data_weight, 2.0, ends="low", usual=1.0)
        positive("initial_covariance", self.initial_covariance, "1/s^4")
        if self.regressor not in ("nominal", "applied"):
            raise InputError(
                f"regressor is {self.regressor!r}", remedy="give 'nominal' or 'applied'"
            )

    @classmethod
    def _first_gains(
        cls, mass: float, coulomb_friction: float, pulse_effort: float
    ) -> dict[str, float]:
        f_p, f_c = pulse_effort, coulomb_friction
        return {"first_gain": f_p * (f_p - f_c) / (2.0 * mass * f_c)}

    def init(self) -> Float[np.ndarray, " s"]:
        """Return the state before the first sample."""
        state = self._first_state(_METHOD, places(_OWN))
        own = _own_fields(state)
        own.effort, own.period, own.longest = self.pulse_effort, self.sampling_time, self._longest
        own.gain, own.max_idle_pulses = self.gain, self._most_idle_pulses
        own.lambda_1, own.lambda_2 = self.forgetting, self.new_data_weight
        own.applied = self.regressor == "applied"
        own.b, own.F_inverse = self.first_gain, 1.0 / self.initial_covariance
        return state

    def estimates(self, state: Float[np.ndarray, " s"]) -> dict[str, float]:
        """Return the estimate of ``b`` as ``pulse_gain`` [m/s^2 or rad/s^2].

        Parameters
        ----------
        state
            From `init`, a step, or a run's ``controller_state``.
        """
        return {"pulse_gain": float(_own_fields(state).b)}

    def learned(self, state: Float[np.ndarray, " s"]) -> LearnedPulses:
        """Return the estimate, and the effort that it is for.

        Parameters
        ----------
        state
            As for `estimates`.
        """
        return LearnedPulses(
            method=self.method,
            kind=self.kind,
            values={**self.estimates(state), "effort": self.pulse_effort},
            covariance=np.array([[1.0 / _own_fields(state).F_inverse]]),
        )

    def resumed(
        self, learned: LearnedPulses, *, keep_covariance: bool = True
    ) -> "PulseWidthController":
        """Return the same controller, beginning with what an earlier run has learned.

        Parameters
        ----------
        learned, keep_covariance
            As of the base class.

        Raises
        ------
        InputError
            If it was learned by another method, on another kind of axis, for another effort, or
            is no possible estimate.
        """
        self._check_learned(learned, ("pulse_gain", "effort"), 1)
        if learned.values["effort"] != self.pulse_effort:
            unit = self._unit("pulse_effort")
            raise InputError(
                f"this was learned with pulses of {learned.values['effort']:g} {unit}, the "
                f"controller's are of {self.pulse_effort:g} {unit}",
                where="values.effort",
                remedy="resume with the same pulse_effort, or learn anew",
            )
        covariance = float(learned.covariance[0, 0])
        return replace(
            self,
            first_gain=learned.values["pulse_gain"],
            initial_covariance=covariance if keep_covariance else self.initial_covariance,
        )
