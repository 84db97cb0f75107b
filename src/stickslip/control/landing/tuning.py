"""Tuning constants of the landing controllers.

`docs/evidence/positioning-faults.md` shows how sensitive landings are to the most important ones.
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
    """Samples at rest after the reference that end feedback [-]: it has done what it can."""
    left_travel: float = 0.2
    """Travel of an arm that feedback leaves to the series [travel]: more than mass 2 usually
    swings."""

    arm_position_gain: float = 1.5
    """Position gain of an arm [stiffness]: that of the arm of the demonstration, as are the next
    three."""
    arm_velocity_gain: float = 2.5
    """Velocity gain of an arm [root of stiffness times mean mass]."""
    notch_depth: float = 0.5  #: Depth of the notch at the resonance of an arm [-].
    notch_damping: float = 0.4  #: Damping of that notch [-].
    arm_periods: float = 1.5
    """Shortest reference of an arm [periods of the free arm]: it does not excite the resonance."""

    mass_samples: float = 40.0  #: Shortest reference of a single mass [samples].
    mass_pole: float = 20.0
    """Double pole of the feedback of a single mass [1/duration of the reference]: fast beside
    the reference."""
    fastest_mass_pole: float = 0.3
    """The same at most [1/sampling time]: it is stable with a delay of a sample."""
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
    """Share of the windows of an axis at rest that are not seen as such [-]."""
    rest_samples: int = 80
    """Fewest samples at rest before a plan [-]: an estimator that smooths is through by then."""
    rest_swing: float = 0.4
    """Shortest rest before a plan [half swings]: a sine is known by then."""
    fine_band: float = 0.01
    """Widest band of noise beside which that rest is enough [travel left]: a wider one hides motion
    that matters, so that a rest takes a half swing."""
    yielding_time: float = 6.0
    """Time for which mass 1 may give way to the spring before each plan [half swings]."""
    brief_rest: int = 8  #: Samples at rest before a plan, after that time [-].
    window_length: float = 2.0  #: Samples kept for the fit of a swing [half swings].
    wait_limit: float = 40.0  #: Wait limit of an arm [half swings].
    strayed_distance: float = 1.5
    """Distance from the target at which an arm has left its place [tolerances]."""
    braking_time: float = 8.0  #: Time constant of braking [samples].

    corridor_travel: float = 0.3
    """Half width of the corridor of a series [travel of the series]; the widest of it and the next
    two applies."""
    corridor_tolerance: float = 5.0  #: The same [tolerances].
    corridor_noise: float = 20.0  #: The same [standard deviations of a position].
    corridor_delay: float = 4.0
    """What a delay adds to the half width of the corridor [samples at the highest velocity]."""
    most_static: float = 0.95
    """Largest static friction that a series may still free [largest effort of a series]."""
    static_ratio: float = 1.3
    """Static over Coulomb friction where nothing is known [-]: a common ratio."""
    static_step: float = 1.25
    """Factor by which that rises where a series has not freed mass 1 [-]."""

    direct_swing: float = 0.8
    """Largest swing that a series to the target takes up [travel left]: 1 is the limit of a motion
    that does not turn."""
    beyond: tuple[float, float] = (1.5, 3.0)
    """Distances of the places to come back from [travel left and swing]: the second where there is
    no series to the first."""
    smallest_steps: float = 4.0
    """Shortest travel of a series to such a place [smallest displacement by one pulse]."""
    slack: float = 4.0
    """Longest series [time of a rigid arm and one swing]: there is one for any start."""
    excess: float = 0.1
    """Duration of a series beyond the shortest that is accepted [-]: it is found with little
    work."""
    impulse_gap: float = 0.3
    """Impulse of a series beyond the least that is accepted [-]: as above."""


@dataclass(frozen=True, kw_only=True)
class LearningTuning:
    """Tuning of what is learned of arm, drive, sensors and load from a series.

    Prior deviations are standard deviations.
    """

    body_uncertainty: float = 0.02
    """Prior deviation of masses and spring, where none is given [value]."""
    friction_ratio: float = 6.0
    """Prior deviation of friction over that of masses and spring [-]: that of friction which was
    estimated with wrong masses."""
    unknown_friction: float = 1.0
    """Prior deviation of the logarithm of a friction of which nothing is known [-]: a factor of
    2.7."""
    friction_drift: float = 0.05
    """Deviation of the change of friction since an earlier run or target [value]."""
    body_walk: float = 1e-6  #: Deviation of the change of masses and spring between series [value].
    friction_walk: float = 1e-4  #: Deviation of the change of friction between series [value].
    least_viscous: float = 1e-3
    """Viscous friction that stands for none [mass 1 times frequency of mass 2]: it has a
    logarithm."""
    typical_viscous: float = 0.05
    """Viscous friction where little is known [as above]."""
    slip_samples: int = 8  #: Fewest samples of slipping to learn from [-].
    explained_residual: float = 1.5
    """Residuals of a fit that need no further fit with more noise [rms over the noise]."""
    unexplained_deviations: float = 5.0
    """Residuals of a motion that something else has caused [rms over the noise]; it and the next
    bound must be exceeded."""
    unexplained_travel: float = 0.02  #: The same, of positions [travel].
    surprise: float = 400.0
    """Squared distance from the prior of an estimate that is rejected [prior variances]."""
    agreeing_deviations: float = 4.0
    """Difference to the effort of the running estimate of friction within which both agree
    [standard deviations]; both bounds are added."""
    agreeing_share: float = 0.5  #: The same [effort of the running estimate].
    noise_deviations: float = 10.0
    """Miss of a series that noise explains [standard deviations of a position]."""
    noise_travel: float = 0.05
    """The same [travel]: noise moves the start of a series, and friction as estimated."""

    min_rows: int = 20  #: Fewest rows of a fit of drive or load [-].
    significance: float = 3.0
    """Smallest value of a loss or of a lag that counts [standard deviations]."""
    exact_residual: float = 1e-6
    """Smallest standard deviation of a row [largest effort or force of the spring]: the model is no
    better with exact sensors."""
    lag_spread: float = 0.5  #: Prior deviation of the share of each past effort [-].
    lowest_gain: float = 0.7
    """Lowest gain of a drive [-]: one beyond the bounds is an error of the model."""
    highest_gain: float = 1.3  #: Highest gain of a drive [-].
    clip_evidence: float = 0.25
    """Squared residuals with clipped efforts that prove a clip [squared residuals without]."""
    clip_noise: float = 2.0
    """Residuals that noise explains, without a clip [standard deviations of a momentum]."""
    clip_residual: float = 5e-3
    """Residuals that need no clip [momentum of the largest effort in a sample]."""
    stiffness_spread: float = 0.02  #: Prior deviation of the stiffness [value].
    farthest_stiffness: float = 0.4
    """Largest change of the stiffness [value]: a larger one is an error of the model."""
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

    assumed_delay: float = 2.0
    """Delay of the drive before the first series [samples]: a shorter one is safe, too."""
    delay_pole: float = 0.5
    """Double pole of the feedback [1/delay]: a mass is stable up to 0.65."""
    sample_delay: float = 1.5
    """Time from an effort to the sample that shows it, without a delay of the drive, on average
    [samples]."""
    most_resonance: float = 12.0  #: Double pole at most [resonance of the free arm].
    noise_effort: float = 0.1
    """Standard deviation of the effort by noise at most [effort limit]."""
    filter_pole: float = 4.0  #: Pole of the filter of a noisy velocity [double pole].
    difference_noise: float = 1.2
    """Noise of a velocity from which it is that of differences [position noise in a sample]: theirs
    is 1.4."""
    integral_pole: float = 0.2  #: Pole of the integral [double pole].
    settling: float = 3.0  #: Feedback after the last pulse [time constants of feedback].
    stuck_samples: int = 4
    """Samples at rest where mass 1 is planned to move, until the effort rises [-]."""
    freeing_rate: float = 0.04  #: Rise of the effort in each sample then [effort limit].

    plan_share: float = 0.85
    """Largest effort of a plan [effort limit]: the rest is for feedback."""
    correction_share: float = 0.95  #: Effort that a correction may lead to [effort limit].
    guessed_friction: float = 0.1
    """Coulomb friction where nothing is known [effort limit]."""
    most_pulses: float = 300.0
    """Pulses in half a swing at most [-]: the work of a search grows with their number."""
    slack: float = 1.5  #: Longest series [time of a rigid arm and one swing].
    longer_series: tuple[float, ...] = (1.0, 2.0, 4.0, 8.0)
    """Durations that are tried one after the other [longest series], where the arm rests."""
    jitter: float = 0.1
    """Difference of successive samples from the sampling time at most [samples]."""

    slow_speed: float = 0.2
    """Speed below which a correction leaves the motion alone, more with its square [highest
    speed]: mass 1 does not turn back."""
    early_angle: float = 0.7
    """Time before the end within which corrections become smaller [rad of the swing]: less is left
    for the end."""
    last_angle: float = 0.5
    """Time before the end from which measurements no longer count [rad of the swing]."""
    taken_over: float = 2.0
    """Time in which a deviation of mass 2 is taken over [time constants of feedback]."""
    noise_correction: float = 0.15
    """Effort that corrects a deviation as large as its standard deviation [limit of
    corrections]."""
    first_deviation: float = 0.03
    """Standard deviation of mass 2 from its plan in half a swing, before the first series
    [travel]."""
    learned_deviation: float = 1e-3  #: The same after a series [travel].
    goal_updates: int = 64  #: Times along a series at which the reachable end is computed [-].

    blocked_travel: float = 0.02
    """Planned motion during which mass 1 rests that stops the landing [move]: it cannot move, or
    its sensor is frozen."""
    blocked_samples: int = 12  #: Samples at rest that show this [-].
    blocked_bands: float = 3.0  #: Planned motion that shows this at least [bands of rest].
    held_share: float = 0.3
    """Force of the spring that may hold mass 1 on its way [effort limit]."""
    coasting_travel: float = 0.02
    """Distance within which friction must stop mass 1 after a series; else it is braked [move]."""
    rest_band: float = 0.1
    """Narrowest band of a mass at rest [tolerances]: bristles give way a little."""
    rest_speed: float = 5.0
    """Speed at which mass 1 may rest at once [tolerances in half a swing]."""
    exact_rest: int = 3  #: Samples at rest before a plan, with exact sensors [-].
    noisy_rest: int = 6  #: Samples at rest before a plan, at least, with noise [-].
    known_swing: float = 0.2
    """Standard deviation of a swing that is known [tolerances]; the larger of both applies."""
    known_travel: float = 2e-3  #: The same [travel left].
    offset_deviations: float = 6.0
    """Offset of mass 2 at rest that noise explains [standard deviations of a position]."""

    other_delay: float = 0.05
    """Change of the delay from which the end of a series is planned anew [samples]."""
    other_gain: float = 3e-3  #: The same of the gain of the drive [-].
    other_losses: float = 1e-3
    """The same of the losses of the load [root of stiffness times mass 2; Coulomb friction]."""
    nearby_error: float = 0.035
    """Distance within which no series leads straight to the target [move]: short series are slow,
    and slow motion has another friction."""
    correcting_travel: float = 0.07  #: Travel of a series that corrects [move], times `beyond`.
    farther_travel: float = 0.2
    """The same where shorter ones have not helped [move]."""
    improvement: float = 0.7
    """Miss that a further correction must leave [smallest miss so far]; two that do not stop the
    landing."""
    correcting_speed: float = 0.3
    """Lowest speed of a series that corrects [mean speed]: slow motion has another friction."""

    nudged_error: float = 0.02  #: Largest error of mass 1 that a pulse on it corrects [move].
    most_nudges: int = 8  #: Such pulses after a series at most [-].
    nudge_wait: float = 1.2  #: Time to wait for the right moment [periods of mass 2].
    overshoot: float = 1.7
    """Travel of such a pulse at most, with Coulomb friction alone [error of mass 1]: one that frees
    mass 1 for certain moves it farther."""
    nudge_beside: float = 0.7
    """Distance of mass 2 from the target at which it is fired [tolerances]."""
    nudge_passing: float = 0.1
    """The same beyond the nearest that mass 2 comes [error of mass 1]."""


APPROACH: Final = ApproachTuning()
LANDING: Final = LandingTuning()
LEARNING: Final = LearningTuning()
TRACKING: Final = TrackingTuning()
