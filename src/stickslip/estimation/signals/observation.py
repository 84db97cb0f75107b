"""Motion of a log, with its noise estimated and kept out of the regressors."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy import linalg

from stickslip.estimation.energy.balance import sample_integrals, travel_direction
from stickslip.estimation.signals.kinematics import (
    REST_PERIODS,
    LowPass,
    central_difference,
    noise_level,
    rests,
    slow_speed,
)
from stickslip.estimation.signals.sensor_noise import position_noise
from stickslip.records import AxisLog

CLEAN = 1e-6
"""Noise over the largest value [-] below which it counts as rounding, and nothing is smoothed."""

CLEAN_STEP = 1e-4
"""The same for positions, over the rms step from sample to sample [-]: the range of the positions
grows with the log, and noise would count as rounding after a long travel."""

HYSTERESIS = 10.0
"""Least size of a reversal in standard deviations of the smoothed position [-]: its noise is
correlated, and a false reversal adds twice its size to the distance travelled."""

CERTIFIED = 1.4
"""Largest ratio of the estimated noise to the one that positions and velocities allow [-], up to
which rough values count as noise."""

HARMLESS = 0.01
"""Noise over the rms speed [-] below which it is smoothed only if it is certified: it biases less
than a filter that smooths the motion too."""

_QUANTILE = 0.8  # the largest fifth of the differences may be jumps of the force [-]
_QUANTILE_NORMAL = 1.2815515655446004  # that quantile of abs(standard normal)


@dataclass(frozen=True, kw_only=True)
class MotionNoise:
    """Standard deviations of the white noise on the measurements; 0 if it is rounding only."""

    position: float  #: Of the measured values [m or rad].
    velocity: float  #: Of the measured values [m/s or rad/s]; 0 if it is not measured.
    smooth_position: float  #: Of what is used in the regressors [m or rad].
    smooth_velocity: float  #: Of what is used in the regressors [m/s or rad/s].
    #: Whether the measured velocity needs smoothing: its sign in a single sample is not certain.
    noisy: bool

    @property
    def used_velocity(self) -> float:
        """Noise of the velocity in the energies [m/s or rad/s], measured or differentiated."""
        return self.velocity if self.velocity > 0 else self.smooth_velocity


@dataclass(frozen=True, kw_only=True)
class ObservedMotion:
    """One stretch of a log, ready for energies."""

    #: Position and velocity of the (first) mass, fused [m or rad], shape (n,).
    position: Float[np.ndarray, " n"]
    #: Velocity as measured (or differentiated) [m/s or rad/s], shape (n,).
    velocity: Float[np.ndarray, " n"]
    smooth_velocity: Float[np.ndarray, " n"]  #: The same low-passed.
    direction: Float[np.ndarray, " n-1"]  #: Direction of travel in each sample [-].
    path: Float[np.ndarray, " n-1"]  #: Distance travelled in each sample [m or rad].
    #: Integral of the squared velocity over each sample [m^2/s or rad^2/s].
    velocity_squared: Float[np.ndarray, " n-1"]
    resting: Bool[np.ndarray, " n"]  #: Whether each sample belongs to a rest, shape (n,).


def motion_noise(
    position: Float[np.ndarray, " n"],
    velocity: Float[np.ndarray, " n"] | None,
    low_pass: LowPass,
    sampling_time: float,
) -> MotionNoise:
    """Return the noise of a stretch's measurements and of the motion that `observe` returns."""
    if velocity is None:
        sw = position_noise(position)
        return MotionNoise(
            position=sw,
            velocity=0.0,
            smooth_position=sw * low_pass.noise_gain(sampling_time, derivatives=0),
            smooth_velocity=sw * low_pass.noise_gain(sampling_time, derivatives=1),
            noisy=False,
        )
    sw, sv = noise_level(position), noise_level(velocity)
    most_sw, most_sv = largest_noise(position, velocity, sampling_time)
    harmless = HARMLESS * float(np.sqrt(np.mean(velocity**2)))
    smoothing_pays = sv <= CERTIFIED * most_sv or most_sv > harmless
    sw, sv = min(sw, most_sw), min(sv, most_sv)
    steps = float(np.sqrt(np.mean(np.diff(position) ** 2)))
    sw = sw if sw > CLEAN_STEP * steps else 0.0
    sv = sv if sv > CLEAN * float(np.max(np.abs(velocity))) else 0.0
    # Smoothed local level: steps of variance q between measurements of variance sw^2
    q = (sampling_time * sv) ** 2
    share = np.sqrt(q / (q + 4 * sw**2)) if q > 0 else 0.0
    return MotionNoise(
        position=sw,
        velocity=sv,
        smooth_position=sw * float(np.sqrt(share)),
        smooth_velocity=sv * low_pass.noise_gain(sampling_time, derivatives=0),
        noisy=sv > 0 and smoothing_pays,
    )


def largest_noise(
    position: Float[np.ndarray, " n"], velocity: Float[np.ndarray, " n"], sampling_time: float
) -> tuple[float, float]:
    """Return the largest noise of positions and velocities that their agreement allows [SI].

    Where the force is held over each sample, dx / T is the mean velocity of its ends, however fast
    the motion is for the sampling. With noise sigma_x and sigma_v the difference d of both has
    var(d(k) - d(k-1)) = 6 sigma_x^2 / T^2 + sigma_v^2 / 2 and
    var(d(k) + d(k-1)) = 2 sigma_x^2 / T^2 + 3 sigma_v^2 / 2, so that each bounds one of them. Two
    samples hold one d, and bound nothing.
    """
    T = sampling_time
    d = np.diff(position) / T - 0.5 * (velocity[1:] + velocity[:-1])
    if d.size < 2:
        return np.inf, np.inf
    less, more = (
        float(np.quantile(np.abs(part), _QUANTILE)) / _QUANTILE_NORMAL
        for part in (np.diff(d), d[1:] + d[:-1])
    )
    return T * less / float(np.sqrt(6.0)), more * float(np.sqrt(2.0 / 3.0))


def fuse(
    position: Float[np.ndarray, " n"],
    velocity: Float[np.ndarray, " n"],
    position_noise: float,
    velocity_noise: float,
    sampling_time: float,
) -> Float[np.ndarray, " n"]:
    """Return the position that fits measured positions and velocities best.

    Least squares of both errors, with the step of the position over a sample T (v_- + v) / 2: no
    motion is assumed smooth, so nothing is smoothed. A signal without noise (standard deviation
    [m or rad, m/s or rad/s]) is reproduced.
    """
    if position_noise == 0:
        return position
    step = 0.5 * sampling_time * (velocity[1:] + velocity[:-1])
    at_position = 1.0 / position_noise**2
    # Neighbouring steps share a velocity: over many steps each adds an error of T sigma_v
    at_step = 1.0 / max(sampling_time * velocity_noise, CLEAN * position_noise) ** 2
    bands = np.zeros((2, position.size))
    bands[1] = at_position
    bands[1, :-1] += at_step
    bands[1, 1:] += at_step
    bands[0, 1:] = -at_step
    right = at_position * position
    right[:-1] -= at_step * step
    right[1:] += at_step * step
    return np.asarray(linalg.solveh_banded(bands, right), dtype=np.float64)


def smoothed(
    position: Float[np.ndarray, " n"],
    velocity: Float[np.ndarray, " n"] | None,
    low_pass: LowPass,
    noise: MotionNoise,
    sampling_time: float,
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Return position, velocity and smooth velocity of a mass, as `ObservedMotion` has them.

    Without measured velocity the low-pass also makes the position differentiable.
    """
    if velocity is None:
        x = low_pass.apply(position, sampling_time)
        v = central_difference(x, sampling_time)
        return x, v, v
    x = fuse(position, velocity, noise.position, noise.velocity, sampling_time)
    return x, velocity, low_pass.apply(velocity, sampling_time) if noise.noisy else velocity


def observe(
    log: AxisLog, low_pass: LowPass, noise: MotionNoise, sampling_time: float
) -> ObservedMotion:
    """Return the motion of the (first) mass in one stretch of a log without gaps."""
    T = sampling_time
    x, v, smooth = smoothed(log.measured_position, log.measured_velocity, low_pass, noise, T)
    direction = travel_direction(x, HYSTERESIS * noise.smooth_position)
    path, squared = sample_integrals(x, v, smooth, direction, T, noise.noisy)
    largest = float(np.max(np.abs(smooth)))
    threshold = slow_speed(largest, noise.smooth_velocity)
    least = round(REST_PERIODS / (low_pass.cutoff * T))
    resting = rests(smooth, threshold, least)
    if log.measured_velocity is None:
        # The same noise is in both ends of a sample, so its square is in their product
        squared -= np.where(resting[:-1], 0.0, T * noise.smooth_velocity**2)
    return ObservedMotion(
        position=x,
        velocity=v,
        smooth_velocity=smooth,
        direction=direction,
        path=path,
        velocity_squared=squared,
        resting=resting,
    )
