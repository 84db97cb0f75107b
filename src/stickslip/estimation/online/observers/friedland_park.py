"""The adaptive friction observer of Friedland and Park.

B. Friedland and Y.-J. Park (1992), "On adaptive friction compensation", IEEE Transactions on
Automatic Control 37(10), 1609-1612. For ``v' = w - a sign(v)`` with the acceleration w of all known
forces, the Coulomb friction a is estimated by

    a^ = z - k |v|^mu,    z' = k mu |v|^(mu - 1) (w - a^ sign(v)) sign(v),

so that the error e = a - a^ obeys e' = -k mu |v|^(mu - 1) e: it decays as long as the axis moves.
With |v|' = v' sign(v) and the friction force f = w - v', the two equations are the one

    a^' = g'(|v|) (f sign(v) - a^),    g(|v|) = k |v|^mu,

and f is known of a whole sample from its momentum
(`stickslip.estimation.online.observers.force_balance`). So this is what is stepped; z, which in
continuous time frees the observer from f, is not needed.

The viscous extension is the form that B. Friedland (1997), "A nonlinear observer for estimating
parameters in dynamic systems", Automatica 33(8), 1525-1530, gives to any parameters that enter
linearly: with the row r = (v, sign(v)), a function phi(v) with phi' = -g'(|v|) Gamma r makes
theta~' = -g' Gamma r <r, theta~>.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.online.method import Kernel, State
from stickslip.estimation.online.observers.adaptive_observer import AdaptiveObserver
from stickslip.estimation.online.observers.force_balance import (
    FORCE,
    LAST_VELOCITY,
    SHAPE,
    SPEED,
    balance,
    follow,
    settled,
)
from stickslip.records import positive

__all__ = ["FriedlandParkObserver"]


@compiled(inline=True)
def _mean_slope(a: float, b: float, mu: float, scale: float) -> float:
    """Return the mean of g' / rate while the speed goes evenly from a to b.

    It is (g(b) - g(a)) / (b - a) of g / rate = scale (|v| / scale)^mu.
    """
    if mu == 1.0:
        return 1.0
    a, b = a / scale, b / scale
    if abs(b - a) < 1e-6 * (a + b):
        return mu * (0.5 * (a + b)) ** (mu - 1.0)
    return (b**mu - a**mu) / (b - a)


@compiled(brief=True)
def friedland_park_step(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> bool:
    """Take one sample into the state, in place; return whether all of it was finite.

    a^' = g' (f sign(v) - a^) over a sample, exact where f is held and the speed changes evenly.
    """
    before = abs(s[LAST_VELOCITY])
    if balance(s, u, x, v, x2, v2):
        follow(s, s[FORCE], _mean_slope(before, abs(s[LAST_VELOCITY]), s[SHAPE], s[SPEED]))
    return settled(s, u, x, v, x2, v2)


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

    def __post_init__(self) -> None:
        super().__post_init__()
        positive("exponent", self.exponent, "-")

    @property
    def name(self) -> str:
        """Name of the estimator."""
        return "friedland-park"

    @property
    def kernel(self) -> Kernel:
        """The compiled step (see `OnlineMethod.kernel`)."""
        return friedland_park_step

    def _lay_settings(self, s: State) -> None:
        super()._lay_settings(s)
        s[SHAPE] = self.exponent
