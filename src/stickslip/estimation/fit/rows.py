"""Rows of a linear regression, before it is solved."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from stickslip.estimation.fit.intervals import Overlap
from stickslip.estimation.signals.kinematics import slow_speed
from stickslip.estimation.signals.sensor_noise import encoder_step
from stickslip.records import AxisKind

SMALLEST_SINGULAR_RATIO = 0.01
"""Smallest over largest singular value of columns of unit norm [-]: below it they differ by less
than 1 % of their content, which sensor and model errors exceed."""

RESOLUTION = 2e-5
"""Relative error of sums over samples and of filters [-]. It bounds the intervals: without noise
their width would go to zero around a value with this error."""


@dataclass(frozen=True, kw_only=True)
class MotionSummary:
    """Excitation of a log's motion, for verdicts on identifiability."""

    largest_speed: float  #: Largest speed [m/s or rad/s].
    speed_noise: float  #: Standard deviation of the noise of the speed [m/s or rad/s].
    forward_travel: float  #: Distance travelled forward [m or rad].
    backward_travel: float  #: Distance travelled backward [m or rad].
    position_range: float  #: Largest less smallest position [m or rad].
    #: Standard deviation of the noise of the positions, or their smallest step where that is larger
    #: [m or rad].
    position_noise: float
    speed_variation: float  #: Standard deviation over mean of the speed while moving [-].

    @property
    def travel(self) -> float:
        """Distance travelled in both directions [m or rad]."""
        return self.forward_travel + self.backward_travel


def summarise_motion(
    positions: Sequence[Float[np.ndarray, " _"]],
    velocities: Sequence[Float[np.ndarray, " _"]],
    sampling_time: float,
    noise: tuple[float, float],
) -> MotionSummary:
    """Return the excitation of the motion of all stretches.

    Positions are as measured, velocities smoothed; the noise is the standard deviation of both [m
    or rad, m/s or rad/s].
    """
    x, v = np.concatenate(positions), np.concatenate(velocities)
    largest = float(np.max(np.abs(v)))
    moving = v[np.abs(v) >= slow_speed(largest, noise[1])]
    speed = np.abs(moving)
    variance = max(float(np.var(speed)) - noise[1] ** 2, 0.0) if speed.size else 0.0
    return MotionSummary(
        largest_speed=largest,
        speed_noise=noise[1],
        forward_travel=float(np.sum(moving[moving > 0])) * sampling_time,
        backward_travel=-float(np.sum(moving[moving < 0])) * sampling_time,
        position_range=float(np.ptp(x)),
        position_noise=max(noise[0], *(encoder_step(part) for part in positions)),
        speed_variation=float(np.sqrt(variance) / np.mean(speed)) if np.any(speed) else 0.0,
    )


@dataclass(frozen=True, kw_only=True)
class Regression:
    """Rows of ``target = regressors @ parameters + residual``."""

    kind: AxisKind  #: ``"linear"`` or ``"rotary"``.
    names: tuple[str, ...]  #: Parameters, in the order of the columns.
    time: Float[np.ndarray, " n"]  #: Of each row [s], shape (n,).
    target: Float[np.ndarray, " n"]  #: Shape (n,) [SI].
    regressors: Float[np.ndarray, "n p"]  #: Shape (n, p) [SI].
    #: Root mean square of the sensor noise in each column [SI], shape (p,).
    regressor_noise: Float[np.ndarray, " p"]
    #: Quantity of the target, ``"effort"``, ``"energy"`` or ``"position"``.
    quantity: Literal["effort", "energy", "position"]
    motion: MotionSummary  #: Excitation of the log.
    samples: int  #: Number of samples of the log that the rows were made from.
    #: Notes for the user on the origin of the rows, one sentence each.
    notes: tuple[str, ...] = ()
    #: Norm of the rows of the effort alone [SI], if the target is that less the forces of known
    #: masses; otherwise 0.
    effect: float = 0.0
    #: Whether the rows are known to bias the parameters by more than their intervals.
    biased: bool = False
    #: Share of the strongest combination of columns of unit norm below which a combination is not
    #: determined [-]; less than its default only where no filter has touched the motion.
    smallest_singular_ratio: float = SMALLEST_SINGULAR_RATIO
    resolution: float = RESOLUTION  #: Share of the target that the rows resolve [-].
    #: Estimated delay of the effort [samples]; None if none was searched.
    effort_delay: int | None = None
    #: Deviations of the parameters beyond their sampling error, by other data or models [SI],
    #: shape (k, p); None for none. They widen the intervals.
    shifts: Float[np.ndarray, "k p"] | None = None
    #: Differences to the parameters of other laws of friction that explain the rows as well [SI],
    #: shape (laws, p); None for none. The intervals contain those of all laws. Identifiability is
    #: judged within the selected law alone.
    law_shifts: Float[np.ndarray, "laws p"] | None = None
    #: Whether the intervals allow for a residual that is strongest where it is slowest, as under a
    #: drifting force (`robust_uncertainty`).
    slow_residual: bool = False
    #: Correlation of the rows under white noise of the signal that they are means of; None if it is
    #: not known. Variances that are smaller than under white noise are pooled with those.
    overlap: Overlap | None = None
    #: Whether the intervals of all parameters hold together with 95 %, as they must after the terms
    #: were selected by the same data.
    simultaneous: bool = False
    #: The effort in each row [N or N m], shape (n,), where the shape of a term can be a parameter:
    #: the target then holds derivatives with respect to shapes as well, and a static friction or
    #: Stribeck velocity close to zero is no result. None if no shape is estimated.
    effort: Float[np.ndarray, " n"] | None = None
    #: Number of the log that each row is from [-], shape (n,); None for one log.
    log: Int[np.ndarray, " n"] | None = None
    #: Parameters that may be unidentified without an effect on the status.
    nuisance: frozenset[str] = frozenset()

    @property
    def scale(self) -> float:
        """Norm that a residual is compared with [SI]."""
        if self.effort is not None:
            return float(np.linalg.norm(self.effort))
        return max(float(np.linalg.norm(self.target)), self.effect)

    def relative_residual(self, parameters: Mapping[str, float]) -> float:
        """Return the norm of the residual over `scale` [-] with given parameters [SI].

        With the regression of another log than the parameters were fitted to, this is a cross-test.
        """
        values = np.array([parameters[name] for name in self.names])
        residual = self.target - self.regressors @ values
        return float(np.linalg.norm(residual)) / self.scale


_BLOCK = 256  # rows of a block that fits into the cache


def triangle(matrix: Float[np.ndarray, "n p"]) -> Float[np.ndarray, "r p"]:
    """Return R of the QR decomposition of a matrix with many rows, first of blocks of them."""
    n, p = matrix.shape
    whole = n - n % _BLOCK
    blocks = np.asarray(np.linalg.qr(matrix[:whole].reshape(-1, _BLOCK, p), mode="r"))
    return np.asarray(
        np.linalg.qr(np.concatenate([blocks.reshape(-1, p), matrix[whole:]]), mode="r")
    )


def least_squares(
    regressors: Float[np.ndarray, "n p"], target: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " p"]:
    """Return the least-squares parameters, whatever the units of the columns.

    Columns are scaled to unit norm first: otherwise the solver takes a column that is small in its
    unit for one without content.
    """
    norms = np.linalg.norm(regressors, axis=0)
    norms[norms == 0] = 1.0
    values, *_ = np.linalg.lstsq(regressors / norms, target, rcond=None)
    return values / norms
