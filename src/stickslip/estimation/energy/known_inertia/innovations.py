"""Whiten the balance of forces of an axis by the Kalman filter of its known masses and spring.

A filter is linear: run with the measurements, and beside them with each friction regressor as the
only force, it turns ``measured = known motion + friction parameters * their responses + noise``
into rows whose noise is white. Least squares on the rows is generalised least squares on the log.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import expm

from stickslip.compiled import compiled

__all__ = ["HeldAxis", "whiten"]


@dataclass(frozen=True, kw_only=True)
class HeldAxis:
    """An axis without friction over one sample: ``z(k+1) = A z(k) + B force + C slope``.

    Attributes
    ----------
    transition
        A, shape (s, s), of the states position and velocity of the driven mass, then of the load.
    held
        B, response to a unit force on the driven mass, held over the sample, shape (s,).
    ramped
        C, response to a force of unit slope that is zero in the middle of the sample, shape (s,).
    """

    transition: Float[np.ndarray, "s s"]
    held: Float[np.ndarray, " s"]
    ramped: Float[np.ndarray, " s"]

    @classmethod
    def of(
        cls,
        *,
        inertia: float,
        load_inertia: float | None,
        stiffness: float | None,
        sampling_time: float,
    ) -> "HeldAxis":
        """Return the axis of known masses and spring; rigid without a load.

        Parameters
        ----------
        inertia, load_inertia
            [kg or kg m^2].
        stiffness
            [N/m or N m/rad].
        sampling_time
            [s].
        """
        T = sampling_time
        s = 2 if load_inertia is None or stiffness is None else 4
        rate = np.zeros((s + 2, s + 2))
        rate[0, 1] = 1.0
        rate[1, s] = 1.0 / inertia
        if load_inertia is not None and stiffness is not None:
            rate[1, 0], rate[1, 2] = -stiffness / inertia, stiffness / inertia
            rate[2, 3] = 1.0
            rate[3, 0], rate[3, 2] = stiffness / load_inertia, -stiffness / load_inertia
        rate[s, s + 1] = 1.0  # the force grows by its slope
        over = np.asarray(expm(rate * T))
        return cls(
            transition=over[:s, :s].copy(),
            held=over[:s, s].copy(),
            ramped=over[:s, s + 1] - 0.5 * T * over[:s, s],
        )


@compiled(inline=True)
def _whiten(
    A: Float[np.ndarray, "s s"],
    B: Float[np.ndarray, " s"],
    C: Float[np.ndarray, " s"],
    u: Float[np.ndarray, " n"],
    measured: Float[np.ndarray, "n m"],
    channels: Float[np.ndarray, "m 2"],
    friction: Float[np.ndarray, "n p"],
    slope: Float[np.ndarray, "n p"],
    disturbance: Float[np.ndarray, " n"],
    first: Float[np.ndarray, " s"],
    T: float,
    s: int,
) -> tuple[Float[np.ndarray, "r p+1"], float]:
    """Do what `whiten` does, for s states."""
    n, m = measured.shape
    p = friction.shape[1]
    Z, N = np.zeros((s, p + 1)), np.zeros((s, p + 1))
    P, M = np.zeros((s, s)), np.zeros((s, s))
    K = np.zeros(s)
    for i in range(s):
        P[i, i] = first[i]
    for c in range(m):
        Z[int(channels[c, 0]), 0] = measured[0, c]
    rows = np.empty(((n - 1) * m, p + 1))
    logs = 0.0
    rough = 12.0 / (T * T)  # variance of the slope fitted to a white force of unit mean square
    for k in range(n - 1):
        for i in range(s):
            for j in range(p + 1):
                total = 0.0
                for h in range(s):
                    total += A[i, h] * Z[h, j]
                N[i, j] = total
            N[i, 0] += B[i] * u[k]
            for j in range(p):
                N[i, j + 1] -= B[i] * friction[k, j] + C[i] * slope[k, j]
            for j in range(s):
                total = 0.0
                for h in range(s):
                    total += A[i, h] * P[h, j]
                M[i, j] = total
        for i in range(s):
            for j in range(p + 1):
                Z[i, j] = N[i, j]
            for j in range(i, s):
                total = (B[i] * B[j] + C[i] * C[j] * rough) * disturbance[k]
                for h in range(s):
                    total += M[i, h] * A[j, h]
                P[i, j] = total
                P[j, i] = total
        for c in range(m):
            i = int(channels[c, 0])
            S = P[i, i] + channels[c, 1]
            logs += np.log(S)
            root = np.sqrt(S)
            for j in range(s):
                K[j] = P[j, i] / S
            r = k * m + c
            for j in range(p + 1):
                e = (measured[k + 1, c] if j == 0 else 0.0) - Z[i, j]
                # measured - (known + theta response) = (measured - known) - theta response
                rows[r, j] = e / root if j == 0 else -e / root
                for h in range(s):
                    Z[h, j] += K[h] * e
            for j in range(s):
                for h in range(j, s):
                    P[j, h] -= K[j] * K[h] * S
                    P[h, j] = P[j, h]
    return rows, logs


@compiled()
def whiten(
    A: Float[np.ndarray, "s s"],
    B: Float[np.ndarray, " s"],
    C: Float[np.ndarray, " s"],
    u: Float[np.ndarray, " n"],
    measured: Float[np.ndarray, "n m"],
    channels: Float[np.ndarray, "m 2"],
    friction: Float[np.ndarray, "n p"],
    slope: Float[np.ndarray, "n p"],
    disturbance: Float[np.ndarray, " n"],
    first: Float[np.ndarray, " s"],
    T: float,
) -> tuple[Float[np.ndarray, "r p+1"], float]:
    """Return the whitened rows, and the sum of the logarithms of their variances.

    Parameters
    ----------
    A, B, C
        The axis over a sample, see `HeldAxis`.
    u
        Effort held over each sample.
    measured
        What the sensors show.
    channels
        Of each sensor: number of the state it measures, variance of its noise.
    friction, slope
        Force of each friction regressor in the middle of each sample, and its slope there.
    disturbance
        Variance of the mean of an unknown force over each sample; within it the force is as rough.
    first
        Variance of the first state; states that are measured begin as measured.
    T
        Sampling time.

    Returns
    -------
    One row a sensor and sample, from the second sample on: measurement, then the response to each
    regressor, less what the filter predicts, over the standard deviation of that.
    """
    # With a number of states that the compiler knows, the loops over them are unrolled
    if A.shape[0] == 4:
        return _whiten(A, B, C, u, measured, channels, friction, slope, disturbance, first, T, 4)
    return _whiten(A, B, C, u, measured, channels, friction, slope, disturbance, first, T, 2)
