"""The exponentially stable adaptive friction compensator of Liao and Chien.

T.-L. Liao and T.-I. Chien (2000), "An exponentially stable adaptive friction compensator", IEEE
Transactions on Automatic Control 45(5), 977-980. The observer of Yazdizadeh and Khorasani is joined
to linear feedback of the tracking error E = (e, e') so that both errors vanish exponentially. The
text of the paper was not at hand; the Lyapunov function and the gains are ours. With <a, b> for the
inner product, a dash for the rate of change, and theta~ = theta - theta^,

    V = <E, P E> + <theta~, Gamma^-1 theta~>,    A^T P + P A = -Q,    A = [[0, 1], [-k_p, -k_d]],
    E' = A E - B <r, theta~> / m,    B = (0, 1),
    theta^' = Gamma r (<r, theta~> - <B, P E> / m),

V' = -<E, Q E> - 2 <r, theta~>^2, which for Coulomb friction alone (r = sign(v), <r, r> = 1) bounds
V by an exponential as long as the axis moves, however it does.

A log holds no reference. The axis is tracked by its model: E is the measured motion less that of
the model under the effort, the estimated friction and the feedback of E. Its error equation is that
of the tracking error, letter by letter. Where the observer runs along in a controller
(`stickslip.control.OnlineFriction`), it is the adaptive part of the compensator.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.online.method import Kernel, State
from stickslip.estimation.online.observers.adaptive_observer import AdaptiveObserver
from stickslip.estimation.online.observers.force_balance import (
    FORCE,
    GAINS,
    INERTIA,
    LAST_POSITION,
    LAST_VELOCITY,
    METHOD,
    balance,
    settled,
)
from stickslip.estimation.online.recursion import ROW, SAMPLING_TIME, VALUES
from stickslip.records import positive

__all__ = ["LiaoChienObserver"]

(
    _STIFFNESS,  # k_p
    _DAMPING,  # k_d
    _CROSS,  # <B, P E> = _CROSS e + _SQUARE e'
    _SQUARE,
    _MODEL_POSITION,
    _MODEL_VELOCITY,
) = range(METHOD, METHOD + 6)
_VALUES = 3


@compiled(brief=True)
def liao_chien_step(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> bool:
    """Take one sample into the state, in place; return whether all of it was finite.

    The equations of E = (e, w) and of q = <r, theta~>,

        e' = w,    w' = -k_p e - k_d w - q / m,    q' = -g (q - <B, P E> / m),    g = <r, Gamma r>,

    are linear over a sample, and are stepped by the implicit midpoint rule, under which a quadratic
    V never grows. Where the axis turned or rested in the sample, friction is not known, and the
    model is set onto the axis.
    """
    e = s[LAST_POSITION] - s[_MODEL_POSITION]
    w = s[LAST_VELOCITY] - s[_MODEL_VELOCITY]
    if not balance(s, u, x, v, x2, v2):
        s[_MODEL_POSITION], s[_MODEL_VELOCITY] = s[LAST_POSITION], s[LAST_VELOCITY]
        return settled(s, u, x, v, x2, v2)
    m, h = s[INERTIA], 0.5 * s[SAMPLING_TIME]
    q, g = s[FORCE], 0.0
    for i in range(_VALUES):
        q -= s[ROW + i] * s[VALUES + i]
        g += s[GAINS + i] * s[ROW + i] * s[ROW + i]
    # Midpoint values from e_m = e + h w_m and the equations of q' and e''
    alpha = 1.0 + h * g
    beta = 1.0 + h * s[_DAMPING] + h * h * s[_STIFFNESS]
    kappa = h * g / m * (h * s[_CROSS] + s[_SQUARE])
    q_known = q + h * g / m * s[_CROSS] * e
    w_known = w - h * s[_STIFFNESS] * e
    det = alpha * beta + kappa * h / m
    q_m = (beta * q_known + kappa * w_known) / det
    w_m = (alpha * w_known - h / m * q_known) / det
    e_m = e + h * w_m
    speed = 2.0 * h * (q_m - (s[_CROSS] * e_m + s[_SQUARE] * w_m) / m)
    for i in range(_VALUES):
        s[VALUES + i] += s[GAINS + i] * s[ROW + i] * speed
    before = s[_MODEL_VELOCITY]
    s[_MODEL_VELOCITY] = s[LAST_VELOCITY] - (2.0 * w_m - w)
    s[_MODEL_POSITION] += h * (before + s[_MODEL_VELOCITY])
    return settled(s, u, x, v, x2, v2)


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

    def __post_init__(self) -> None:
        super().__post_init__()
        positive("bandwidth", self.bandwidth, "rad/s")

    @property
    def name(self) -> str:
        """Name of the estimator."""
        return "liao-chien"

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

    @property
    def kernel(self) -> Kernel:
        """The compiled step (see `OnlineMethod.kernel`)."""
        return liao_chien_step

    def _lay_settings(self, s: State) -> None:
        super()._lay_settings(s)
        s[_STIFFNESS], s[_DAMPING] = self.bandwidth**2, 2.0 * self.bandwidth
        s[_CROSS], s[_SQUARE] = self.lyapunov[1]

    def tracking_error(self, state: State) -> Float[np.ndarray, " 2"]:
        """Return E, the errors of the model's position and velocity [SI]."""
        return np.array(
            [
                state[LAST_POSITION] - state[_MODEL_POSITION],
                state[LAST_VELOCITY] - state[_MODEL_VELOCITY],
            ]
        )
