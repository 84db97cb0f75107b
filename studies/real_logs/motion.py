"""Smoothed motion of a log, with the filters published for the EMPS benchmark."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float

from stickslip.estimation.signals.kinematics import (
    LowPass,
    central_difference,
    decimate,
    decimated_start,
    default_cutoff,
    noise_level,
    rests,
    slow_speed,
)
from stickslip.records import AxisLog

_ORDER = 4
_SETTLING = 5.0  # periods of the cutoff that are left out at the start, as published
_REST = 2.0  # periods of the cutoff: a reversal passes low speeds faster
_SHORTEST = 0.02  # travel of a move over the range of positions: less is noise


@dataclass(frozen=True, kw_only=True)
class SmoothMotion:
    """Motion of a log without gaps, sample by sample."""

    #: Low-passed and differentiated [m, m/s, m/s^2, or rad ...], shape (n,).
    position: Float[np.ndarray, " n"]
    velocity: Float[np.ndarray, " n"]
    acceleration: Float[np.ndarray, " n"]
    effort: Float[np.ndarray, " n"]  #: Effort that acts at each sample [N or N m], shape (n,).
    slow: float  #: Speed below which the axis may be at rest [m/s or rad/s].
    resting: Bool[np.ndarray, " n"]  #: Whether a sample belongs to a rest, shape (n,).
    start: int  #: First sample used.
    factor: int  #: Of the decimation.

    def decimated(self, columns: Float[np.ndarray, "n p"]) -> Float[np.ndarray, "m p"]:
        """Return filtered and decimated rows of columns, without those at rest."""
        rows = decimate(columns[self.start :], self.factor)
        first = decimated_start(len(columns) - self.start, self.factor)
        return rows[~self.resting[self.start :][first :: self.factor]]

    def moves(self) -> list[tuple[int, int]]:
        """Return the first sample of each move in one direction, and the one after its last."""
        v = self.velocity
        direction = np.where(np.abs(v) > self.slow, np.sign(v), 0.0)
        edges = np.concatenate([[0], np.flatnonzero(np.diff(direction)) + 1, [v.size]])
        least = _SHORTEST * float(np.ptp(self.position))
        return [
            (start, stop)
            for start, stop in pairwise(edges.tolist())
            if direction[start] and abs(self.position[stop - 1] - self.position[start]) > least
        ]


def acting_effort(log: AxisLog, later: float) -> Float[np.ndarray, " n"]:
    """Return the mean of the held effort over a sampling period around each sample [N or N m].

    The mean over a period of a signal that is held from sample to sample is the linear
    interpolation of its samples, half a period earlier than the middle of the period. The log has
    no gaps; ``later`` is the time from the effort's stamp to its effect, over the sampling time
    [-].
    """
    k = np.arange(len(log), dtype=np.float64)
    return np.interp(k - later, k, log.effort)


def smooth_motion(log: AxisLog, *, later: float = 0.5, cutoff: float | None = None) -> SmoothMotion:
    """Return the smoothed motion of a log without gaps, with `acting_effort`.

    ``later`` of half a sample is exact for a held effort without delay, and 0 is how the benchmark
    was published [-]. The cutoff [Hz] is a tenth of the sampling rate by default, and at most 100
    Hz.
    """
    T = log.sampling_time
    low_pass = LowPass(order=_ORDER, cutoff=cutoff or default_cutoff(T))
    period = 1.0 / (low_pass.cutoff * T)
    x = low_pass.apply(log.measured_position, T)
    v = central_difference(x, T)
    noise = noise_level(log.measured_position) * low_pass.noise_gain(T, derivatives=1)
    slow = slow_speed(float(np.max(np.abs(v))), noise)
    return SmoothMotion(
        position=x,
        velocity=v,
        acceleration=central_difference(v, T),
        effort=acting_effort(log, later),
        slow=slow,
        resting=rests(v, slow, round(_REST * period)),
        start=round(_SETTLING * period) - 1,
        factor=round(period),
    )
