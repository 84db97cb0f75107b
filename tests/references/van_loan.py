"""Covariance of states under white noise, by one matrix exponential."""

import numpy as np
import scipy.linalg


def integrated_noise(F: np.ndarray, step: float) -> np.ndarray:
    """Return the integral of exp(F s) b b' exp(F' s), b the last state's rate (Van Loan 1978)."""
    n = len(F)
    both = np.zeros((2 * n, 2 * n))
    both[:n, :n], both[n:, n:] = -F, F.T
    both[n - 1, 2 * n - 1] = 1.0
    over = scipy.linalg.expm(both * step)
    return over[n:, n:].T @ over[:n, n:]
