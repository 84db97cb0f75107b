"""Test whether innovations are white."""

import numpy as np
from jaxtyping import Float

__all__ = ["whiteness_probability"]


def whiteness_probability(values: Float[np.ndarray, " n"]) -> float:
    """Return the probability of a cumulative periodogram as uneven as this if white [-].

    The largest distance D of the cumulative periodogram from a straight line has the distribution
    of Kolmogorov and Smirnov, P(D sqrt(m) > z) = 2 sum (-1)^(j-1) exp(-2 j^2 z^2), with m
    frequencies (Bartlett 1955).

    Parameters
    ----------
    values
        Normalised innovations in the order of time, shape (n,).
    """
    power = np.abs(np.fft.rfft(values - np.mean(values))[1:]) ** 2
    m = power.size
    total = float(np.sum(power))
    if m < 2 or total == 0.0:
        return 1.0
    share = np.cumsum(power) / total
    distance = float(np.max(np.abs(share - np.arange(1, m + 1) / m)))
    z = max(distance * np.sqrt(m), 0.2)
    j = np.arange(1, 101)
    return float(np.clip(2.0 * np.sum((-1.0) ** (j - 1) * np.exp(-2.0 * (j * z) ** 2)), 0.0, 1.0))
