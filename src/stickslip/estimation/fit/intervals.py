"""Covariances and intervals that stay honest when residuals are correlated in time."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.special import stdtrit

__all__ = [
    "Uncertainty",
    "autocorrelation",
    "frequencies",
    "information_time",
    "robust_uncertainty",
    "t_quantile",
]

CONFIDENCE = 0.95
MOST_FREQUENCIES = 12
"""See `frequencies`."""

_ROWS_PER_FREQUENCY = 4
_SLOWEST = 4  # cosines, which a drifting force fills
_RED = 2.5  # ratio of mean squares: of white residuals, one in eight is as red
_TINY = np.finfo(float).tiny


def autocorrelation(values: Float[np.ndarray, " n"], lags: int) -> Float[np.ndarray, " values"]:
    """Return the autocorrelation [-] of a zero-mean sequence at lags 0 to ``lags``."""
    size = int(2 ** np.ceil(np.log2(2 * values.size)))
    spectrum = np.fft.rfft(values, size)
    covariance = np.fft.irfft(spectrum * np.conj(spectrum), size)[: lags + 1]
    if covariance[0] <= 0:
        return np.concatenate(([1.0], np.zeros(lags)))
    return np.asarray(covariance / covariance[0])


def information_time(
    leverage: Float[np.ndarray, " n"],
) -> tuple[Float[np.ndarray, " n"], float]:
    """Return how much of the information has come in by each row, and how many rows that is worth.

    A log that rests for half of its time has its information in the other half; in this time, every
    stretch counts by what it tells.

    Parameters
    ----------
    leverage
        Squared norm of each row of the regressors in orthonormal coordinates [-].

    Returns
    -------
    time, rows
        From 0 to 1 at the middle of each row [-]; and the number of rows of equal leverage that
        carry as much.
    """
    total = float(np.sum(leverage))
    if total <= 0:
        return np.zeros(leverage.size), 1.0
    time = (np.cumsum(leverage) - 0.5 * leverage) / total
    return time, total**2 / float(np.sum(leverage**2))


def frequencies(rows: float, most: int = MOST_FREQUENCIES) -> int:
    """Return how many of the slowest cosines the long-run covariance is taken from.

    They must be slower than whatever correlates the residual, so that few are better; each gives
    the interval's Student distribution one degree of freedom, so that few cost width: with 12 the
    interval is 11 % wider than with all the frequencies in the world.
    """
    return max(min(most, int(rows / _ROWS_PER_FREQUENCY)), 1)


@dataclass(frozen=True, kw_only=True)
class Uncertainty:
    """Covariance of an estimate, and how well it is known itself.

    Attributes
    ----------
    covariance
        Shape (p, p) [SI].
    degrees_of_freedom
        Of Student's distribution for each parameter's interval, shape (p,) [-].
    """

    covariance: Float[np.ndarray, "p p"]
    degrees_of_freedom: Float[np.ndarray, " p"]


def robust_uncertainty(
    orthonormal: Float[np.ndarray, "n d"],
    to_values: Float[np.ndarray, "p d"],
    residual: Float[np.ndarray, " n"],
    most: int = MOST_FREQUENCIES,
    *,
    slow: bool = False,
) -> Uncertainty:
    """Return the uncertainty of a least-squares fit whose residual is correlated in time.

    A parameter is a weighted sum of the target, with weights l_t. Its variance is taken from the
    slowest variations of l_t r_t: the mean square of its projections on the first cosines
    (equal-weighted cosines: Lazarus, Lewis, Stock and Watson 2018), in the time in which
    information comes in. What goes on at higher frequencies, such as noise that differentiation
    has amplified, does not enter.

    The fit has made the residual orthogonal to the regressors, which takes out some of these
    variations. With G the covariance of the projections if the noise were white, the mean square is
    scaled to be unbiased then, and the interval has (tr G)^2 / tr G^2 degrees of freedom (Bell and
    McCaffrey 2002).

    Parameters
    ----------
    orthonormal
        Regressors in orthonormal coordinates (left singular vectors).
    to_values
        From those coordinates to the parameters [SI].
    residual
        Of the fit, in the unit of the target.
    most
        Cosines at the most.
    slow
        Whether to take the slowest cosines alone where they are the strongest.
    """
    n, d = orthonormal.shape
    p = to_values.shape[0]
    time, rows = information_time(np.sum(orthonormal**2, axis=1))
    count = frequencies(rows, most)
    cosines = np.cos(np.pi * np.outer(np.arange(1, count + 1), time))
    weights = orthonormal @ to_values.T
    projections = np.zeros((p, count))
    degrees = np.ones(p)
    for k in range(p):
        projection = cosines * weights[:, k]
        fitted = projection @ orthonormal
        white = projection @ projection.T - fitted @ fitted.T
        trace = float(np.trace(white))
        if trace > 0:
            scale = float(np.sum(weights[:, k] ** 2)) / trace
            projections[k] = np.sqrt(scale) * (projection @ residual)
            degrees[k] = trace**2 / float(np.sum(white**2))
    covariance = projections @ projections.T * (n / (n - d))
    if slow and count >= 2 * _SLOWEST:
        squares = projections**2
        first = count / _SLOWEST * np.sum(squares[:, :_SLOWEST], axis=1)
        rest = count / (count - _SLOWEST) * np.sum(squares[:, _SLOWEST:], axis=1)
        red = first > _RED * rest
        growth = np.where(red, np.sqrt(first / np.maximum(np.sum(squares, axis=1), _TINY)), 1.0)
        covariance *= np.outer(growth, growth)
        degrees = np.where(red, degrees * _SLOWEST / count, degrees)
    return Uncertainty(covariance=covariance, degrees_of_freedom=np.maximum(degrees, 1.0))


def t_quantile(degrees_of_freedom: float) -> float:
    """Return the factor from a standard deviation to half a 95 % interval [-]."""
    return float(stdtrit(degrees_of_freedom, 0.5 + CONFIDENCE / 2))
