"""Adaptive pulse amplitude pulse width control (van de Wijdeven 2002, B, Eqs. 14-22)."""

from dataclasses import dataclass, replace
from math import inf, isfinite, sqrt
from typing import Any, ClassVar, Literal

import numpy as np
from jaxtyping import Float

from stickslip.control.pulses import amplitude_width_kernel as at
from stickslip.control.pulses.published import PublishedPulseController
from stickslip.control.pulses.settings import checked_share
from stickslip.numerics.named_fields import places
from stickslip.records import (
    InputError,
    LearnedPulses,
    PulseMethod,
    quantity_field,
)

__all__ = ["PulseAmplitudeWidthController"]

_REGRESSORS = {"applied": at.APPLIED, "nominal": at.NOMINAL, "printed": at.PRINTED}
_ROUNDED = 1e-9  # what is carried on may have been rounded by so much of itself


@dataclass(frozen=True, kw_only=True)
class PulseAmplitudeWidthController(PublishedPulseController):
    """Adaptive pulse amplitude pulse width control, PAPWC: whole samples, trimmed effort.

    A pulse of effort f and width t is taken to move the axis by ``(A1 f |f| - A2 f) t^2``, without
    viscous friction: ``A1 = 1/(2 m f_c)``, ``A2 = 1/(2 m)``. Both are estimated pulse by pulse, and
    the Coulomb friction is ``A2 / A1``. The width for full effort is rounded up to whole samples
    and the effort lowered to make up for it, so that steps are far smaller than those of pulse
    width control; the smallest is where the effort no longer breaks the axis away.

    Attributes
    ----------
    first_gain_1, first_gain_2
        First guesses of ``A1`` and ``A2``; `from_friction` takes them from mass and Coulomb
        friction.
    initial_covariance
        ``P(0)`` of the recursion: a number, for that times the identity, or its entries ``(P11,
        P12, P22)`` [1/(N s)^4, 1/(N^3 s^4), 1/(N^2 s^4); with N m for N on a rotary axis]. The
        published 1e-5 leaves A2 almost as it is; 1e5, its other reading, learns both. On another
        axis, ``(first_gain_1/d)**2`` lets the first guess weigh as much as one pulse of length d.
    friction_margin
        The estimated Coulomb friction is kept at least this share of ``pulse_effort`` away from 0
        and from ``pulse_effort``, between which it must lie for the plan to exist [-]; None to let
        it go where it will, as printed.
    regressor
        ``"applied"``: effort and width of the pulse that was fired; ``"nominal"``: full effort and
        the width before rounding, from which only one combination of A1 and A2 can be learned;
        ``"printed"``: the same with the published sign of A2, which is wrong.

    Raises
    ------
    InputError
        If a value is out of its range.

    Notes
    -----
    An estimate outside the range is taken to its edge where the recursion's own measure of
    distance, the inverse of P, is least.

    Examples
    --------
    >>> from stickslip.control import RestDetection
    >>> from stickslip.friction import CoulombViscousFriction
    >>> from stickslip.plants import SingleMass
    >>> from stickslip.simulation import simulate_closed_loop
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=100.0, static_friction=130.0,
    ...                                        viscous_friction=700.0)
    >>> controller = PulseAmplitudeWidthController.from_friction(
    ...     mass=150.0, coulomb_friction=80.0, pulse_effort=300.0, sampling_time=0.01,
    ...     target=0.01, tolerance=2e-5, rest=RestDetection(samples=1, spread=0.0, speed=0.0),
    ...     longest_width=0.03)
    >>> run = simulate_closed_loop(SingleMass(mass=150.0, friction=law), controller,
    ...                            sampling_time=0.01, samples=200)
    >>> controller.outcome(run.controller_state).value
    'reached'
    >>> controller.pulse_count(run.controller_state)
    10
    """

    first_gain_1: float = quantity_field("gain_1")
    first_gain_2: float = quantity_field("gain_2")
    initial_covariance: float | tuple[float, float, float] = 1e-5
    friction_margin: float | None = 0.01
    regressor: Literal["applied", "nominal", "printed"] = "applied"
    method: ClassVar[PulseMethod] = "papwc"
    _kernel: ClassVar[Any] = at.papwc_step

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("first_gain_1", "first_gain_2"):
            self._check_positive(name)
        P11, P12, P22 = self._covariance
        definite = P11 > 0.0 and P22 > 0.0 and P12 * P12 <= P11 * P22 * (1.0 + _ROUNDED)
        if not (definite and isfinite(P11 + P22)):
            raise InputError(
                f"initial_covariance is ({P11:g}, {P12:g}, {P22:g}), it must be positive definite",
                remedy="give a positive number, for that times the identity",
            )
        margin = self.friction_margin
        if margin is not None:
            checked_share("friction_margin", margin, 0.5, ends="", usual=0.01)
        if self.regressor not in _REGRESSORS:
            raise InputError(
                f"regressor is {self.regressor!r}",
                remedy=f"give one of {', '.join(_REGRESSORS)}",
            )
        f_c, f_p, unit = self.coulomb_friction, self.pulse_effort, self._unit("pulse_effort")
        edge = _ROUNDED * f_p if margin is None else (margin - _ROUNDED) * f_p
        if not edge <= f_c <= f_p - edge:
            raise InputError(
                f"the first guess of the Coulomb friction, first_gain_2 / first_gain_1, is "
                f"{f_c:g} {unit}; with pulse_effort {f_p:g} {unit} it must lie between {edge:g} "
                f"and {f_p - edge:g} {unit}",
                remedy="give a smaller first guess, or allow more effort"
                if f_c > edge
                else "give a larger first guess, or pulses of less effort",
            )

    @property
    def _covariance(self) -> tuple[float, float, float]:
        P = self.initial_covariance
        return P if isinstance(P, tuple) else (P, 0.0, P)

    @property
    def coulomb_friction(self) -> float:
        """First guess of the Coulomb friction [N or N m]."""
        return self.first_gain_2 / self.first_gain_1

    @classmethod
    def _first_gains(
        cls, mass: float, coulomb_friction: float, pulse_effort: float
    ) -> dict[str, float]:
        del pulse_effort
        return {
            "first_gain_1": 1.0 / (2.0 * mass * coulomb_friction),
            "first_gain_2": 1.0 / (2.0 * mass),
        }

    def init(self) -> Float[np.ndarray, " s"]:
        """Return the state before the first sample."""
        f_p, margin = self.pulse_effort, self.friction_margin
        P11, P12, P22 = self._covariance
        S11, S21 = sqrt(P11), P12 / sqrt(P11)
        state = self._first_state(at.METHOD, places(at.OWN_DTYPE))
        own = at.own_fields(state)
        own.effort, own.period, own.longest = f_p, self.sampling_time, self._longest
        own.gain, own.forgetting, own.max_idle_pulses = (
            self.gain,
            self.forgetting,
            self._most_idle_pulses,
        )
        own.low = -inf if margin is None else margin * f_p
        own.high = inf if margin is None else (1.0 - margin) * f_p
        own.regressor = _REGRESSORS[self.regressor]
        own.A_1, own.A_2 = self.first_gain_1, self.first_gain_2
        own.S = [[S11, 0.0], [S21, sqrt(max(P22 - S21 * S21, 0.0))]]
        return state

    def estimates(self, state: Float[np.ndarray, " s"]) -> dict[str, float]:
        """Return the estimates by name, and what follows from them.

        ``gain_1`` and ``gain_2`` are ``A1`` [m/(N s)^2] and ``A2`` [m/(N s^2)];
        ``coulomb_friction`` their ratio [N], ``pulse_gain`` the displacement at full effort over
        squared width, ``b`` [m/s^2]. On a rotary axis rad stands for m and N m for N.

        Parameters
        ----------
        state
            From `init`, a step, or a run's ``controller_state``.
        """
        own, f_p = at.own_fields(state), self.pulse_effort
        A_1, A_2 = float(own.A_1), float(own.A_2)
        return {
            "gain_1": A_1,
            "gain_2": A_2,
            "coulomb_friction": A_2 / A_1 if A_1 else inf,
            "pulse_gain": A_1 * f_p * f_p - A_2 * f_p,
        }

    def learned(self, state: Float[np.ndarray, " s"]) -> LearnedPulses:
        """Return the two gains and their covariance.

        Parameters
        ----------
        state
            As for `estimates`.
        """
        own = at.own_fields(state)
        return LearnedPulses(
            method=self.method,
            kind=self.kind,
            values={"gain_1": float(own.A_1), "gain_2": float(own.A_2)},
            covariance=own.S @ own.S.T,
        )

    def resumed(
        self, learned: LearnedPulses, *, keep_covariance: bool = True
    ) -> "PulseAmplitudeWidthController":
        """Return the same controller, beginning with what an earlier run has learned.

        Parameters
        ----------
        learned, keep_covariance
            As of the base class.

        Raises
        ------
        InputError
            If it was learned by another method, on another kind of axis, or is no possible
            estimate with this controller's effort.
        """
        self._check_learned(learned, ("gain_1", "gain_2"), 2)
        (P11, P12), (_, P22) = learned.covariance.tolist()
        return replace(
            self,
            first_gain_1=learned.values["gain_1"],
            first_gain_2=learned.values["gain_2"],
            initial_covariance=(P11, P12, P22) if keep_covariance else self.initial_covariance,
        )
