"""Find measured velocities that come later than the positions they belong to."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.kinematics import LowPass
from stickslip.records import AxisLog

__all__ = ["velocity_delay", "without_late_velocity"]

LARGEST_DELAY = 0.1
"""Delay, in samples, that a measured velocity may have: half a sample already moves energies from
friction to inertia."""

_SIGNIFICANCE = 5.0


def velocity_delay(
    position: Float[np.ndarray, " n"],
    velocity: Float[np.ndarray, " n"],
    low_pass: LowPass,
    sampling_time: float,
) -> tuple[float, float]:
    """Return the delay of a velocity against a position and its standard deviation [s].

    A velocity that is late by tau differs from the position's derivative by tau times the
    acceleration; both are compared over samples, low-passed alike.

    Parameters
    ----------
    position, velocity
        As measured [m or rad, m/s or rad/s].
    low_pass
        What smooths.
    sampling_time
        [s].
    """
    T = sampling_time
    late = low_pass.apply(np.diff(position) / T - 0.5 * (velocity[1:] + velocity[:-1]), T)
    acceleration = low_pass.apply(np.diff(velocity) / T, T)
    power = float(np.sum(acceleration**2))
    if power == 0.0:
        return 0.0, np.inf
    delay = float(np.sum(late * acceleration)) / power
    residual = late - delay * acceleration
    # Run both ways, the low-pass leaves about one independent sample in a period of its cutoff
    repeats = max(1.0 / (low_pass.cutoff * T), 1.0)
    return delay, float(np.sqrt(np.mean(residual**2) * repeats / power))


def without_late_velocity(log: AxisLog, low_pass: LowPass) -> tuple[AxisLog, tuple[str, ...]]:
    """Return the log without velocities that come late, and a note if there were any.

    Drives often log the difference of the last two positions, half a sample late, or a filtered
    velocity. The position tells better.

    Parameters
    ----------
    log
        One stretch or several.
    low_pass
        What smooths.
    """
    T = log.sampling_time
    longest = max(log.segments(), key=len)
    if longest.measured_velocity is None:
        return log, ()
    delay, std = velocity_delay(longest.measured_position, longest.measured_velocity, low_pass, T)
    if abs(delay) <= LARGEST_DELAY * T or abs(delay) <= _SIGNIFICANCE * std:
        return log, ()
    note = (
        f"the measured velocity is {1e3 * delay:.3g} ms late against the position "
        f"({delay / T:.2g} samples), so velocities are differences of the position instead"
    )
    return replace(log, measured_velocity=None, measured_load_velocity=None), (note,)
