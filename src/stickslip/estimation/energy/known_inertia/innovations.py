"""Whiten the balance of forces of an axis by the Kalman filter of its known masses and spring.

A filter is linear: run with the measurements, and beside them with each friction regressor as the
only force, it turns ``measured = known motion + friction parameters * their responses + noise``
into rows whose noise is white. Least squares on the rows is generalised least squares on the log.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import expm

from stickslip.numerics import kalman

__all__ = ["HeldAxis"]


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
    sampling_time
        [s].
    """

    transition: Float[np.ndarray, "s s"]
    held: Float[np.ndarray, " s"]
    ramped: Float[np.ndarray, " s"]
    sampling_time: float

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
            sampling_time=T,
        )

    def whiten(
        self,
        effort: Float[np.ndarray, " n"],
        measured: Float[np.ndarray, "n m"],
        channels: Float[np.ndarray, "m 2"],
        friction: Float[np.ndarray, "n p"],
        slope: Float[np.ndarray, "n p"],
        disturbance: Float[np.ndarray, " n"],
        first: Float[np.ndarray, " s"],
    ) -> tuple[Float[np.ndarray, "r p+1"], float]:
        """Return the whitened rows, and the sum of the logarithms of their variances.

        Parameters
        ----------
        effort
            Held over each sample [N or N m].
        measured
            Measurement of each sensor [SI].
        channels
            Of each sensor: number of the state it measures, variance of its noise.
        friction, slope
            Force of each friction regressor in the middle of each sample, and its slope there.
        disturbance
            Variance of the mean of an unknown force over each sample; within it the force is as
            rough [N^2 or (N m)^2].
        first
            Variance of the first state; states that are measured begin as measured.

        Returns
        -------
        One row a sensor and sample, from the second sample on: measurement, then the response to
        each regressor, less what the filter predicts, over the standard deviation of that.
        """
        sensors = channels[:, 0].astype(np.int64)
        n, p = friction.shape
        inputs = np.zeros((n - 1, 2, p + 1))
        inputs[:, 0, 0] = effort[:-1]
        inputs[:, 0, 1:], inputs[:, 1, 1:] = -friction[:-1], -slope[:-1]
        outputs = np.zeros((n - 1, sensors.size, p + 1))
        outputs[:, :, 0] = measured[1:]
        start = np.zeros((first.size, p + 1))
        start[sensors, 0] = measured[0]
        rough = 12.0 / self.sampling_time**2  # variance of the slope of a white force
        spread = np.outer(self.held, self.held) + np.outer(self.ramped, self.ramped) * rough
        model = kalman.LinearModel(
            A=self.transition,
            B=np.column_stack([self.held, self.ramped]),
            Q=spread,
            factors=disturbance[:-1],
            sensors=sensors,
            R=channels[:, 1].copy(),
        )
        rows, logs = kalman.whiten(model, inputs, outputs, start, np.diag(first))
        rows[:, :, 1:] *= -1.0  # measured less known motion = parameters times responses
        return rows.reshape(-1, p + 1), logs
