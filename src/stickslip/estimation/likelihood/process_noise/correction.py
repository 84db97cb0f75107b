"""Correct the maximum of the likelihood for effort noise that does not act on the axis.

The filter predicts the motion from the logged effort u + n. If n acts on the axis (a force), its
innovations are independent of what it predicts from, in closed loop too. If n is noise of the log,
the predictions contain it, and with a perfectly known motion the likelihood

    sum (m a - u_l)^2/(2 W) - n log m

has its maximum at a mass that is too large: the Jacobian n log m belongs to a force only (errors in
variables). With the share rho = R_u/W of the white force that is noise of the log, the score of the
mass is corrected by what the Jacobian adds. As the innovations depend on W/m^2, it is

    g_m - b_m,   b_m = -(rho/m) d/dlog W (e' S^-1 e),

which has zero mean for noise of the log, forces, and sensor noise together, without a model of the
controller or of the true effort.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.estimation.likelihood.process_noise.search import (
    FORCE,
    Evaluation,
    Maximum,
    Problem,
    evaluate,
)

__all__ = ["Corrected", "corrected"]

_ITERATIONS = 3  # the correction changes by its square


@dataclass(frozen=True, kw_only=True)
class Corrected:
    """The estimate and its uncertainty.

    Attributes
    ----------
    values
        Parameters sought [SI].
    covariance
        Theirs [SI], shape (p, p).
    degrees_of_freedom
        Of Student's distribution of each, from the uncertainty of the noise levels [-], shape (p,).
    evaluation
        Innovations at the values, with rows.
    """

    values: Float[np.ndarray, " p"]
    covariance: Float[np.ndarray, "p p"]
    degrees_of_freedom: Float[np.ndarray, " p"]
    evaluation: Evaluation


def corrected(problem: Problem, maximum: Maximum, log_share: float) -> Corrected:
    """Return the estimate with the correction for effort noise of the log.

    Parameters
    ----------
    problem
        The log.
    maximum
        Of the likelihood.
    log_share
        rho, the share of the white force's variance that is noise of the log [-].
    """
    values, evaluation = maximum.values, maximum.evaluation
    for _ in range(_ITERATIONS):
        bias, information = _corrections(problem, values, evaluation, log_share)
        scale = np.sqrt(np.diag(information))
        inverse = np.linalg.pinv(information / np.outer(scale, scale), rcond=1e-13, hermitian=True)
        inverse /= np.outer(scale, scale)
        values = values + inverse @ (evaluation.gram[1:, 0] - bias)
        evaluation = evaluate(problem, values, maximum.levels)
    kept = evaluate(problem, values, maximum.levels, with_rows=True)
    # Satterthwaite: 2 V^2 / Var(V), with V_a = -(C X'X_a C)_jj and the information on the levels
    spread = np.linalg.inv(evaluation.information + np.diag(problem.prior_spread**-2.0))
    change = -np.einsum("ji,aik,kj->aj", inverse, evaluation.gram_change[:, 1:, 1:], inverse)
    variance = np.diag(inverse)
    uncertainty = np.einsum("aj,ab,bj->j", change, spread, change)
    return Corrected(
        values=values,
        covariance=inverse,
        degrees_of_freedom=np.maximum(2.0 * variance**2 / np.maximum(uncertainty, 1e-300), 1.0),
        evaluation=kept,
    )


def _corrections(
    problem: Problem, values: Float[np.ndarray, " p"], evaluation: Evaluation, log_share: float
) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, "p p"]]:
    """Return the mean of the score by noise of the log, and the information without that noise."""
    bias, information = np.zeros(values.size), evaluation.gram[1:, 1:].copy()
    if problem.mass_name in problem.layout.sought:
        j = problem.layout.sought.index(problem.mass_name)
        bias[j] = -log_share / values[j] * evaluation.gram_change[FORCE, 0, 0]
        information[j, j] -= log_share / values[j] ** 2 * evaluation.logs_change[FORCE]
    return bias, information
