"""Poles of the feedback that tracks a series: as fast as delay, resonance and noise allow."""

from math import exp, hypot, inf, sqrt

from stickslip.control.landing.tuning import TRACKING
from stickslip.plants import FlexibleArm

_SLOWER = 0.9  # share by which a pole is slowed until noise takes no more


def feedback_poles(
    arm: FlexibleArm,
    *,
    sampling_time: float,
    noise: tuple[float, float],
    effort_limit: float,
    delay: float,
) -> tuple[float, float]:
    """Return the double pole of the feedback, and that of its filter [rad/s].

    The filter is of the velocity, where its noise would take too much of the effort; the poles are
    then as fast as the noise leaves them. Infinite without one. ``noise`` is the standard deviation
    of a position and of a velocity [m or rad, m/s or rad/s], ``delay`` that of the drive in samples
    [-].
    """
    T = sampling_time
    resonance = sqrt(arm.stiffness * (1.0 / arm.mass_1 + 1.0 / arm.mass_2))
    fastest = TRACKING.delay_pole / ((max(delay, 0.0) + TRACKING.sample_delay) * T)
    pole = min(fastest, TRACKING.most_resonance * resonance)
    most = TRACKING.noise_effort * effort_limit
    if arm.mass_1 * _by_noise(pole, inf, T, noise) <= most:
        return pole, inf
    pole = min(0.5 * fastest, pole)
    while arm.mass_1 * _by_noise(pole, TRACKING.filter_pole * pole, T, noise) > most:
        pole *= _SLOWER
    return pole, TRACKING.filter_pole * pole


def _by_noise(pole: float, filtering: float, T: float, noise: tuple[float, float]) -> float:
    """Return the standard deviation of the acceleration by noise [m/s^2 or rad/s^2]."""
    of_position, of_velocity = noise
    b = 1.0 - exp(-filtering * T)
    # Differences of positions have noise that the next ones undo
    differences = of_velocity >= TRACKING.difference_noise * of_position / T > 0.0
    of_velocity *= sqrt((b * b if differences else b) / (2.0 - b))
    return hypot(2.0 * pole * of_velocity, pole**2 * of_position)
