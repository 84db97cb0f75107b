"""Covariances and intervals that stay honest when residuals are correlated in time."""

import numpy as np
from jaxtyping import Float
from scipy.fft import dct
from scipy.special import stdtrit

__all__ = [
    "autocorrelation",
    "frequencies",
    "long_run_covariance",
    "robust_covariance",
    "t_quantile",
]

CONFIDENCE = 0.95
MOST_FREQUENCIES = 12
"""See `frequencies`."""

_ROWS_PER_FREQUENCY = 4


def autocorrelation(values: Float[np.ndarray, " n"], lags: int) -> Float[np.ndarray, " values"]:
    """Return the autocorrelation [-] of a zero-mean sequence at lags 0 to ``lags``."""
    size = int(2 ** np.ceil(np.log2(2 * values.size)))
    spectrum = np.fft.rfft(values, size)
    covariance = np.fft.irfft(spectrum * np.conj(spectrum), size)[: lags + 1]
    if covariance[0] <= 0:
        return np.concatenate(([1.0], np.zeros(lags)))
    return np.asarray(covariance / covariance[0])


def frequencies(rows: int) -> int:
    """Return how many of the slowest cosines the long-run covariance is taken from.

    They must be slower than whatever correlates the residual, so that few are better; each gives
    the interval's Student distribution one degree of freedom, so that few cost width: with 12 the
    interval is 11 % wider than with all the frequencies in the world.
    """
    return max(min(MOST_FREQUENCIES, rows // _ROWS_PER_FREQUENCY), 1)


def long_run_covariance(scores: Float[np.ndarray, "n p"], count: int) -> Float[np.ndarray, "p p"]:
    """Return the covariance of the sum of a correlated sequence, from its slowest variations.

    Equal-weighted cosines (Lazarus, Lewis, Stock and Watson 2018): the mean over the first
    ``count`` type-II cosines of the squared projections, which is n times the spectral density at
    zero if that is flat up to count / 2n cycles per row. What goes on at higher frequencies, such
    as noise that differentiation has amplified, does not enter.

    Parameters
    ----------
    scores
        One row a sample.
    count
        Number of cosines.
    """
    slow = dct(scores, type=2, axis=0, norm="ortho")[1 : count + 1]
    return scores.shape[0] / count * (slow.T @ slow)


def robust_covariance(
    regressors: Float[np.ndarray, "n p"], residual: Float[np.ndarray, " n"]
) -> Float[np.ndarray, "p p"]:
    """Return the covariance of a least-squares estimate whose residual is correlated in time.

    The sandwich (W'W)^-1 S (W'W)^-1 with S the long-run covariance of the scores W_t r_t, times
    n / (n - p) for the degrees of freedom. An interval from it takes the quantile of Student's
    distribution with `frequencies` degrees of freedom.

    Parameters
    ----------
    regressors
        Of full column rank.
    residual
        Of the fit, in the unit of the target.
    """
    n, p = regressors.shape
    meat = long_run_covariance(regressors * residual[:, None], frequencies(n))
    bread = np.linalg.pinv(regressors.T @ regressors, hermitian=True)
    return bread @ meat @ bread * (n / (n - p))


def t_quantile(degrees_of_freedom: int) -> float:
    """Return the factor from a standard deviation to half a 95 % interval [-]."""
    return float(stdtrit(degrees_of_freedom, 0.5 + CONFIDENCE / 2))
