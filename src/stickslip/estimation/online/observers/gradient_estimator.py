"""The gradient estimator of Slotine and Li.

J.-J. E. Slotine and W. Li (1991), "Applied Nonlinear Control", section 8.7.2. With the prediction
error e = y^ - y = <r, theta^> - y of a model that is linear in its parameters, theta^ moves down
the gradient of e^2:

    theta^' = -P_0 r e.

Row and force go through the same first-order filter 1 / (1 + s / lambda) first (section 8.7.1), so
that no acceleration is needed. The error in the parameters never grows:
V = <theta~, P_0^-1 theta~> has V' = -2 e^2; it vanishes under persistent excitation only.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.online.method import Kernel, State
from stickslip.estimation.online.observers.adaptive_observer import AdaptiveObserver
from stickslip.estimation.online.observers.force_balance import (
    FORCE,
    METHOD,
    SHAPE,
    balance,
    follow,
    settled,
)
from stickslip.estimation.online.recursion import ROW, SAMPLING_TIME
from stickslip.records import positive

__all__ = ["GradientEstimator"]

_FILTERED = METHOD  # force, then the row


@compiled(brief=True)
def gradient_step(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> bool:
    """Take one sample into the state, in place; return whether all of it was finite."""
    if balance(s, u, x, v, x2, v2):
        s[_FILTERED] += s[SHAPE] * (s[FORCE] - s[_FILTERED])
        for i in range(3):
            s[_FILTERED + 1 + i] += s[SHAPE] * (s[ROW + i] - s[_FILTERED + 1 + i])
            s[ROW + i] = s[_FILTERED + 1 + i]
        follow(s, s[_FILTERED], 1.0)
    return settled(s, u, x, v, x2, v2)


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

    def __post_init__(self) -> None:
        super().__post_init__()
        positive("bandwidth", self.bandwidth, "rad/s")

    @property
    def name(self) -> str:
        """Name of the estimator."""
        return "gradient"

    @property
    def kernel(self) -> Kernel:
        """The compiled step (see `OnlineMethod.kernel`)."""
        return gradient_step

    def _lay_settings(self, s: State) -> None:
        super()._lay_settings(s)
        s[SHAPE] = -np.expm1(-self.bandwidth * s[SAMPLING_TIME])
