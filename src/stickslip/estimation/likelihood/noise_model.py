"""The likelihood of what the sensors show, with the noise of each channel found on the way.

The errors of a channel are Gaussian with an unknown variance, white or a first-order
autoregression. For given errors the likeliest variance and coefficient are known in closed form or
almost, so that the likelihood is one of the motion alone (concentrated).

A run of equal readings is one reading: an axis that rests on one count of its encoder, or creeps
over it, shows the same rounding error again and again. Errors are therefore averaged over each run,
and the run counts once.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

__all__ = ["ChannelNoise", "likeliest_noise", "run_means", "run_starts", "whitened"]

LARGEST_CORRELATION = 0.9999
_GOLDEN_STEPS = 40  # of the search of the coefficient: (0.618)^40 = 4e-9
_GOLDEN = 0.6180339887498949
_FIRST_LOOK = 33


@dataclass(frozen=True, kw_only=True)
class ChannelNoise:
    """Noise of one channel.

    Attributes
    ----------
    std
        Standard deviation of what is new in each error [unit of the channel].
    correlation
        From one error to the next [-]; 0 for white noise.
    rows
        Number of readings that count.
    cost
        Negative logarithm of the likelihood, up to a constant [-].
    """

    std: float
    correlation: float
    rows: int
    cost: float


def run_starts(readings: Float[np.ndarray, " n"]) -> Int[np.ndarray, " runs"]:
    """Return where each run of equal readings begins."""
    return np.concatenate(([0], np.flatnonzero(np.diff(readings)) + 1))


def run_means(
    rows: Float[np.ndarray, "n ..."], starts: Int[np.ndarray, " runs"]
) -> Float[np.ndarray, "runs ..."]:
    """Return the mean of the rows of each run."""
    n = rows.shape[0]
    if starts.size == n:
        return rows
    lengths = np.diff(starts, append=n)
    sums = np.add.reduceat(rows, starts, axis=0)
    return sums / lengths.reshape(-1, *(1,) * (rows.ndim - 1))


def whitened(rows: Float[np.ndarray, "n ..."], correlation: float) -> Float[np.ndarray, "n ..."]:
    """Return rows less what those before predict: e_k - rho e_(k-1), and sqrt(1 - rho^2) e_0."""
    if correlation == 0.0:
        return rows
    white = rows.copy()
    white[1:] -= correlation * rows[:-1]
    white[0] *= np.sqrt(1.0 - correlation**2)
    return white


def likeliest_noise(
    errors: Sequence[Float[np.ndarray, " _"]], *, coloured: bool, least: float
) -> ChannelNoise:
    """Return the noise that makes the errors of a channel likeliest.

    With e white, -log p = N/2 log(SSE/N); of an autoregression in W stretches,
    SSE = sum (1 - rho^2) e_0^2 + sum (e_k - rho e_(k-1))^2 and -W/2 log(1 - rho^2) is added
    (Box and Jenkins, Time Series Analysis, A7.4).

    Parameters
    ----------
    errors
        One array a stretch [unit of the channel].
    coloured
        Whether the errors may be correlated.
    least
        Standard deviation below which an error is rounding [unit of the channel].
    """
    rows = sum(e.size for e in errors)
    total = sum(float(e @ e) for e in errors)
    across = sum(float(e[1:] @ e[:-1]) for e in errors)
    inner = sum(float(e[1:-1] @ e[1:-1]) for e in errors)

    def squares(rho: float) -> float:
        # sum over a stretch of (1 - rho^2) e_0^2 + (e_k - rho e_(k-1))^2
        return max(total - 2.0 * rho * across + rho**2 * inner, 0.0) + rows * least**2

    def cost(rho: float) -> float:
        edge = 0.5 * len(errors) * float(np.log1p(-(rho**2)))
        return 0.5 * rows * float(np.log(squares(rho) / rows)) - edge

    rho = 0.0
    if coloured and total > 0.0:
        grid = np.tanh(np.linspace(-4.0, 4.0, _FIRST_LOOK)) / np.tanh(4.0) * LARGEST_CORRELATION
        best = int(np.argmin([cost(float(value)) for value in grid]))
        low, high = float(grid[max(best - 1, 0)]), float(grid[min(best + 1, grid.size - 1)])
        for _ in range(_GOLDEN_STEPS):
            left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
            if cost(left) < cost(right):
                high = right
            else:
                low = left
        rho = 0.5 * (low + high)
    return ChannelNoise(
        std=float(np.sqrt(squares(rho) / rows)), correlation=rho, rows=rows, cost=cost(rho)
    )
