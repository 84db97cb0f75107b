"""Observers whose error decays at a chosen rate, and the gradient estimator.

All are stepped as the flow of their error, with the friction force f of a whole sample from its
momentum (`stickslip.estimation.online.observers.kernels`). <a, b> is the inner product, a dash the
rate of change, and theta~ = theta - theta^.

B. Friedland and Y.-J. Park (1992), "On adaptive friction compensation", IEEE Transactions on
Automatic Control 37(10), 1609-1612. For ``v' = w - a sign(v)`` with the acceleration w of all known
forces, the Coulomb friction a is estimated by

    a^ = z - k |v|^mu,    z' = k mu |v|^(mu - 1) (w - a^ sign(v)) sign(v),

so that the error e = a - a^ obeys e' = -k mu |v|^(mu - 1) e: it decays as long as the axis moves.
With |v|' = v' sign(v) and f = w - v', the two equations are the one

    a^' = g'(|v|) (f sign(v) - a^),    g(|v|) = k |v|^mu;

z, which in continuous time frees the observer from f, is not needed. The viscous extension is the
form that B. Friedland (1997), "A nonlinear observer for estimating parameters in dynamic systems",
Automatica 33(8), 1525-1530, gives to any parameters that enter linearly: with the row
r = (v, sign(v)), a function phi(v) with phi' = -g'(|v|) Gamma r makes theta~' = -g' Gamma r
<r, theta~>.

A. Yazdizadeh and K. Khorasani (1996), "Adaptive friction compensation based on the Lyapunov
scheme", Proceedings of the IEEE International Conference on Control Applications, 1060-1065. The
structure is ``a^ = z - g(|v|)``, ``z' = g'(|v|) (w - a^ sign(v)) sign(v)``; with the Lyapunov
function V = e^2 / 2 of the error, V' = -g'(|v|) e^2, so that any g with g' > 0 will do, without a
lower bound on the speed. The text of the paper was not at hand; the choice of

    g(|v|) = rate * speed * log(1 + |v| / speed),    g' = rate / (1 + |v| / speed),

is one of our own. Its slope is positive and bounded, and largest at rest, which Friedland and Park
had to keep away from.

T.-L. Liao and T.-I. Chien (2000), "An exponentially stable adaptive friction compensator", IEEE
Transactions on Automatic Control 45(5), 977-980. The observer of Yazdizadeh and Khorasani is joined
to linear feedback of the tracking error E = (e, e') so that both errors vanish exponentially. The
text of the paper was not at hand; the Lyapunov function and the gains are ours:

    V = <E, P E> + <theta~, Gamma^-1 theta~>,    A^T P + P A = -Q,    A = [[0, 1], [-k_p, -k_d]],
    E' = A E - B <r, theta~> / m,    B = (0, 1),
    theta^' = Gamma r (<r, theta~> - <B, P E> / m),

V' = -<E, Q E> - 2 <r, theta~>^2, which for Coulomb friction alone (r = sign(v), <r, r> = 1) bounds
V by an exponential as long as the axis moves, however it does. A log holds no reference. The axis
is tracked by its model: E is the measured motion less that of the model under the effort, the
estimated friction and the feedback of E. Its error equation is that of the tracking error. In a
controller (`stickslip.control.OnlineFriction`) it is the adaptive part of the compensator.

J.-J. E. Slotine and W. Li (1991), "Applied Nonlinear Control", section 8.7.2. With the prediction
error e = y^ - y = <r, theta^> - y of a model that is linear in its parameters, theta^ moves down
the gradient of e^2, theta^' = -P_0 r e. Row and force go through the same first-order filter
1 / (1 + s / lambda) first (section 8.7.1), so that no acceleration is needed. The error in the
parameters never grows: V = <theta~, P_0^-1 theta~> has V' = -2 e^2; it vanishes under persistent
excitation only.
"""

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from stickslip.estimation.online.method import State
from stickslip.estimation.online.observers import kernels as at
from stickslip.estimation.online.observers.force_observer import ForceObserver
from stickslip.estimation.settings import check_given
from stickslip.records import AxisLog, InputError, positive


@dataclass(frozen=True, kw_only=True)
class AdaptiveObserver(ForceObserver):
    """An observer whose error decays at a rate that is chosen."""

    #: Moving mass or inertia [kg or kg m^2], of a flexible arm that of the driven side.
    inertia: float
    viscous: bool = False  # Whether viscous friction is estimated beside Coulomb friction.
    #: At which the error of the Coulomb friction decays at the typical speed [1/s]. With viscous
    #: friction beside it, a rate far beyond that at which the speed varies makes both slower to
    #: converge: the observer then follows the sum of the moment.
    rate: float = 3.0
    #: Typical speed of the axis [m/s or rad/s], to which the gains refer; None takes the rms speed
    #: of the log, and cannot be used on line.
    speed: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        positive("rate", self.rate, "1/s")
        check_given(self, positive, {"speed": "m/s or rad/s"})

    @property
    def _estimated(self) -> tuple[str, ...]:
        return (
            *(("viscous_friction",) if self.viscous else ()),
            "coulomb_friction",
            *(("offset",) if self.offset else ()),
        )

    def _initialise(self, s: Any) -> None:
        if self.speed is None:
            raise InputError("no_typical_speed", unit="m/s or rad/s")
        s.speed = self.speed
        viscous = self.rate / self.speed**2 if self.viscous else 0.0
        s.gains = viscous, self.rate, self.rate if self.offset else 0.0

    def _settled(self, log: AxisLog) -> ForceObserver:
        speed = self.speed
        if speed is None:
            parts = [self._samples(part)[:, 2] for part in log.segments()]
            speed = float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
        return ForceObserver._settled(replace(self, speed=speed), log)


@dataclass(frozen=True, kw_only=True)
class FriedlandParkObserver(AdaptiveObserver):
    """Coulomb friction by the nonlinear observer of Friedland and Park (1992).

    As printed it has no viscous friction: where there is some, it follows the friction force at
    the speed of the moment, ``coulomb + viscous |v|``. With ``viscous`` it is Friedland's (1997)
    observer of both, which needs a speed that varies.

    Attributes
    ----------
    exponent
        mu in ``g(|v|) = rate * speed * (|v| / speed)^mu`` [-]. With 1 the error decays alike at
        every speed; above 1, hardly at low speed; below 1, ever faster towards rest.

    Examples
    --------
    >>> observer = FriedlandParkObserver(inertia=150.0, speed=0.1)
    >>> observer.parameter_names("linear")
    ('coulomb_friction',)
    >>> state = observer.init(sampling_time=0.01)
    >>> state, estimates = observer.step(state, (300.0, 0.0, 0.01, 0.0, 0.0))
    >>> estimates.tolist()
    [0.0]
    """

    exponent: float = 1.0
    name: ClassVar[str] = "friedland-park"
    _kernel: ClassVar[Any] = at.friedland_park_step

    def __post_init__(self) -> None:
        super().__post_init__()
        positive("exponent", self.exponent, "-")

    def _initialise(self, s: Any) -> None:
        super()._initialise(s)
        s.exponent = self.exponent


@dataclass(frozen=True, kw_only=True)
class YazdizadehKhorasaniObserver(AdaptiveObserver):
    """Coulomb friction by the Lyapunov scheme of Yazdizadeh and Khorasani (1996).

    The error decays while the axis moves, however slowly. As printed it has no viscous friction;
    with ``viscous`` the same Lyapunov function is taken of both parameters,
    ``theta~' Gamma^-1 theta~ / 2``, whose decay needs a speed that varies.

    Examples
    --------
    >>> YazdizadehKhorasaniObserver(inertia=150.0, viscous=True).parameter_names("linear")
    ('viscous_friction', 'coulomb_friction')
    """

    name: ClassVar[str] = "yazdizadeh-khorasani"
    _kernel: ClassVar[Any] = at.yazdizadeh_khorasani_step


@dataclass(frozen=True, kw_only=True)
class LiaoChienObserver(AdaptiveObserver):
    """Coulomb friction by the exponentially stable scheme of Liao and Chien (2000).

    As printed it has no viscous friction. With ``viscous`` the same Lyapunov function is taken of
    both parameters; it then vanishes under a speed that varies only.

    Attributes
    ----------
    bandwidth
        Of the feedback from the axis to its model, k_p = bandwidth^2 and k_d = 2 bandwidth [rad/s].

    Examples
    --------
    >>> observer = LiaoChienObserver(inertia=150.0, rate=4.0, bandwidth=10.0)
    >>> round(observer.decay, 3)
    5.858
    """

    bandwidth: float = 10.0
    name: ClassVar[str] = "liao-chien"
    _kernel: ClassVar[Any] = at.liao_chien_step

    def __post_init__(self) -> None:
        super().__post_init__()
        positive("bandwidth", self.bandwidth, "rad/s")

    @property
    def lyapunov(self) -> Float[np.ndarray, "2 2"]:
        """P of the errors in position and velocity, for Q = (m omega)^2 diag(omega^2, 1) [SI]."""
        omega = self.bandwidth
        return (self.inertia * omega) ** 2 * np.array([[1.5 * omega, 0.5], [0.5, 0.5 / omega]])

    @property
    def decay(self) -> float:
        """Rate at which V vanishes at least, without viscous friction and offset [1/s].

        The smallest of Q over P, and twice that of the observer.
        """
        return min(self.bandwidth / (1.0 + 0.5**0.5), 2.0 * self.rate)

    def _initialise(self, s: Any) -> None:
        super()._initialise(s)
        s.k_p, s.k_d = self.bandwidth**2, 2.0 * self.bandwidth
        s.cross, s.square = self.lyapunov[1]

    def tracking_error(self, state: State) -> Float[np.ndarray, " 2"]:
        """Return E, the errors of the model's position and velocity [SI]."""
        s = at.fields(state)
        return np.array([s.last_position - s.model_position, s.last_velocity - s.model_velocity])


@dataclass(frozen=True, kw_only=True)
class GradientEstimator(AdaptiveObserver):
    """Coulomb and viscous friction by the gradient of the squared prediction error.

    Attributes
    ----------
    viscous
        Whether viscous friction is estimated beside Coulomb friction.
    bandwidth
        lambda of the filter of row and force [rad/s]. A lower one averages noise, and delays.

    Examples
    --------
    >>> GradientEstimator(inertia=150.0).parameter_names("linear")
    ('viscous_friction', 'coulomb_friction')
    """

    viscous: bool = True
    bandwidth: float = 20.0
    name: ClassVar[str] = "gradient"
    _kernel: ClassVar[Any] = at.gradient_step

    def __post_init__(self) -> None:
        super().__post_init__()
        positive("bandwidth", self.bandwidth, "rad/s")

    def _initialise(self, s: Any) -> None:
        super()._initialise(s)
        s.filter_share = -np.expm1(-self.bandwidth * s.recursion.sampling_time)
