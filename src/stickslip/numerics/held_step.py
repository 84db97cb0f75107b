"""Linear motion over a step under held inputs."""

import numpy as np
from jaxtyping import Float


def held_step(rates: Float[np.ndarray, "s c"], step: float = 1.0) -> Float[np.ndarray, "s c"]:
    """Return [A_d B_d], read-only, of x' = [A B] (x, u) with the inputs u held over a step.

    That is the upper part of exp([A B; 0 0] step) (Van Loan 1978).
    """
    from scipy.linalg import expm

    s, c = rates.shape
    M = np.zeros((c, c))
    M[:s] = rates
    matrix = np.ascontiguousarray(expm(M * step)[:s])
    matrix.flags.writeable = False
    return matrix
