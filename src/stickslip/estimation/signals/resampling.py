"""Resampling of logs whose time stamps jitter, as filters need uniform samples."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from stickslip.records import AxisLog

SMALLEST_JITTER = 0.01
"""Deviation of a time step [sampling times] below which samples are taken as uniform."""


def resampled(log: AxisLog, *, held: bool = True) -> tuple[AxisLog, tuple[str, ...]]:
    """Return a log with uniform samples between its gaps, and a note if it was resampled.

    If the time stamps jitter, positions are interpolated by a cubic spline and velocities linearly.
    The effort is the mean of the held effort over each new sample, which keeps the input energy. An
    effort that is not ``held`` is the value at the time stamp, and is interpolated linearly.
    """
    if log.timing_jitter < SMALLEST_JITTER:
        return log, ()
    parts = [_resampled(part, log.sampling_time, held) for part in log.segments()]

    def joined(name: str) -> Float[np.ndarray, " m"] | None:
        values = [getattr(part, name) for part in parts]
        return None if values[0] is None else np.concatenate(values)

    names = ("time", "effort", "measured_position", "measured_velocity")
    loads = ("measured_load_position", "measured_load_velocity", "model_effort")
    uniform = replace(log, **{name: joined(name) for name in (*names, *loads)})
    return uniform, (
        f"time steps deviate by up to {100 * log.timing_jitter:.0f} %, so the log was resampled "
        f"every {1e3 * log.sampling_time:.4g} ms",
    )


def _resampled(part: AxisLog, sampling_time: float, held: bool) -> AxisLog:
    start, end = float(part.time[0]), float(part.time[-1])
    count = int(np.floor((end - start) / sampling_time * (1.0 + 1e-12))) + 1
    time = start + sampling_time * np.arange(max(count, 2))
    time = np.minimum(time, end) if count >= 2 else np.array([start, end])

    def position(values: Float[np.ndarray, " n"]) -> Float[np.ndarray, " m"]:
        return np.asarray(CubicSpline(part.time, values)(time))

    def linear(values: Float[np.ndarray, " n"] | None) -> Float[np.ndarray, " m"] | None:
        return None if values is None else np.interp(time, part.time, values)

    impulse = np.concatenate(([0.0], np.cumsum(part.effort[:-1] * np.diff(part.time))))
    mean = np.diff(np.interp(time, part.time, impulse)) / np.diff(time)
    effort = np.append(mean, part.effort[-1]) if held else np.interp(time, part.time, part.effort)
    load = part.measured_load_position
    return replace(
        part,
        time=time,
        effort=effort,
        measured_position=position(part.measured_position),
        measured_velocity=linear(part.measured_velocity),
        measured_load_position=None if load is None else position(load),
        measured_load_velocity=linear(part.measured_load_velocity),
        model_effort=linear(part.model_effort),
    )
