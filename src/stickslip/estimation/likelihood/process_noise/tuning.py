"""Tuning constants of the maximum likelihood with process noise."""

from dataclasses import dataclass

__all__ = ["Tuning"]


@dataclass(frozen=True, kw_only=True)
class Tuning:
    """Tuning of the maximum likelihood with process noise."""

    min_speed_ratio: float = 0.01
    """Share of the largest speed below which samples are masked [-]. The direction of slower motion
    is uncertain near reversals. The standard error of Coulomb friction grows by 3 % at 0.01 and by
    10 % at 0.03, where presliding and Stribeck friction disturb less."""
    speed_certainty: float = 6.0
    """Speed from which the direction is certain, in standard deviations of the velocity [-]."""
    least_window: float = 7.0
    """Fewest samples that a velocity is smoothed over for the direction [-]."""
    smoothing_time: float = 0.03
    """Window of the signals that the first guess and the rate of the effort come from [s]. Short
    against a move, long against the noise; the result does not depend on the first guess."""
    least_stretch: int = 20
    """Fewest samples of a stretch in one direction [-]; two of them estimate its first state."""
    initial_speed_ratio: float = 10.0
    """Standard deviation of the velocity at the start of a stretch, relative to the largest speed
    [-]: diffuse. From 3 on without effect; above 1e4 digits are lost."""
    noise_prior_spread: float = 2.0
    """Standard deviation of the logarithm of each noise variance about its first guess [-]: a prior
    that is weaker than ten samples, and keeps levels finite that a log does not show."""
    disturbance_prior_spread: float = 6.0
    """The same of the disturbance force, whose first guess is the poorest [-]."""
    time_constant_prior: float = 0.15
    """Median of the prior of the correlation time of the disturbance [s]."""
    time_constant_prior_spread: float = 1.5
    """Standard deviation of its logarithm [-]: 0.034 to 0.67 s within one."""
    largest_effort_innovation: float = 5.0
    """Innovation of the effort, in standard deviations, from which it is a jump [-]: one of 2e6
    samples of white noise."""
    jump_passes: int = 4
    """Most searches for jumps of the effort; each shows those that larger ones hid."""
    max_iterations: int = 40
    """Most evaluations of the likelihood after the first guess."""
    tolerance: float = 1e-2
    """Expected gain of twice the log likelihood below which the search ends [-]: parameters are
    then within 10 % of a standard error of the maximum."""
    whiteness_level: float = 1e-3
    """Probability of a false alarm of the test for white innovations [-]."""
    tolerated_widening: float = 2.0
    """Ratio of robust to model-based standard errors from which non-white innovations count as a
    model mismatch [-]; below, the intervals are widened by it."""
