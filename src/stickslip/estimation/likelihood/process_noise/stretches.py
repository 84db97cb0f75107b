"""Stretches of a log in which the axis surely slips in one direction, and smoothed signals."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.signal import savgol_filter

from stickslip.estimation.likelihood.process_noise.feedback import feedback_effort
from stickslip.estimation.likelihood.process_noise.tuning import Tuning
from stickslip.records import AxisLog

__all__ = ["SlipSegment", "slip_segments"]


@dataclass(frozen=True, kw_only=True)
class SlipSegment:
    """One stretch of a log without gaps, with what the filter needs of it.

    Attributes
    ----------
    time, effort
        [s, N or N m], shape (n,).
    feedback
        Part of the effort that answers to the measured position [N or N m], shape (n,).
    position
        As measured [m or rad], shape (n,).
    velocity
        As measured [m/s or rad/s], shape (n,), or None.
    direction
        1, -1, or 0 where the axis does not surely slip [-], shape (n,).
    jumps
        Where the effort jumps, shape (n,).
    smooth_velocity, smooth_acceleration, smooth_effort
        By local polynomials over one window [SI], shape (n,).
    """

    time: Float[np.ndarray, " n"]
    effort: Float[np.ndarray, " n"]
    feedback: Float[np.ndarray, " n"]
    position: Float[np.ndarray, " n"]
    velocity: Float[np.ndarray, " n"] | None
    direction: Int[np.ndarray, " n"]
    jumps: Bool[np.ndarray, " n"]
    smooth_velocity: Float[np.ndarray, " n"]
    smooth_acceleration: Float[np.ndarray, " n"]
    smooth_effort: Float[np.ndarray, " n"]

    def known_with(self, shift: int) -> Float[np.ndarray, " n"]:
        """Return the feedback as it acts so many samples later."""
        return self.feedback[np.clip(np.arange(self.time.size) - shift, 0, self.time.size - 1)]

    def measured_with(self, shift: int) -> Float[np.ndarray, "n c"]:
        """Return position, effort without feedback as it acts later, and velocity if measured."""
        places = np.clip(np.arange(self.time.size) - shift, 0, self.time.size - 1)
        columns = [self.position, (self.effort - self.feedback)[places]]
        if self.velocity is not None:
            columns.append(self.velocity)
        return np.column_stack(columns)


def slip_segments(log: AxisLog, position_noise: float, tuning: Tuning) -> list[SlipSegment]:
    """Return the stretches without gaps of a log, with the direction of travel of every sample.

    Samples slower than a share of the largest speed are masked, and those beside them: there the
    direction is not certain, and friction is not that of the model if it depends on position or
    rises at low speed.

    Parameters
    ----------
    log
        Uniformly sampled but for gaps.
    position_noise
        Standard deviation [m or rad].
    tuning
        Windows and thresholds.
    """
    T = log.sampling_time
    long = _odd(tuning.smoothing_time / T)
    parts = [part for part in log.segments() if len(part) > 2 * long]
    largest = max(
        (float(np.max(np.abs(_polynomial(p.measured_position, long, T, 1)))) for p in parts),
        default=0.0,
    )
    slow = tuning.min_speed_ratio * largest
    if slow == 0.0:
        return []
    # Slope of a line through w samples: its variance is 12 sigma^2/(w^3 T^2)
    needed = (12.0 * (tuning.speed_certainty * position_noise / (slow * T)) ** 2) ** (1.0 / 3.0)
    window = min(_odd(max(needed, tuning.least_window)), long)
    noise = position_noise * float(np.sqrt(12.0 / window**3)) / T
    slow = max(slow, tuning.speed_certainty * noise)
    segments: list[SlipSegment] = []
    for part in parts:
        velocity = _polynomial(part.measured_position, window, T, 1)
        direction = np.where(np.abs(velocity) > slow, np.sign(velocity), 0.0).astype(np.int64)
        segments.append(
            SlipSegment(
                time=part.time,
                effort=part.effort,
                feedback=feedback_effort(part.effort, part.measured_position),
                position=part.measured_position,
                velocity=part.measured_velocity,
                direction=_eroded(direction, window // 2 + 1, tuning.least_stretch),
                jumps=np.zeros(direction.size, dtype=bool),
                smooth_velocity=_polynomial(part.measured_position, long, T, 1),
                smooth_acceleration=_polynomial(part.measured_position, long, T, 2),
                smooth_effort=_polynomial(part.effort, long, T, 0),
            )
        )
    return [segment for segment in segments if np.any(segment.direction)]


def _odd(samples: float) -> int:
    """Return an odd number of samples, 5 or more."""
    return max(2 * int(samples / 2) + 1, 5)


def _polynomial(
    values: Float[np.ndarray, " n"], window: int, sampling_time: float, derivative: int
) -> Float[np.ndarray, " n"]:
    """Return a derivative of the local parabola through a window of samples."""
    return np.asarray(savgol_filter(values, window, 2, deriv=derivative, delta=sampling_time))


def _eroded(direction: Int[np.ndarray, " n"], margin: int, least: int) -> Int[np.ndarray, " n"]:
    """Return the directions without margins at both ends of each stretch and short stretches."""
    edges = np.flatnonzero(np.diff(direction)) + 1
    bounds = np.concatenate(([0], edges, [direction.size]))
    kept = np.zeros_like(direction)
    for start, stop in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        first = start + (margin if start else 0)
        last = stop - (margin if stop < direction.size else 0)
        if direction[start] != 0 and last - first >= least:
            kept[first:last] = direction[start]
    return kept
