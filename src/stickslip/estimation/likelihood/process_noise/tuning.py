"""Tuning constants of the maximum likelihood with process noise."""

from dataclasses import dataclass

__all__ = ["Tuning"]


@dataclass(frozen=True, kw_only=True)
class Tuning:
    """Tuning of the maximum likelihood with process noise."""

    min_speed_ratio: float = 0.02
    """Share of the largest speed below which samples are masked [-]. The direction of slower motion
    is uncertain near reversals, and Stribeck friction and presliding disturb there. The standard
    error of Coulomb friction grows by 3 % at 0.01 and by 10 % at 0.03. Under a Stribeck effect that
    was not selected, 4 of 20 logs had intervals too narrow at 0.01, and 1 at 0.02."""
    speed_certainty: float = 6.0
    """Speed from which the direction is certain, in standard deviations of the velocity [-]."""
    least_window: float = 7.0
    """Fewest samples that a velocity is smoothed over for the direction [-]."""
    smoothing_time: float = 0.03
    """Window of the signals that the first guess and the rate of the effort come from [s]. Short
    against a move, long against the noise; the result does not depend on the first guess."""
    fewest_innovations: int = 50
    """Of a log [-]: with fewer, nothing is estimated."""
    fewest_means: int = 200
    """Innovations that noise levels and parameters are estimated from where samples are means of
    several [-]."""
    least_stretch: int = 20
    """Fewest samples of a stretch in one direction [-]; two of them estimate its first state."""
    least_means: int = 10
    """The same where samples are means of several [-]: shorter moves are then kept."""
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
    roughness_spread: float = 1.0
    """Standard deviation of the logarithm of the effort's roughness where the parameters are
    determined, about the one estimated from all of it [-]. Under disturbance forces in a closed
    loop, 0 covers the mass in 88 to 90 % of logs instead of 95 %, 0.5 in 91 to 93 %, and 1.5 in
    95 to 98 %."""
    jump_iterations: int = 6
    """Evaluations of the likelihood before each search for jumps. The noise levels must be near
    their maximum and need not be there: a sample that is marked by mistake costs its
    information."""
    jump_tolerance: float = 1.0
    """The gain below which such a search ends earlier [-]; see ``tolerance``."""
    max_iterations: int = 40
    """Most evaluations of the likelihood once the jumps of the effort are known."""
    tolerance: float = 1e-2
    """Expected gain of twice the log likelihood below which the search ends [-]: parameters are
    then within 10 % of a standard error of the maximum."""
    whiteness_level: float = 1e-3
    """Probability of a false alarm of the test for white innovations [-]."""
    disagreement_level: float = 1e-3
    """Probability of a false alarm of the comparison with the estimates from windows [-]."""
    tolerated_widening: float = 2.0
    """Ratio of robust to model-based intervals from which the model is taken not to hold at all
    frequencies [-]; below, the intervals are widened by it."""
    averaging_ratio: int = 3
    """Where the innovations are not white, means of so many samples are tried, of its square, and
    so on [-]: a step of half a decade in frequency. Smaller ratios cost time."""
    least_share: float = 0.8
    """Least share of the time in slip that means must keep [-]."""
    low_speed_share: float = 0.1
    """Share of the largest speed below which friction that the selection did not find is tested
    for [-]."""
    low_speed_level: float = 1e-2
    """Probability of a false alarm of this test [-], which widens the intervals."""
