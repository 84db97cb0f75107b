"""Velocities and load of an arm that are not measured, and the lag of velocities.

Velocities of a filter lag, and differences of positions by half a sample.
"""

from dataclasses import dataclass, replace
from math import cos, hypot, isfinite, pi, sin, sqrt

import numpy as np
from jaxtyping import Float

from stickslip.control.guard_kernels import EARLIEST
from stickslip.control.landing.tuning import LEARNING
from stickslip.plants import FlexibleArm
from stickslip.records import SensorSample


@dataclass(frozen=True, kw_only=True)
class VelocityLag:
    """Estimate of the lag of measured velocities.

    The mean velocity over a sample is d = (x - x_) / T - (v + v_) / 2 more than the mean of the
    measured ones, and d = a tau with the acceleration a. It is a regression of d on a: of mass 2,
    a = ks (x1 - x2) / m2 by positions alone; where the load is not measured of mass 1, by its
    velocities, which is exact for differences of positions.
    """

    products: float = 0.0  #: Sum of a d [m^2/s^3 or rad^2/s^3].
    squares: float = 0.0  #: Sum of a^2 [m^2/s^4 or rad^2/s^4].

    def after(
        self, last: SensorSample, sample: SensorSample, arm: FlexibleArm | None
    ) -> "VelocityLag":
        """Return the estimate after two successive samples; without an arm by mass 1."""
        dt = sample.time - last.time
        if arm is None:
            travel = sample.measured_position - last.measured_position
            before, now = last.measured_velocity, sample.measured_velocity
            a = (now - before) / dt
        else:
            travel = sample.measured_load_position - last.measured_load_position
            before, now = last.measured_load_velocity, sample.measured_load_velocity
            a = 0.5 * (acceleration(arm, last) + acceleration(arm, sample))
        d = travel / dt - 0.5 * (before + now)
        return replace(self, products=self.products + a * d, squares=self.squares + a * a)

    def estimate(self, sampling_time: float, noise: tuple[float, float]) -> float:
        """Return the lag [s]; 0 where it is not certain.

        ``noise`` is the standard deviation of a position and of a velocity [m, m/s or rad, rad/s].
        """
        if self.squares == 0.0:
            return 0.0
        lag = self.products / self.squares
        spread = hypot(noise[0] * sqrt(2.0) / sampling_time, noise[1] / sqrt(2.0))
        certain = LEARNING.significance * spread / sqrt(self.squares)
        certain = max(certain, LEARNING.least_lag * sampling_time)
        return min(lag, LEARNING.most_lag * sampling_time) if lag > certain else 0.0


def acceleration(arm: FlexibleArm, sample: SensorSample) -> float:
    """Return that of mass 2 by the spring [m/s^2 or rad/s^2]."""
    stretch = sample.measured_position - sample.measured_load_position
    return arm.stiffness / arm.mass_2 * stretch


def swing_deviation(
    samples: int, sampling_time: float, half_swing: float, noise: tuple[float, float]
) -> float:
    """Return the standard deviation of a swing that some samples show [m or rad].

    Velocities show its rate, and so do positions along an arc of it. The ``noise`` is the standard
    deviation of a position and of a velocity [m or rad, m/s or rad/s]; the times are in s.
    """
    w = pi / half_swing
    of_position, rate, arc = noise[0], noise[1] / w, w * sampling_time * samples
    by_positions = sqrt(12.0) * of_position / arc
    if rate > 0.0:
        rate = rate / hypot(1.0, rate / by_positions) if by_positions > 0.0 else 0.0
    return hypot(of_position, rate) / sqrt(samples)


def with_lag(
    seen: Float[np.ndarray, "n 4"], lag: float, sampling_time: float
) -> Float[np.ndarray, "n 4"]:
    """Return positions and velocities of a series, the positions with the lag of velocities [s]."""
    if lag == 0.0:
        return seen
    k = np.arange(len(seen), dtype=np.float64)
    at = np.maximum(k - lag / sampling_time, 0.0)
    s = at - np.floor(at)
    lagging = seen.copy()
    for column in (0, 2):
        position = seen[:, column]
        bend = np.zeros_like(position)
        bend[1:-1] = np.diff(position, 2)
        straight = np.interp(at, k, position)
        lagging[:, column] = straight - 0.5 * s * (1.0 - s) * np.interp(at, k, bend)
    return lagging


def with_velocities(
    last: SensorSample | None, sample: SensorSample, sampling_time: float
) -> SensorSample:
    """Return a sample with differences of positions for velocities that are not measured."""
    if isfinite(sample.measured_velocity):
        return sample
    if last is None:
        return sample._replace(measured_velocity=0.0, measured_load_velocity=0.0)
    dt = sample.time - last.time
    if dt < EARLIEST * sampling_time:  # no new information
        v1, v2 = last.measured_velocity, last.measured_load_velocity
    else:
        v1 = (sample.measured_position - last.measured_position) / dt
        v2 = (sample.measured_load_position - last.measured_load_position) / dt
    return sample._replace(measured_velocity=v1, measured_load_velocity=v2)


def with_load(
    last: SensorSample | None,
    sample: SensorSample,
    arm: FlexibleArm,
    sampling_time: float,
    *,
    velocities: bool,
) -> SensorSample:
    """Return a sample in which mass 2 is not measured with its computed position and velocity.

    x2'' = w^2 (x1 - x2), exact for the cubic x1(t) through the positions and velocities of two
    samples, or the straight line without ``velocities``.
    """
    x1 = sample.measured_position
    if last is None:
        return sample._replace(measured_load_position=x1, measured_load_velocity=0.0)
    dt = sample.time - last.time
    if dt < EARLIEST * sampling_time:  # no new information
        return sample._replace(
            measured_load_position=last.measured_load_position,
            measured_load_velocity=last.measured_load_velocity,
        )
    x = last.measured_position
    v, v1 = (x1 - x) / dt, (x1 - x) / dt
    if velocities:
        v, v1 = last.measured_velocity, sample.measured_velocity
    # x1 = x + v t + a t^2/2 + j t^3/6 through both samples
    d, e = x1 - x - v * dt, v1 - v
    a, j = (6.0 * d / dt - 2.0 * e) / dt, (6.0 * e - 12.0 * d / dt) / dt**2
    # A particular solution is x1 - x1''/w^2; the rest swings freely
    ww = arm.stiffness / arm.mass_2
    w = sqrt(ww)
    offset = last.measured_load_position - (x - a / ww)
    rate = last.measured_load_velocity - (v - j / ww)
    c, s = cos(w * dt), sin(w * dt)
    return sample._replace(
        measured_load_position=x1 - (a + j * dt) / ww + offset * c + rate / w * s,
        measured_load_velocity=v1 - j / ww + rate * c - offset * w * s,
    )
