"""The linear problem that an estimator makes of a log, before it is solved."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from stickslip.records import AxisKind

__all__ = ["MotionSummary", "Regression", "summarise_motion"]


@dataclass(frozen=True, kw_only=True)
class MotionSummary:
    """What a log's motion excites, in the terms that identifiability is explained in.

    Attributes
    ----------
    largest_speed, speed_noise
        Largest speed, and the standard deviation of its noise [m/s or rad/s].
    forward_travel, backward_travel
        Way travelled in each direction [m or rad].
    position_noise
        Standard deviation of the noise of the positions [m or rad].
    speed_variation
        Standard deviation over mean of the speed while moving [-].
    """

    largest_speed: float
    speed_noise: float
    forward_travel: float
    backward_travel: float
    position_noise: float
    speed_variation: float

    @property
    def travel(self) -> float:
        """Way travelled in both directions [m or rad]."""
        return self.forward_travel + self.backward_travel


def summarise_motion(
    velocities: Sequence[Float[np.ndarray, " _"]],
    sampling_time: float,
    slow: float,
    speed_noise: float,
    position_noise: float,
) -> MotionSummary:
    """Return what the motion of all stretches excites.

    Parameters
    ----------
    velocities
        One array a stretch [m/s or rad/s].
    sampling_time
        [s].
    slow
        Speed below which the axis does not count as moving [m/s or rad/s].
    speed_noise, position_noise
        Standard deviations [m/s or rad/s, m or rad].
    """
    v = np.concatenate(velocities)
    moving = v[np.abs(v) >= slow]
    speed = np.abs(moving)
    variance = max(float(np.var(speed)) - speed_noise**2, 0.0) if speed.size else 0.0
    return MotionSummary(
        largest_speed=float(np.max(np.abs(v))),
        speed_noise=speed_noise,
        forward_travel=float(np.sum(moving[moving > 0])) * sampling_time,
        backward_travel=-float(np.sum(moving[moving < 0])) * sampling_time,
        position_noise=position_noise,
        speed_variation=float(np.sqrt(variance) / np.mean(speed)) if speed.size else 0.0,
    )


@dataclass(frozen=True, kw_only=True)
class Regression:
    """Rows of ``target = regressors @ parameters + nuisance @ anything + residual``.

    Attributes
    ----------
    kind
        ``"linear"`` or ``"rotary"``.
    names
        Parameters, in the order of the columns.
    time
        Of each row [s], shape (n,).
    target, regressors
        Shapes (n,) and (n, p) [SI].
    nuisance
        Columns whose coefficients are fitted but not reported, shape (n, q) [SI].
    regressor_noise
        Root mean square of the sensor noise in each column [SI], shape (p,).
    quantity
        What the target is: ``"effort"`` or ``"energy"``.
    motion
        What the log excites.
    samples
        Number of samples of the log that the rows were made from.
    notes
        What a user should know about how the rows were made, one sentence each.
    """

    kind: AxisKind
    names: tuple[str, ...]
    time: Float[np.ndarray, " n"]
    target: Float[np.ndarray, " n"]
    regressors: Float[np.ndarray, "n p"]
    nuisance: Float[np.ndarray, "n q"]
    regressor_noise: Float[np.ndarray, " p"]
    quantity: Literal["effort", "energy"]
    motion: MotionSummary
    samples: int
    notes: tuple[str, ...] = ()

    def without_nuisance(self) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, "n p"]]:
        """Return target and regressors with the nuisance columns projected out."""
        if self.nuisance.shape[1] == 0:
            return self.target, self.regressors
        basis, _ = np.linalg.qr(self.nuisance)
        return (
            self.target - basis @ (basis.T @ self.target),
            self.regressors - basis @ (basis.T @ self.regressors),
        )

    def relative_residual(self, parameters: Mapping[str, float]) -> float:
        """Return norm of residual over norm of target [-] with given parameters.

        With the regression of another log than the parameters were fitted to, this is a cross-test.

        Parameters
        ----------
        parameters
            Value of each of `names` [SI].
        """
        target, regressors = self.without_nuisance()
        values = np.array([parameters[name] for name in self.names])
        residual = target - regressors @ values
        return float(np.linalg.norm(residual) / np.linalg.norm(target))
