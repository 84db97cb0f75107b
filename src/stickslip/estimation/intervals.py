"""Covariances and intervals that stay honest when residuals are correlated in time."""

import numpy as np
from jaxtyping import Float
from scipy.special import stdtrit

__all__ = [
    "andrews_bandwidth",
    "autocorrelation",
    "hac_covariance",
    "long_run_covariance",
    "t_quantile",
]

CONFIDENCE = 0.95
LARGEST_PREWHITENING = 0.97
"""Autoregression coefficient kept below 1, or recolouring would divide by zero (Andrews and Monahan
1992)."""

_ANDREWS_BARTLETT = 1.1447  # constant of Andrews (1991), Eq. 6.2, for the Bartlett kernel


def autocorrelation(values: Float[np.ndarray, " n"], lags: int) -> Float[np.ndarray, " values"]:
    """Return the autocorrelation [-] of a zero-mean sequence at lags 0 to ``lags``."""
    size = int(2 ** np.ceil(np.log2(2 * values.size)))
    spectrum = np.fft.rfft(values, size)
    covariance = np.fft.irfft(spectrum * np.conj(spectrum), size)[: lags + 1]
    if covariance[0] <= 0:
        return np.concatenate(([1.0], np.zeros(lags)))
    return np.asarray(covariance / covariance[0])


def andrews_bandwidth(scores: Float[np.ndarray, "n p"]) -> float:
    """Return the bandwidth for the Bartlett kernel from AR(1) fits (Andrews 1991, Eqs. 6.2, 6.4).

    Parameters
    ----------
    scores
        Regressor times residual, one row a sample.
    """
    n = scores.shape[0]
    variance = np.sum(scores[:-1] ** 2, axis=0)
    used = variance > 0
    if not np.any(used):
        return 0.0
    rho = np.sum(scores[1:, used] * scores[:-1, used], axis=0) / variance[used]
    rho = np.clip(rho, -LARGEST_PREWHITENING, LARGEST_PREWHITENING)
    innovation = scores[1:, used] - rho * scores[:-1, used]
    sigma4 = np.mean(innovation**2, axis=0) ** 2
    numerator = np.sum(4 * rho**2 * sigma4 / ((1 - rho) ** 6 * (1 + rho) ** 2))
    denominator = np.sum(sigma4 / (1 - rho) ** 4)
    if denominator <= 0:
        return 0.0
    return float(_ANDREWS_BARTLETT * (numerator / denominator * n) ** (1 / 3))


def long_run_covariance(
    scores: Float[np.ndarray, "n p"], bandwidth: float
) -> Float[np.ndarray, "p p"]:
    """Return the sum over t of E[s_t s_(t-l)'], weighted by the Bartlett kernel (Newey-West 1987).

    Parameters
    ----------
    scores
        Zero-mean, one row a sample.
    bandwidth
        The lag at which the weights reach zero [samples]; ``lags + 1`` in Newey and West's terms.
    """
    total = scores.T @ scores
    for lag in range(1, min(int(np.ceil(bandwidth)), scores.shape[0])):
        weight = 1.0 - lag / bandwidth
        if weight <= 0:
            break
        cross = scores[lag:].T @ scores[:-lag]
        total = total + weight * (cross + cross.T)
    return total


def hac_covariance(
    regressors: Float[np.ndarray, "n p"],
    residual: Float[np.ndarray, " n"],
    *,
    bandwidth: float | None = None,
    prewhiten: bool = True,
) -> Float[np.ndarray, "p p"]:
    """Return the covariance of a least-squares estimate whose residual is correlated in time.

    The sandwich (W'W)^-1 S (W'W)^-1 with S the long-run covariance of the scores W_t r_t, times
    n / (n - p) for the degrees of freedom. Prewhitening (Andrews and Monahan 1992) fits a
    first-order autoregression to each score, takes the long-run covariance of what is left, and
    puts the autoregression back: without it, strongly correlated residuals give intervals that are
    much too short.

    Parameters
    ----------
    regressors
        Of full column rank.
    residual
        Of the fit, in the unit of the target.
    bandwidth
        [samples]; Andrews' automatic choice if None.
    prewhiten
        Whether to prewhiten.
    """
    n, p = regressors.shape
    scores = regressors * residual[:, None]
    recolour = np.ones(p)
    if prewhiten:
        variance = np.sum(scores[:-1] ** 2, axis=0)
        safe = np.where(variance > 0, variance, 1.0)
        rho = np.sum(scores[1:] * scores[:-1], axis=0) / safe
        rho = np.clip(rho, -LARGEST_PREWHITENING, LARGEST_PREWHITENING)
        scores = scores[1:] - rho * scores[:-1]
        recolour = 1.0 / (1.0 - rho)
    width = andrews_bandwidth(scores) if bandwidth is None else bandwidth
    meat = long_run_covariance(scores, width) * np.outer(recolour, recolour)
    bread = np.linalg.pinv(regressors.T @ regressors, hermitian=True)
    return bread @ meat @ bread * (n / (n - p))


def t_quantile(degrees_of_freedom: float) -> float:
    """Return the factor from a standard deviation to half a 95 % interval [-]."""
    return float(stdtrit(degrees_of_freedom, 0.5 + CONFIDENCE / 2))
