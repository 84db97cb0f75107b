"""The run of any observer over many samples.

One loop for all: a kernel that takes another one as an argument could not be kept on disk.
"""

import numpy as np
from jaxtyping import Bool, Float

from stickslip.compiled import compiled
from stickslip.estimation.online.observers.force_balance import set_aside
from stickslip.estimation.online.observers.friedland_park import friedland_park_step
from stickslip.estimation.online.observers.gradient_estimator import gradient_step
from stickslip.estimation.online.observers.least_squares_observer import least_squares_step
from stickslip.estimation.online.observers.liao_chien import liao_chien_step
from stickslip.estimation.online.observers.yazdizadeh_khorasani import yazdizadeh_khorasani_step
from stickslip.estimation.online.recursion import VALUES

__all__ = ["METHODS", "observer_run"]

METHODS = ("rls", "friedland-park", "yazdizadeh-khorasani", "liao-chien", "gradient")
"""Names of the estimators, in the order of the numbers that `observer_run` takes."""

_VALUES = 4  # at most: inertia, viscous and Coulomb friction, offset


@compiled()
def observer_run(
    method: int,
    s: Float[np.ndarray, " s"],
    samples: Float[np.ndarray, "n 5"],
    quiet: Bool[np.ndarray, " n"],
) -> Float[np.ndarray, "n 4"]:
    """Take many samples, in place; return the values after each. Quiet samples give no row."""
    n = samples.shape[0]
    history = np.empty((n, _VALUES))
    for k in range(n):
        u, x, v, x2, v2 = samples[k]
        set_aside(s, quiet[k])
        if method == 0:
            least_squares_step(s, u, x, v, x2, v2)
        elif method == 1:
            friedland_park_step(s, u, x, v, x2, v2)
        elif method == 2:
            yazdizadeh_khorasani_step(s, u, x, v, x2, v2)
        elif method == 3:
            liao_chien_step(s, u, x, v, x2, v2)
        else:
            gradient_step(s, u, x, v, x2, v2)
        set_aside(s, quiet[k])
        history[k] = s[VALUES : VALUES + _VALUES]
    return history
