"""Standard errors of the maximum, and how well they are known."""

import numpy as np
from jaxtyping import Float

from stickslip.estimation.likelihood.process_noise.search import (
    Maximum,
    Problem,
    inverted,
)

__all__ = ["covariance_of"]


def covariance_of(
    problem: Problem, maximum: Maximum
) -> tuple[Float[np.ndarray, "p p"], Float[np.ndarray, " p"]]:
    """Return the covariance of the parameters [SI], and degrees of freedom of each interval [-].

    The covariance is the inverse of the Fisher information at the estimated noise levels. These
    have errors of their own: with C = (X'X)^-1, dC/da = -C X'X_a C, and the Fisher information on
    the levels, the variance V of a parameter has a variance, and Student's distribution with
    2 V^2/Var(V) degrees of freedom takes it into account (Satterthwaite 1946).

    Parameters
    ----------
    problem
        The log.
    maximum
        Of the likelihood.
    """
    found = maximum.evaluation
    inverse = inverted(found.gram[1:, 1:])
    spread = np.linalg.inv(found.information + np.diag(problem.prior_spread**-2.0))
    change = -np.einsum("ji,aik,kj->aj", inverse, found.gram_change[:, 1:, 1:], inverse)
    variance = np.diag(inverse)
    uncertainty = np.einsum("aj,ab,bj->j", change, spread, change)
    degrees = 2.0 * variance**2 / np.maximum(uncertainty, 1e-12 * variance**2)
    return inverse, np.maximum(degrees, 1.0)
