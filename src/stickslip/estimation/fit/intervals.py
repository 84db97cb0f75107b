"""Covariances and intervals that stay honest when residuals are correlated in time."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import block_diag
from scipy.special import stdtrit

CONFIDENCE = 0.95  #: Of all intervals [-].
MOST_FREQUENCIES = 12
"""Largest number of cosines [-]; see `frequencies`."""

_ROWS_PER_FREQUENCY = 4  # effective rows for each cosine [-]
_SLOWEST = 4  # number of the slowest cosines, which contain a drifting force [-]
_RED = 2.5  # ratio of mean squares [-]: it is as large in one of eight white residuals
_WHITE = 2.0  # degrees of freedom of a white variance over those of the cosines [-]
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
    """Return the share of the information up to each row [-], and the effective number of rows.

    A log that rests for half of its time has its information in the other half. In this time, from
    0 to 1 and at the middle of each row, every stretch counts by its information. The leverage of a
    row is its squared norm in orthonormal coordinates [-].
    """
    total = float(np.sum(leverage))
    if total <= 0:
        return np.zeros(leverage.size), 1.0
    time = (np.cumsum(leverage) - 0.5 * leverage) / total
    return time, total**2 / float(np.sum(leverage**2))


def frequencies(rows: float, most: int = MOST_FREQUENCIES) -> int:
    """Return the number of the slowest cosines for the long-run covariance.

    The cosines must be slower than the correlation of the residual, which limits their number. Each
    gives the interval's Student distribution one degree of freedom: with 12 the interval is 11 %
    wider than with infinitely many. ``rows`` is the effective number of rows [-].
    """
    return max(min(most, int(rows / _ROWS_PER_FREQUENCY)), 1)


@dataclass(frozen=True, kw_only=True)
class Overlap:
    """Correlation of rows that are means of a signal over overlapping windows."""

    #: Differences in time, from 0 to the width of a window [s], shape (k,).
    lags: Float[np.ndarray, " k"]
    #: Of two rows so far apart, if the noise of the signal is white [-], shape (k,).
    correlations: Float[np.ndarray, " k"]


@dataclass(frozen=True, kw_only=True)
class Uncertainty:
    """Covariance of an estimate, and the degrees of freedom of that covariance."""

    covariance: Float[np.ndarray, "p p"]  #: Shape (p, p) [SI].
    #: Of Student's distribution for each parameter's interval, shape (p,) [-].
    degrees_of_freedom: Float[np.ndarray, " p"]


def robust_uncertainty(
    orthonormal: Float[np.ndarray, "n d"],
    to_values: Float[np.ndarray, "p d"],
    residual: Float[np.ndarray, " n"],
    most: int = MOST_FREQUENCIES,
    *,
    slow: bool = False,
    log: Int[np.ndarray, " n"] | None = None,
) -> Uncertainty:
    """Return the uncertainty of a least-squares fit whose residual is correlated in time.

    A parameter is a weighted sum of the target, with weights l_t. Its variance is taken from the
    slowest variations of l_t r_t: the mean square of its projections on the first cosines
    (equal-weighted cosines: Lazarus, Lewis, Stock and Watson 2018), in the time of
    `information_time`. Higher frequencies, such as noise that differentiation has amplified, do not
    enter.

    The residual is orthogonal to the regressors, which removes some of these variations. With G the
    covariance of the projections if the noise were white, the mean square is
    scaled to be unbiased then, and the interval has (tr G)^2 / tr G^2 degrees of freedom (Bell and
    McCaffrey 2002).

    The regressors are left singular vectors, ``to_values`` leads from their coordinates to the
    parameters [SI]. ``most`` is the largest number of cosines; with ``slow`` the slowest alone are
    taken if they are the strongest. ``log`` numbers the log of each row: each has cosines of its
    own.
    """
    n, d = orthonormal.shape
    p = to_values.shape[0]
    blocks = _cosines(np.sum(orthonormal**2, axis=1), log, most)
    number = np.concatenate([np.arange(cosines.shape[0]) for _, cosines in blocks])
    weights = orthonormal @ to_values.T
    projections = np.zeros((p, number.size))
    degrees = np.ones(p)
    for k in range(p):
        parts = [cosines * weights[own, k] for own, cosines in blocks]
        fitted = np.vstack(
            [part @ orthonormal[own] for part, (own, _) in zip(parts, blocks, strict=True)]
        )
        white = block_diag(*[part @ part.T for part in parts]) - fitted @ fitted.T
        trace = float(np.trace(white))
        if trace > 0:
            scale = float(np.sum(weights[:, k] ** 2)) / trace
            seen = [part @ residual[own] for part, (own, _) in zip(parts, blocks, strict=True)]
            projections[k] = np.sqrt(scale) * np.concatenate(seen)
            degrees[k] = trace**2 / float(np.sum(white**2))
    covariance = projections @ projections.T * (n / (n - d))
    if slow and np.max(number) + 1 >= 2 * _SLOWEST:
        squares, slowest = projections**2, number < _SLOWEST
        share = float(np.mean(slowest))
        first = np.sum(squares[:, slowest], axis=1) / share
        rest = np.sum(squares[:, ~slowest], axis=1) / (1.0 - share)
        red = first > _RED * rest
        growth = np.where(red, np.sqrt(first / np.maximum(np.sum(squares, axis=1), _TINY)), 1.0)
        covariance *= np.outer(growth, growth)
        degrees = np.where(red, degrees * share, degrees)
    return Uncertainty(covariance=covariance, degrees_of_freedom=np.maximum(degrees, 1.0))


def _cosines(
    leverage: Float[np.ndarray, " n"], log: Int[np.ndarray, " n"] | None, most: int
) -> list[tuple[Int[np.ndarray, " _"], Float[np.ndarray, "_ _"]]]:
    """Return the rows of every log with its slowest cosines.

    All logs count alike, however many cosines they have.
    """
    blocks: list[tuple[Int[np.ndarray, " _"], Float[np.ndarray, "_ _"]]] = []
    for each in [0] if log is None else np.unique(log).tolist():
        own = np.arange(leverage.size) if log is None else np.flatnonzero(log == each)
        time, rows = information_time(leverage[own])
        count = frequencies(rows, most)
        # cos(k x) is the Chebyshev polynomial of cos(x): one cosine a row
        cosines = np.polynomial.chebyshev.chebvander(np.cos(np.pi * time), count)[:, 1:].T
        blocks.append((own, cosines / np.sqrt(count)))
    return blocks


def pooled(uncertainty: Uncertainty, white: Float[np.ndarray, " p"]) -> Uncertainty:
    """Return the uncertainty with larger variances where they are too small by chance.

    A few cosines give the variance with few degrees of freedom nu, and most wrong intervals have a
    variance that is small by chance. The correlation of real residuals makes the variance larger
    than that of white noise. A variance below that of ``white`` noise [SI] is pooled with it, by
    degrees of freedom: ``(nu V + 2 nu V_white) / (3 nu)``.
    """
    own = np.diag(uncertainty.covariance)
    small = (own < white) & (own > 0)
    share = 1.0 / (1.0 + _WHITE)
    target = share * own + (1.0 - share) * white
    growth = np.sqrt(np.where(small, target / np.where(small, own, 1.0), 1.0))
    degrees = uncertainty.degrees_of_freedom
    return Uncertainty(
        covariance=uncertainty.covariance * np.outer(growth, growth),
        degrees_of_freedom=np.where(small, degrees * (1.0 + _WHITE), degrees),
    )


def t_quantile(degrees_of_freedom: float, intervals: int = 1) -> float:
    """Return the factor from a standard deviation to half a 95 % interval [-].

    The number of ``intervals`` hold together with 95 % (Bonferroni).
    """
    return float(stdtrit(degrees_of_freedom, 1.0 - 0.5 * (1.0 - CONFIDENCE) / intervals))


def white_variances(
    weights: Float[np.ndarray, "n p"],
    residual: Float[np.ndarray, " n"],
    time: Float[np.ndarray, " n"],
    overlap: Overlap,
    log: Int[np.ndarray, " n"] | None = None,
) -> Float[np.ndarray, " p"]:
    """Return the variances of a fit to overlapping means of a signal with white noise [SI].

    A parameter is ``sum_i l_i y_i``; its variance is ``s^2 sum_ij l_i l_j rho(t_i - t_j)``, where
    s^2 is the mean square of the residual, its degrees of freedom restored, and rho the correlation
    of two means. Times [s] do not decrease within a log.
    """
    total = np.sum(weights**2, axis=0)
    for lag in range(1, time.size):
        apart = time[lag:] - time[:-lag]
        if log is not None:
            apart = np.where(log[lag:] == log[:-lag], apart, np.inf)
        if float(np.min(apart)) > overlap.lags[-1]:
            break
        shared = np.interp(apart, overlap.lags, overlap.correlations, right=0.0)
        total += 2.0 * np.sum(shared[:, None] * weights[lag:] * weights[:-lag], axis=0)
    return float(np.mean(residual**2)) * np.maximum(total, 0.0)
