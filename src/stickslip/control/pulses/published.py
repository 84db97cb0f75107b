"""Adaptive pulse width control (PWC) and pulse amplitude pulse width control (PAPWC).

Van de Wijdeven (2002) B: PWC of Yang and Tomizuka, Eqs. 4-13, and PAPWC, Eqs. 14-22. Both take a
pulse to move an axis without viscous friction by a gain times the squared width, estimate the gain
from pulse to pulse, and fire pulses of one level.
"""

from abc import abstractmethod
from dataclasses import dataclass, replace
from math import inf, isfinite, sqrt
from typing import Any, ClassVar, Literal, TypeVar

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.pulses.controller import (
    PulseController,
    checked_share,
    longest_samples,
)
from stickslip.control.pulses.kernel import (
    MOVING,
    OWN,
    PAPWC,
    PWC,
    add_level,
    emit,
    fire,
    head,
    readable,
    stop,
    watch,
    whole_samples,
)
from stickslip.control.rest_detection import RestDetection
from stickslip.numerics.named_fields import fields_at, places
from stickslip.records import (
    InputError,
    LearnedPulses,
    PulseMethod,
    SensorSample,
    one_of,
    positive,
    quantity_field,
    whole,
)

_REGRESSORS = {"applied": 0, "nominal": 1, "printed": 2}
_APPLIED, _NOMINAL, _PRINTED = _REGRESSORS.values()
_ROUNDED = 1e-9  # relative: by so much a saved value may have been rounded

_OWN_DTYPE = np.dtype(
    [
        # Settings
        ("effort", "f8"),
        ("period", "f8"),  # sampling time
        ("longest", "f8"),  # pulse [s]
        ("gain", "f8"),  # K_c
        ("forgetting", "f8"),  # lambda, lambda_1
        ("new_data_weight", "f8"),  # lambda_2
        ("low", "f8"),  # range of the estimated Coulomb friction; infinite when it is not kept
        ("high", "f8"),
        ("regressor", "i8"),
        ("max_idle_pulses", "f8"),
        # What changes
        ("b", "f8"),  # of PWC, as F_inverse is
        ("F_inverse", "f8"),
        ("A", "f8", (2,)),  # A_1 and A_2 of PAPWC
        ("S", "f8", (2, 2)),  # P = S S', so that it stays definite however large P(0) is
        ("u", "f8", (2,)),  # regressor of the current pulse; of PWC the first
    ]
)
_own_fields = fields_at(_OWN_DTYPE, start=OWN)


@compiled()
def trimmed_effort(f_p: float, f_c: float, t_p: float, T_x: float) -> float:
    """Return the effort that does in T_x what f_p does in t_p (Eq. 15), at most f_p."""
    root = f_c * f_c + 4.0 * f_p * (f_p - f_c) * (t_p / T_x) ** 2
    return min(0.5 * (f_c + sqrt(root)), f_p)


@compiled()
def in_range(
    a: tuple[float, float], S: tuple[float, float, float, float], low: float, high: float
) -> tuple[float, float]:
    """Return the estimate [A_1, A_2], with A_2/A_1 taken into [low, high] if it is outside.

    Of the points on the edges w = [1, h], h = low or high, it is the one nearest to a in the metric
    G = P^-1, P = S S' with S by rows: w (w' G a) / (w' G w). NaN if both would need a negative A_1.
    """
    A_1, A_2 = a
    if A_1 > 0.0 and low * A_1 <= A_2 <= high * A_1:
        return a
    S_11, S_12, S_21, S_22 = S
    # S^-1 a and S^-1 w but for the determinant, which cancels
    r_1, r_2 = S_22 * A_1 - S_12 * A_2, S_11 * A_2 - S_21 * A_1
    nearest, edge, scale = 0.0, np.nan, np.nan
    for h in (low, high):
        q_1, q_2 = S_22 - S_12 * h, S_11 * h - S_21
        along, square = q_1 * r_1 + q_2 * r_2, q_1 * q_1 + q_2 * q_2
        if along > 0.0 and along * along > nearest * square:
            nearest, edge, scale = along * along / square, h, along / square
    return scale, edge * scale


@compiled()
def _learn_gain(s: Any, own: Any) -> None:
    """Update b of PWC with the last pulse (Eqs. 11-13)."""
    u, d = own.u[0], s.last.achieved
    own.F_inverse = own.forgetting * own.F_inverse + own.new_data_weight * u * u
    own.b += u * (d - own.b * u) / own.F_inverse


@compiled()
def _learn_gains(s: Any, own: Any) -> None:
    """Update A_1 and A_2 of PAPWC with the last pulse (Eqs. 17-21), if the result is possible.

    With P = S S' and phi = S' u, pi = S phi (Eq. 17), and Eqs. 18 and 19 are (Potter)
    S <- [S - pi phi' / (beta + sqrt(lambda beta))] / sqrt(lambda), beta = lambda + phi' phi.
    """
    u_1, u_2, lam = own.u[0], own.u[1], own.forgetting
    s_11, s_12, s_21, s_22 = own.S[0, 0], own.S[0, 1], own.S[1, 0], own.S[1, 1]
    phi_1, phi_2 = s_11 * u_1 + s_21 * u_2, s_12 * u_1 + s_22 * u_2
    pi_1, pi_2 = s_11 * phi_1 + s_12 * phi_2, s_21 * phi_1 + s_22 * phi_2
    beta = lam + phi_1 * phi_1 + phi_2 * phi_2
    xi = s.last.achieved - own.A[0] * u_1 - own.A[1] * u_2
    a = (own.A[0] + pi_1 / beta * xi, own.A[1] + pi_2 / beta * xi)
    gamma, root = 1.0 / (beta + sqrt(lam * beta)), sqrt(lam)
    S = (
        (s_11 - gamma * pi_1 * phi_1) / root,
        (s_12 - gamma * pi_1 * phi_2) / root,
        (s_21 - gamma * pi_2 * phi_1) / root,
        (s_22 - gamma * pi_2 * phi_2) / root,
    )
    if own.high < np.inf:
        a = in_range(a, S, own.low, own.high)
    if np.isfinite(a[0] + a[1] + S[0] + S[1] + S[2] + S[3]):
        own.A[0], own.A[1] = a
        own.S[0, 0], own.S[0, 1], own.S[1, 0], own.S[1, 1] = S


@compiled()
def _plan(s: Any, own: Any) -> None:
    """Fire the pulse of Eqs. 7, 9 and 10, its width rounded up to whole samples.

    PAPWC trims its effort by as much as the width is longer (Eqs. 14-16).
    """
    f_p, T = own.effort, own.period
    b, f_c = own.b, 0.0
    if s.method == PAPWC:
        b = own.A[0] * f_p * f_p - own.A[1] * f_p  # Eq. 16
        f_c = own.A[1] / own.A[0]
    if not (b > 0.0 and f_c < f_p) or s.idle >= own.max_idle_pulses:
        stop(s)
        return
    sign = 1.0 if s.error > 0.0 else -1.0
    t_p = min(sqrt(own.gain * abs(s.error) / b), own.longest)
    n = whole_samples(t_p, T)
    T_x = n * T
    if s.method == PWC:
        t = T_x if own.regressor == _APPLIED else t_p
        own.u[0] = sign * t * t
        fire(s, b * own.u[0])
        add_level(s, sign * f_p, n)
        return
    f = sign * trimmed_effort(f_p, f_c, t_p, T_x)
    f_n = sign * f_p
    if own.regressor == _APPLIED:
        own.u[0], own.u[1] = T_x * T_x * f * abs(f), -T_x * T_x * f
    elif own.regressor == _NOMINAL:
        own.u[0], own.u[1] = t_p * t_p * f_n * abs(f_n), -t_p * t_p * f_n
    else:
        own.u[0], own.u[1] = t_p * t_p * f_n * f_n, t_p * t_p * f_n  # Eq. 22
    fire(s, sign * b * t_p * t_p)
    add_level(s, f, n)


@compiled()
def _step(
    state: Float[np.ndarray, " s"], sample: SensorSample, method: int
) -> tuple[Float[np.ndarray, " s"], float]:
    vector = state.copy()
    if not readable(vector, method, sample):
        return vector, np.nan
    s, own = head(vector), _own_fields(vector)
    if watch(vector, sample):
        if s.fresh and s.last.moved:
            if method == PWC:
                _learn_gain(s, own)
            else:
                _learn_gains(s, own)
        if s.outcome == MOVING:
            _plan(s, own)
    return vector, emit(s)


@compiled()
def _pwc_step(
    state: Float[np.ndarray, " s"], sample: SensorSample
) -> tuple[Float[np.ndarray, " s"], float]:
    return _step(state, sample, PWC)


@compiled()
def _papwc_step(
    state: Float[np.ndarray, " s"], sample: SensorSample
) -> tuple[Float[np.ndarray, " s"], float]:
    return _step(state, sample, PAPWC)


C = TypeVar("C", bound="PublishedPulseController")


@dataclass(frozen=True, kw_only=True)
class PublishedPulseController(PulseController):
    """A pulse controller as published: pulses of one level, without viscous friction.

    Raises
    ------
    InputError
        If a value is out of its range.
    """

    #: Largest effort of a pulse; more than the axis needs to break away.
    pulse_effort: float = quantity_field("effort")
    #: Share of the error that a pulse is to take away, ``K_c`` [-]; between 0 and 2.
    gain: float = 1.0
    #: Of a pulse, rounded down to whole samples; None for no limit.
    longest_width: float | None = quantity_field("time", default=None)
    forgetting: float = 1.0  #: Forgetting factor of the recursion [-], in (0, 1].
    #: After so many pulses in a row that did not move the axis it stops; None to go on, as
    #: published.
    max_idle_pulses: int | None = 3

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check(positive, "pulse_effort")
        checked_share("gain", self.gain, 2.0, ends="", usual=1.0)
        checked_share("forgetting", self.forgetting, 1.0, ends="high", usual=1.0)
        longest_samples(self.longest_width, self.sampling_time)
        if self.max_idle_pulses is not None:
            whole("max_idle_pulses", self.max_idle_pulses, least=1)

    @classmethod
    def from_friction(
        cls: type[C],
        *,
        mass: float,
        coulomb_friction: float,
        pulse_effort: float,
        sampling_time: float,
        target: float,
        tolerance: float,
        rest: RestDetection,
    ) -> C:
        """Return one whose first guesses follow from mass and friction.

        Van de Wijdeven (2002) B, Eqs. 4 and 16. All but the first two are settings of the class;
        the others have their defaults (`dataclasses.replace` changes them).

        Parameters
        ----------
        mass
            Moving mass or inertia [kg or kg m^2].
        coulomb_friction
            First guess of it [N or N m].

        Raises
        ------
        InputError
            If a value is out of its range, or the pulses cannot overcome the friction.
        """
        unit = "N or N m"
        positive("mass", mass, "kg or kg m^2")
        positive("coulomb_friction", coulomb_friction, unit)
        positive("pulse_effort", pulse_effort, unit)
        if not pulse_effort > coulomb_friction:
            raise InputError(
                "effort_below_breakaway",
                name="pulse_effort",
                value=pulse_effort,
                limit_name="Coulomb friction",
                limit=coulomb_friction,
                unit=unit,
            )
        return cls(
            **cls._first_gains(mass, coulomb_friction, pulse_effort),
            pulse_effort=pulse_effort,
            sampling_time=sampling_time,
            target=target,
            tolerance=tolerance,
            rest=rest,
        )

    @classmethod
    @abstractmethod
    def _first_gains(cls, m: float, f_c: float, f_p: float) -> dict[str, Any]:
        """Return the first guesses of the method's parameters by field."""

    def init(self) -> Float[np.ndarray, " s"]:
        """Return the state before the first sample."""
        state = self._first_state(places(_OWN_DTYPE))
        own = _own_fields(state)
        own.effort, own.period, own.gain = self.pulse_effort, self.sampling_time, self.gain
        own.longest = longest_samples(self.longest_width, self.sampling_time) * self.sampling_time
        own.forgetting = self.forgetting
        own.max_idle_pulses = inf if self.max_idle_pulses is None else self.max_idle_pulses
        self._initialise(own)
        return state

    @abstractmethod
    def _initialise(self, own: Any) -> None:
        """Set the method's own settings and first guesses in a state."""


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
    _kernel: ClassVar[Any] = _pwc_step

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check(positive, "first_gain")
        checked_share("new_data_weight", self.new_data_weight, 2.0, ends="low", usual=1.0)
        positive("initial_covariance", self.initial_covariance, "1/s^4")
        one_of("regressor", self.regressor, ("nominal", "applied"))

    @classmethod
    def _first_gains(cls, m: float, f_c: float, f_p: float) -> dict[str, Any]:
        return {"first_gain": f_p * (f_p - f_c) / (2.0 * m * f_c)}

    def _initialise(self, own: Any) -> None:
        own.new_data_weight, own.regressor = self.new_data_weight, _REGRESSORS[self.regressor]
        own.b, own.F_inverse = self.first_gain, 1.0 / self.initial_covariance

    def estimates(self, state: Float[np.ndarray, " s"]) -> dict[str, float]:
        """Return the estimate of ``b`` as ``pulse_gain`` [m/s^2 or rad/s^2]."""
        return {"pulse_gain": float(_own_fields(state).b)}

    def learned(self, state: Float[np.ndarray, " s"]) -> LearnedPulses:
        """Return the estimate, and the effort that it is for."""
        values = {**self.estimates(state), "effort": self.pulse_effort}
        return self._learned(values, np.array([[1.0 / _own_fields(state).F_inverse]]))

    def resumed(
        self, learned: LearnedPulses, *, keep_covariance: bool = True
    ) -> "PulseWidthController":
        """Return the same controller, beginning with what an earlier run has learned.

        As `PulseController.resumed`, and an InputError if it was learned for another effort.
        """
        self._check_learned(learned, ("pulse_gain", "effort"), 1)
        if learned.values["effort"] != self.pulse_effort:
            unit = self._unit("pulse_effort")
            raise InputError(
                "learned_otherwise",
                where="values.effort",
                name="effort",
                own=learned.values["effort"],
                needed=self.pulse_effort,
                unit=unit,
            )
        covariance = float(learned.covariance[0, 0])
        return replace(
            self,
            first_gain=learned.values["pulse_gain"],
            initial_covariance=covariance if keep_covariance else self.initial_covariance,
        )


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
    >>> from dataclasses import replace
    >>> from stickslip.control import RestDetection
    >>> from stickslip.friction import CoulombViscousFriction
    >>> from stickslip.plants import SingleMass
    >>> from stickslip.simulation import simulate_closed_loop
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=100.0, static_friction=130.0,
    ...                                        viscous_friction=700.0)
    >>> controller = PulseAmplitudeWidthController.from_friction(
    ...     mass=150.0, coulomb_friction=80.0, pulse_effort=300.0, sampling_time=0.01,
    ...     target=0.01, tolerance=2e-5, rest=RestDetection(samples=1, spread=0.0, speed=0.0))
    >>> controller = replace(controller, longest_width=0.03)
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
    _kernel: ClassVar[Any] = _papwc_step

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check(positive, "first_gain_1", "first_gain_2")
        P11, P12, P22 = self._covariance
        definite = P11 > 0.0 and P22 > 0.0 and P12 * P12 <= P11 * P22 * (1.0 + _ROUNDED)
        if not (definite and isfinite(P11 + P22)):
            raise InputError(
                "initial_covariance_not_definite", name="initial_covariance", values=(P11, P12, P22)
            )
        margin = self.friction_margin
        if margin is not None:
            checked_share("friction_margin", margin, 0.5, ends="", usual=0.01)
        one_of("regressor", self.regressor, _REGRESSORS)
        f_c, f_p, unit = self.coulomb_friction, self.pulse_effort, self._unit("pulse_effort")
        edge = _ROUNDED * f_p if margin is None else (margin - _ROUNDED) * f_p
        if not edge <= f_c <= f_p - edge:
            raise InputError(
                "first_guess_too_large" if f_c > edge else "first_guess_too_small",
                value=f_c,
                effort=f_p,
                least=edge,
                most=f_p - edge,
                unit=unit,
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
    def _first_gains(cls, m: float, f_c: float, f_p: float) -> dict[str, Any]:
        del f_p
        return {"first_gain_1": 1.0 / (2.0 * m * f_c), "first_gain_2": 1.0 / (2.0 * m)}

    def _initialise(self, own: Any) -> None:
        f_p, margin = self.pulse_effort, self.friction_margin
        P11, P12, P22 = self._covariance
        S11, S21 = sqrt(P11), P12 / sqrt(P11)
        own.low = -inf if margin is None else margin * f_p
        own.high = inf if margin is None else (1.0 - margin) * f_p
        own.regressor = _REGRESSORS[self.regressor]
        own.A = self.first_gain_1, self.first_gain_2
        own.S = [[S11, 0.0], [S21, sqrt(max(P22 - S21 * S21, 0.0))]]

    def estimates(self, state: Float[np.ndarray, " s"]) -> dict[str, float]:
        """Return the estimates by name, and what follows from them.

        ``gain_1`` and ``gain_2`` are ``A1`` [m/(N s)^2] and ``A2`` [m/(N s^2)];
        ``coulomb_friction`` their ratio [N], ``pulse_gain`` the displacement at full effort over
        squared width, ``b`` [m/s^2]. On a rotary axis rad stands for m and N m for N.
        """
        f_p = self.pulse_effort
        A_1, A_2 = _own_fields(state).A.tolist()
        return {
            "gain_1": A_1,
            "gain_2": A_2,
            "coulomb_friction": A_2 / A_1 if A_1 else inf,
            "pulse_gain": A_1 * f_p * f_p - A_2 * f_p,
        }

    def learned(self, state: Float[np.ndarray, " s"]) -> LearnedPulses:
        """Return the two gains and their covariance."""
        own = _own_fields(state)
        gain_1, gain_2 = own.A.tolist()
        return self._learned({"gain_1": gain_1, "gain_2": gain_2}, own.S @ own.S.T)

    def resumed(
        self, learned: LearnedPulses, *, keep_covariance: bool = True
    ) -> "PulseAmplitudeWidthController":
        """Return the same controller, beginning with what an earlier run has learned.

        As `PulseController.resumed`, and an InputError if it is no possible estimate with this
        controller's effort.
        """
        self._check_learned(learned, ("gain_1", "gain_2"), 2)
        (P11, P12), (_, P22) = learned.covariance.tolist()
        return replace(
            self,
            first_gain_1=learned.values["gain_1"],
            first_gain_2=learned.values["gain_2"],
            initial_covariance=(P11, P12, P22) if keep_covariance else self.initial_covariance,
        )
