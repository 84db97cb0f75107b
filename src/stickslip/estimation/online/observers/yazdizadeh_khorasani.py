"""The friction observer of Yazdizadeh and Khorasani, from a Lyapunov function.

A. Yazdizadeh and K. Khorasani (1996), "Adaptive friction compensation based on the Lyapunov
scheme", Proceedings of the IEEE International Conference on Control Applications, 1060-1065. The
structure is ``a^ = z - g(|v|)``, ``z' = g'(|v|) (w - a^ sign(v)) sign(v)``; with the Lyapunov
function V = e^2 / 2 of the error, V' = -g'(|v|) e^2, so that any g with g' > 0 will do, without a
lower bound on the speed. The text of the paper was not at hand; the choice of

    g(|v|) = rate * speed * log(1 + |v| / speed),    g' = rate / (1 + |v| / speed),

is one of our own. Its slope is positive and bounded, and largest at rest, which Friedland and Park
had to keep away from. As theirs, the observer is stepped as the flow of its error.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.online.method import Kernel
from stickslip.estimation.online.observers.adaptive_observer import AdaptiveObserver
from stickslip.estimation.online.observers.force_balance import (
    FORCE,
    LAST_VELOCITY,
    SPEED,
    balance,
    follow,
    settled,
)

__all__ = ["YazdizadehKhorasaniObserver"]


@compiled(inline=True)
def _mean_slope(a: float, b: float, scale: float) -> float:
    """Return the mean of g' / rate while the speed goes evenly from a to b."""
    z = (b - a) / (scale + a)
    if abs(z) < 1e-5:
        return scale / (scale + a) * (1.0 - 0.5 * z)
    return scale / (scale + a) * np.log1p(z) / z


@compiled(brief=True)
def yazdizadeh_khorasani_step(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> bool:
    """Take one sample into the state, in place; return whether all of it was finite."""
    before = abs(s[LAST_VELOCITY])
    if balance(s, u, x, v, x2, v2):
        follow(s, s[FORCE], _mean_slope(before, abs(s[LAST_VELOCITY]), s[SPEED]))
    return settled(s, u, x, v, x2, v2)


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

    @property
    def name(self) -> str:
        """Name of the estimator."""
        return "yazdizadeh-khorasani"

    @property
    def kernel(self) -> Kernel:
        """The compiled step (see `OnlineMethod.kernel`)."""
        return yazdizadeh_khorasani_step
