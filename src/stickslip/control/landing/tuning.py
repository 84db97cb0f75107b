"""Tuning constants of the landing controllers.

The unit of each stands in brackets; one that is no SI unit is the quantity that the value is a
multiple of. Sensitivities: `docs/evidence/positioning-faults.md`.
"""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, kw_only=True)
class ApproachTuning:
    """Tuning of the feedback that moves an axis near its target, and of the pulses of a mass."""

    effort_share: float = 0.4
    """Peak effort for the acceleration of the reference [effort limit]: the rest is for friction
    and feedback."""
    settled_samples: int = 5
    """Samples at rest after the reference that end feedback [-]: it moves the axis no further."""
    left_travel: float = 0.2
    """Part of the travel of an arm that feedback leaves to the series [travel]: more than mass 2
    usually swings."""

    arm_position_gain: float = 1.5
    """Position gain of an arm [stiffness]: this value and the next three are those of the arm of
    the demonstration."""
    arm_velocity_gain: float = 2.5
    """Velocity gain of an arm [root of stiffness times mean mass]."""
    notch_depth: float = 0.5  #: Depth of the notch at the resonance of an arm [-].
    notch_damping: float = 0.4  #: Damping of that notch [-].
    arm_periods: float = 1.5
    """Shortest reference of an arm [periods of the free arm]: a shorter one excites the
    resonance."""

    mass_samples: float = 40.0  #: Shortest reference of a single mass [samples].
    mass_pole: float = 20.0
    """Double pole of the feedback of a single mass [1/duration of the reference]: fast beside
    the reference."""
    fastest_mass_pole: float = 0.3
    """Largest double pole of that feedback [1/sampling time]: it is stable with a delay of one
    sample."""
    mass_wait: float = 100.0
    """Wait limit of a single mass [samples]: with its friction compensated it creeps rather than
    stops."""
    mass_coasting: float = 10.0
    """Longest time to rest of a single mass after a pulse [wait limits]."""
    friction_uncertainty: float = 0.05
    """Smallest relative standard deviation of friction that the pulses begin with [-]: that of
    the estimator does not include errors of its model."""


@dataclass(frozen=True, kw_only=True)
class LandingTuning:
    """Tuning of rest and of series of pulses of an arm."""

    moving_deviations: float = 4.0
    """Velocity of a mass that certainly moves [standard deviations of a velocity]."""
    missed_rest: float = 1e-3
    """Share of the windows of an axis at rest that are not detected as such [-]."""
    rest_samples: int = 80
    """Fewest samples at rest before a plan [-]: the delay of an estimator that smooths is over."""
    rest_swing: float = 0.4
    """Shortest rest before a plan [half swings]: a sine is known by then."""
    fine_band: float = 0.01
    """Widest band of noise with which `rest_swing` is enough [travel left]: a wider one hides
    motion that matters, and the rest must last half a swing."""
    yielding_time: float = 6.0
    """Time after which `brief_rest` is enough before a plan [half swings]: where the spring pulls
    about as hard as static friction holds, mass 1 gives way a little in every swing."""
    brief_rest: int = 8  #: Samples at rest before a plan, after `yielding_time` [-].
    window_length: float = 2.0  #: Samples kept for the fit of a swing [half swings].
    wait_limit: float = 40.0  #: Wait limit of an arm [half swings].
    strayed_distance: float = 1.5
    """Distance from the target beyond which an arm that had landed lands again [tolerances]."""
    braking_time: float = 8.0  #: Time constant of braking [samples].

    corridor_travel: float = 0.3
    """Half width of the corridor of a series [travel of the series]: beyond it mass 1 does not
    follow the plan. The largest of this and the next two values applies."""
    corridor_tolerance: float = 5.0  #: Half width of the corridor [tolerances].
    corridor_noise: float = 20.0  #: Half width of the corridor [standard deviations of a position].
    corridor_delay: float = 4.0
    """Addition to that half width by a delay [samples at the highest velocity]."""
    most_static: float = 0.95
    """Largest static friction that a series may still overcome [largest effort of a series]."""
    static_ratio: float = 1.3
    """Static over Coulomb friction where nothing is known [-]: a common ratio."""
    static_step: float = 1.25
    """Factor by which `static_ratio` rises where a series has not freed mass 1 [-]."""

    direct_swing: float = 0.8
    """Largest swing with which a series leads straight to the target [travel left]: 1 is the limit
    for a motion that does not turn."""
    beyond: tuple[float, float] = (1.5, 3.0)
    """Distances to places from which another series comes back [sum of travel left and swing]: the
    second where there is no series to the first."""
    smallest_steps: float = 4.0
    """Smallest value of that sum [smallest displacement by one pulse]."""
    slack: float = 4.0
    """Longest series [sum of the time of a rigid arm and one swing]: there is one for any start."""
    excess: float = 0.1
    """Duration of a series beyond the shortest that is accepted [-]: it is found with little
    work."""
    impulse_gap: float = 0.3
    """Impulse of a series beyond the least that is accepted [-]: likewise."""


@dataclass(frozen=True, kw_only=True)
class LearningTuning:
    """Tuning of what is learned of arm, drive, sensors and load from a series.

    Deviations are standard deviations.
    """

    # Arm and friction of mass 1

    body_uncertainty: float = 0.02
    """Relative prior deviation of masses and spring, where none is given [-]."""
    friction_ratio: float = 6.0
    """Prior deviation of friction over that of masses and spring [-]: wrong masses and a wrong
    spring make friction that was estimated with them more wrong."""
    unknown_friction: float = 1.0
    """Prior deviation of the logarithm of friction, where nothing is known [-]: a factor of 2.7."""
    friction_drift: float = 0.05
    """Relative deviation of the change of friction since an earlier run or target [-]."""
    body_walk: float = 1e-6
    """Relative deviation of the change of masses and spring between series [-]."""
    friction_walk: float = 1e-4
    """Relative deviation of the change of friction between series [-]."""
    least_viscous: float = 1e-3
    """Viscous friction in place of none [mass 1 times frequency of mass 2]: zero has no
    logarithm."""
    typical_viscous: float = 0.05
    """Viscous friction where little is known [mass 1 times frequency of mass 2]."""
    slip_samples: int = 8  #: Fewest samples of slipping to learn from [-].
    explained_residual: float = 1.5
    """Largest rms residual of a fit that needs no further fit with more noise [noise]."""
    unexplained_deviations: float = 5.0
    """Largest rms residual that the arm explains [noise]: a motion with residuals above this and
    the next bound has another cause, and nothing is learned from it."""
    unexplained_travel: float = 0.02
    """Largest rms residual that the arm explains, of positions [travel]."""
    surprise: float = 400.0
    """Largest squared distance of an estimate from the prior [prior variances]."""
    agreeing_deviations: float = 4.0
    """Largest difference from the friction effort of the running estimate [standard deviations], to
    which the next bound is added."""
    agreeing_share: float = 0.5
    """Largest difference from the friction effort of the running estimate [that effort]."""
    noise_deviations: float = 10.0
    """Miss of a series that noise explains [standard deviations of a position]; the larger of this
    and the next value applies."""
    noise_travel: float = 0.05
    """Miss of a series that noise explains [travel]: noise changes the start of a series and the
    estimate of friction."""

    # Drive, sensors and load
    min_rows: int = 10  #: Fewest rows of a fit of drive or load [-].
    significance: float = 3.0
    """Smallest loss of the load and lag of velocities that counts [standard deviations]."""
    exact_residual: float = 1e-6
    """Smallest deviation of a row [largest effort or force of the spring]: that of the model, with
    exact sensors."""
    lag_spread: float = 0.5
    """Prior deviation of the share of each past effort in the present one [-]."""
    farthest_gain: float = 0.3
    """Largest difference of the gain of a drive from 1 [-]: a larger one is an error of the
    model."""
    clip_evidence: float = 0.25
    """Squared residuals with a clipped effort below which it is clipped [squared residuals
    without]."""
    clip_noise: float = 2.0
    """Largest rms residual without a search for a clip [standard deviations of a momentum]; the
    larger of this and the next value applies."""
    clip_residual: float = 5e-3
    """Largest rms residual without a search for a clip [momentum of the effort limit in a
    sample]."""
    stiffness_spread: float = 0.02  #: Relative prior deviation of the stiffness [-].
    farthest_stiffness: float = 0.4
    """Largest relative change of the stiffness [-]: a larger one is an error of the model."""
    damping_spread: float = 0.1
    """Prior deviation of the damping of the spring and of mass 2 [root of stiffness times
    mass 2]."""
    dry_spread: float = 0.2
    """Prior deviation of the Coulomb friction of mass 2 [that of mass 1]."""
    sticking_speed: float = 0.01
    """Speed below which dry friction may hold mass 2 [highest speed]."""
    least_lag: float = 0.02  #: Smallest lag of velocities that counts [samples].
    most_lag: float = 4.0  #: Largest lag of velocities [samples].


@dataclass(frozen=True, kw_only=True)
class TrackingTuning:
    """Tuning of series that feedback tracks, and of their corrections."""

    # Feedback
    assumed_delay: float = 2.0
    """Delay of the drive before the first series [samples]: feedback for it is stable with a
    shorter one."""
    delay_pole: float = 0.5
    """Double pole of the feedback [1/delay]: a mass is stable up to 0.65."""
    sample_delay: float = 1.5
    """Mean time from an effort to the sample that shows it, without a delay of the drive
    [samples]."""
    most_resonance: float = 12.0  #: Largest double pole [resonance of the free arm].
    noise_effort: float = 0.1
    """Largest standard deviation of the effort that noise causes [effort limit]."""
    filter_pole: float = 4.0  #: Pole of the filter of a noisy velocity [double pole].
    difference_noise: float = 1.2
    """Noise of velocities from which they count as differences of positions [position noise over
    sampling time]: those have 1.4."""
    integral_pole: float = 0.2  #: Pole of the integral [double pole].
    settling: float = 3.0  #: Time of feedback after the last pulse [time constants of feedback].
    stuck_samples: int = 4
    """Samples at rest where mass 1 is planned to move, after which the effort rises [-]."""
    freeing_rate: float = 0.04  #: Rise of that effort in a sample [effort limit].

    # Plans
    plan_share: float = 0.85
    """Largest effort of a plan [effort limit]: the rest is for feedback."""
    correction_share: float = 0.95  #: Largest effort with a correction [effort limit].
    guessed_friction: float = 0.1
    """Coulomb friction where nothing is known [effort limit]."""
    most_pulses: float = 300.0
    """Most pulses in half a swing [-]: the work of a search grows with their number."""
    slack: float = 1.5  #: Longest series [sum of the time of a rigid arm and one swing].
    longer_series: tuple[float, ...] = (1.0, 2.0, 4.0, 8.0)
    """Bounds of the duration that are tried one after the other at rest [longest series]."""
    jitter: float = 0.1
    """Largest deviation of the time between successive samples [sampling time]: a sample is lost
    otherwise."""

    # Corrections on the way
    slow_speed: float = 0.2
    """Planned speed below which the weight of corrections falls, with its square [highest speed]:
    mass 1 does not turn back."""
    early_angle: float = 0.7
    """Time before the end within which the weight of corrections falls, with its square [rad of the
    swing]: they are made earlier."""
    last_angle: float = 0.5
    """Time before the end from which measurements no longer change the plan [rad of the swing]."""
    taken_over: float = 2.0
    """Time in which a measured deviation of mass 2 enters the plan [time constants of feedback]."""
    noise_correction: float = 0.15
    """Effort that corrects a deviation of one standard deviation by noise [limit of
    corrections]."""
    first_deviation: float = 0.03
    """Standard deviation of mass 2 from its plan in half a swing, with an unknown load [travel]."""
    learned_deviation: float = 1e-3
    """Standard deviation of mass 2 from its plan in half a swing, with a learned load [travel]."""
    goal_updates: int = 64  #: Times along a series at which the reachable end is computed [-].

    # Rest and motion
    blocked_travel: float = 0.02
    """Planned motion from which a mass 1 at rest stops the landing [move]: it is blocked, or its
    sensor is frozen."""
    blocked_effort: float = 0.75
    """Effort that no friction is to hold [effort limit]: mass 1 is then stopped at once."""
    blocked_samples: int = 12  #: Fewest samples at rest that stop it [-].
    blocked_bands: float = 3.0  #: Least planned motion that stops it [bands of rest].
    held_share: float = 0.3
    """Force of the spring that may hold mass 1 on its way [effort limit]."""
    coasting_travel: float = 0.02
    """Distance within which friction must stop mass 1 after a series; else it is braked [move]."""
    rest_band: float = 0.1
    """Narrowest band of a mass at rest [tolerances]: bristles give way a little."""
    rest_speed: float = 5.0
    """Largest speed with which a brief rest is enough [tolerances in half a swing]: a faster mass 1
    may be about to turn."""
    exact_rest: int = 3  #: Samples at rest before a plan, with exact sensors [-].
    noisy_rest: int = 6  #: Fewest samples at rest before a plan, with noise [-].
    known_swing: float = 0.2
    """Standard deviation below which a swing is known [tolerances]; the larger of this and the next
    value applies."""
    known_travel: float = 2e-3  #: Standard deviation below which a swing is known [travel left].
    offset_deviations: float = 6.0
    """Offset of mass 2 at rest that noise explains [standard deviations of a position]."""

    # Further series
    other_delay: float = 0.05
    """Change of the delay from which the end of a series is planned anew [samples]."""
    other_gain: float = 3e-3  #: Change of the drive's gain from which it is planned anew [-].
    other_friction: float = 0.01
    """Change of Coulomb friction from which a miss is not expected again [that friction]."""
    other_losses: float = 1e-3
    """Change of the losses of the load from which it is planned anew [root of stiffness times
    mass 2; Coulomb friction of mass 1]."""
    nearby_error: float = 0.035
    """Distance within which no series leads straight to the target [move]: short series are slow,
    and slow motion has another friction."""
    correcting_travel: float = 0.07
    """Travel of a series that corrects [move times `LandingTuning.beyond`]."""
    farther_travel: float = 0.2
    """Travel of a series where a shorter one has not helped [move times `LandingTuning.beyond`]."""
    repeated_miss: float = 0.7
    """Share of a miss that the next series from the same place is aimed against [-]: what a wrong
    model causes is the same again, what noise causes is not."""
    largest_miss: float = 0.02
    """Largest miss that the next series is aimed against [travel of the series]: what causes more
    is not the same again."""
    same_place: float = 0.02
    """Distance of two places from which series count as the same [travel of the series]."""
    improvement: float = 0.7
    """Largest miss after a correction that has helped [smallest miss so far]: two that have not
    stop the landing."""
    correcting_speed: float = 0.3
    """Lowest speed of a series that corrects [mean speed]: slow motion has another friction."""

    # Single pulses on mass 1
    nudged_error: float = 0.02  #: Largest error of mass 1 that a pulse corrects [move].
    most_nudges: int = 8  #: Most pulses after a series [-].
    nudge_wait: float = 1.2
    """Longest wait until mass 2 is near the target [periods of mass 2]."""
    overshoot: float = 1.7
    """Largest travel of a pulse, with Coulomb friction alone [error of mass 1]: one that certainly
    frees mass 1 may take it beyond the target."""
    nudge_return: float = 1.6
    """How far beyond the target a pulse leads where a shorter one may not free mass 1 [least way of
    a pulse that frees it]: the one that comes back frees it."""
    nudge_beyond: float = 20.0
    """Longest way of a pulse that leads beyond the target [tolerances]: its law is right to some
    percent, and so is the way back."""
    nudge_learning: float = 0.6
    """Exponent with which the way of a pulse over that by its law scales the next ones [-]: what
    noise of the effort causes is not repeated."""
    nudge_scales: tuple[float, float] = (0.5, 3.0)
    """Least and largest such scale [-]: a slow pulse with static friction goes less far than a
    longer one, bristles add to it."""
    nudge_friction: float = 0.3
    """Least friction in the law of a pulse that the spring helps [Coulomb friction]."""
    nudge_beside: float = 0.7
    """Distance of mass 2 from the target at which a pulse is fired [tolerances]."""
    nudge_passing: float = 0.1
    """Largest distance of mass 2 from the target then, beyond its smallest [error of mass 1]."""


APPROACH: Final = ApproachTuning()
LANDING: Final = LandingTuning()
LEARNING: Final = LearningTuning()
TRACKING: Final = TrackingTuning()
