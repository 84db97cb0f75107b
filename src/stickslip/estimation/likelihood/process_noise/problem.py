"""From a log to the likelihood: stretches of slip, sought parameters, first guesses and priors."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.signal import savgol_filter

from stickslip.estimation.fit.rows import least_squares
from stickslip.estimation.likelihood.axis_parameters import SoughtParameters
from stickslip.estimation.likelihood.process_noise.slip_filter import SlipRecord
from stickslip.estimation.signals.kinematics import noise_level
from stickslip.estimation.signals.sensor_noise import position_noise
from stickslip.records import AxisKind, AxisLog, mass_name

_ROUGHNESS_LAGS = (2, 4, 8, 16, 32)  # samples
_ROUGHNESS_RATIO = 4.0  # of differences to those of neighbours, from which they are no noise
_FORCE_SHARE = 0.02  # of the variance of the effort's noise, first guess of that of the forces
_LEAST_SHARE = 1e-5  # of the effort's rms: noise of an effort without any
_DIFFERENCES = 3  # of the differences: references and smooth efforts leave nothing in them
_FEEDBACK_LAGS = 12
"""Samples; a derivative filtered at a fifth of the sampling rate has decayed to 1e-6."""
_FEEDBACK_WINDOW = 21  # samples of the smoothed position, whose deviations are the encoder's noise
_FEEDBACK_SHARE = 0.02  # share of the rough effort that must be explained


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
    fewest_innovations: int = 50  #: Of a log [-]; with fewer, nothing is estimated.
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
    least_share: float = 0.8  #: Least share of the time in slip that means must keep [-].
    low_speed_share: float = 0.1
    """Share of the largest speed below which friction that the selection did not find is tested
    for [-]."""
    low_speed_level: float = 1e-2
    """Probability of a false alarm of this test [-], which widens the intervals."""


@dataclass(frozen=True, kw_only=True)
class LogPart:
    """One stretch of a log without gaps, evenly sampled."""

    time: Float[np.ndarray, " n"]  # [s]
    effort: Float[np.ndarray, " n"]  # [N or N m]
    position: Float[np.ndarray, " n"]  # [m or rad]
    usable: Bool[np.ndarray, " n"]  # recorded as it was, neither clipped nor repaired
    velocity: Float[np.ndarray, " n"] | None  # as measured
    loads: Float[np.ndarray, "n l"]  # efforts of the load terms for unit coefficients [SI]


def parts_of(log: AxisLog) -> list[LogPart]:
    """Return the stretches of a log between its gaps, as they are and without loads."""
    return [
        LogPart(
            time=part.time,
            effort=part.effort,
            position=part.measured_position,
            velocity=part.measured_velocity,
            usable=np.ones(len(part), dtype=bool),
            loads=np.zeros((len(part), 0)),
        )
        for part in log.segments()
    ]


def averages_of(part: LogPart, samples: int) -> LogPart:
    """Return the means of so many samples each, as one stretch of slower sampling.

    Means of motion and effort obey the equation of motion as these do. Loads act over the time of
    the step that follows, so that their means are those of neighbours.
    """
    n = part.time.size // samples

    def grouped(values: Float[np.ndarray, " m"]) -> Float[np.ndarray, "n samples"]:
        return values[: n * samples].reshape(n, samples)

    loads = np.array([grouped(column).mean(axis=1) for column in part.loads.T]).reshape(-1, n)
    following = np.minimum(np.arange(n) + 1, n - 1)
    return LogPart(
        time=part.time[: n * samples : samples],
        effort=grouped(part.effort).mean(axis=1),
        position=grouped(part.position).mean(axis=1),
        velocity=None if part.velocity is None else grouped(part.velocity).mean(axis=1),
        usable=np.asarray(part.usable[: n * samples].reshape(n, samples).all(axis=1)),
        loads=0.5 * (loads + loads[:, following]).T,
    )


@dataclass(frozen=True, kw_only=True)
class SlipSegment(LogPart):
    """One stretch of a log with what the filter needs of it."""

    feedback: Float[np.ndarray, " n"]  # effort that answers to the measured position [N or N m]
    direction: Int[np.ndarray, " n"]  # 1, -1, or 0 where the axis does not surely slip
    jumps: Bool[np.ndarray, " n"]  # of the effort
    smooth_velocity: Float[np.ndarray, " n"]  # by local polynomials over one window [SI]
    smooth_acceleration: Float[np.ndarray, " n"]
    smooth_effort: Float[np.ndarray, " n"]

    def record(self, shift: int, coefficients: Float[np.ndarray, " l"]) -> SlipRecord:
        """Return the samples if the effort acts so many of them later [samples]."""
        at = np.clip(np.arange(self.time.size) - shift, 0, self.time.size - 1)
        measured = [self.position, (self.effort - self.feedback)[at]]
        if self.velocity is not None:
            measured.append(self.velocity)
        known = -self.loads @ coefficients + self.feedback[at]
        return SlipRecord(known, np.column_stack(measured), self.direction, self.jumps, self.loads)


@dataclass(frozen=True, kw_only=True)
class Problem:
    """A log as the likelihood needs it.

    The noise levels are logarithms of variances and of the correlation time [SI].
    """

    segments: list[SlipSegment]
    sought: SoughtParameters  # the coefficients of the loads last; the delay as "effort_delay"
    mass_name: str
    sampling_time: float  # [s]
    averaged: int  # samples of the log that each sample is the mean of
    speed: float  # standard deviation of the velocity at the start of a stretch
    effort_rate: float  # of the effort's rate of change there [N/s or N m/s]
    prior: Float[np.ndarray, " a"]  # medians of the noise levels
    prior_spread: Float[np.ndarray, " a"]  # their standard deviations [-]

    @property
    def innovations(self) -> int:
        """Number of samples in slip."""
        return sum(int(np.count_nonzero(segment.direction)) for segment in self.segments)

    def in_slip(self, signals: Sequence[Float[np.ndarray, "_ ..."]]) -> Float[np.ndarray, "n ..."]:
        """Return the samples in slip of one signal a segment, one segment after another."""
        pairs = zip(self.segments, signals, strict=True)
        return np.concatenate([signal[segment.direction != 0] for segment, signal in pairs])


def problem_of(
    parts: Sequence[LogPart],
    kind: AxisKind,
    sampling_time: float,
    *,
    sought: tuple[str, ...],
    known: Mapping[str, float],
    tuning: Tuning,
    averaged: int = 1,
) -> Problem | None:
    """Return a log as the likelihood needs it, or None if the axis never surely slips in it.

    The names of the coefficients of the loads are the last that are sought. Each sample of the
    likelihood is the mean of ``averaged`` samples of the log.
    """
    T = sampling_time * averaged
    if averaged > 1:
        parts = [averages_of(part, averaged) for part in parts if part.time.size >= averaged]
        tuning = replace(tuning, least_stretch=min(tuning.least_stretch, tuning.least_means))
    positions = [part.position for part in parts if part.position.size > tuning.least_stretch]
    if not positions:
        return None
    noise = max(position_noise(position) for position in positions)
    largest = max(float(np.max(np.abs(position))) for position in positions)
    noise = max(noise, float(np.finfo(float).eps) * largest)
    segments = _slip_segments(parts, T, noise, tuning)
    if not segments:
        return None
    if averaged > 1:  # means hold hardly any noise of the encoder that an effort could answer to
        segments = [replace(s, feedback=np.zeros_like(s.feedback)) for s in segments]
    size = float(np.sqrt(np.mean(np.concatenate([s.effort for s in segments]) ** 2)))
    window = max(2 * int(0.5 * tuning.smoothing_time / T) + 1, 5)
    rests = [s.effort - s.feedback for s in segments]
    effort = max(*(noise_level(rest) for rest in rests), _LEAST_SHARE * size)
    rate = max(float(np.std(_polynomial(rest, window, T, 1))) for rest in rests)
    rate = max(rate, _LEAST_SHARE * size / T)
    speed = max(float(np.max(np.abs(s.smooth_velocity))) for s in segments)
    roughness = max(_roughness(rests, T), (_LEAST_SHARE * size / T) ** 2 * T)
    force = 2.0 * np.log(effort) + np.log(_FORCE_SHARE)
    near, far = tuning.noise_prior_spread, tuning.disturbance_prior_spread
    prior = [
        (2.0 * np.log(noise), near),
        (2.0 * np.log(effort), near),
        (np.log(roughness), far),
        (force, far),
        (force, far),
        (np.log(tuning.time_constant_prior), tuning.time_constant_prior_spread),
    ]
    measured = [s.velocity for s in segments if s.velocity is not None]
    if measured:
        prior.append((2.0 * np.log(max(*map(noise_level, measured), 1e-9 * speed)), near))
    medians, spreads = np.array(prior).T
    return Problem(
        segments=segments,
        sought=SoughtParameters(names=sought, known=known),
        mass_name=mass_name(kind),
        sampling_time=T,
        averaged=averaged,
        speed=tuning.initial_speed_ratio * speed,
        effort_rate=tuning.initial_speed_ratio**2 * rate,
        prior=medians,
        prior_spread=spreads,
    )


def _roughness(efforts: Sequence[Float[np.ndarray, " _"]], sampling_time: float) -> float:
    """Return the variance by which the rate of an effort changes in a second [SI].

    The second difference over h of an integrated random walk has the variance 2/3 q h^3, and noise
    adds the same to that of each h.
    """

    def variance(lag: int) -> float:
        second = [u[2 * lag :] - 2.0 * u[lag:-lag] + u[: -2 * lag] for u in efforts]
        return float(np.mean(np.concatenate(second) ** 2))

    nearest = variance(1)
    found = 0.0
    for lag in _ROUGHNESS_LAGS:
        rise = variance(lag) - nearest
        found = max(rise, 0.0) / (2.0 / 3.0 * (lag * sampling_time) ** 3)
        if rise > _ROUGHNESS_RATIO * nearest:
            break
    return found


def first_guess(problem: Problem, delays: Sequence[int]) -> Float[np.ndarray, " p"]:
    """Return parameters from least squares of the smoothed effort on the smoothed motion [SI].

    The best of the given delays of the effort [samples] is taken.
    """
    names = problem.sought.names
    linear = [name for name in names if name != "effort_delay"]
    best, cost = np.zeros(len(names)), np.inf
    for shift in delays:
        columns, target = _force_rows(problem, shift)
        target = target - _model_effort(columns, target, problem.sought.known)
        regressors = np.column_stack([columns[name] for name in linear])
        values = least_squares(regressors, target)
        left = float(np.sum((target - regressors @ values) ** 2))
        if left < cost:
            cost = left
            found = dict(zip(linear, values.tolist(), strict=True))
            found["effort_delay"] = shift * problem.sampling_time
            best = np.array([found[name] for name in names])
    if problem.mass_name in names:
        # A mass that noise turned negative: one that takes all of the effort is a start
        j = names.index(problem.mass_name)
        columns, target = _force_rows(problem, 0)
        norms = [np.linalg.norm(each) for each in (target, columns[problem.mass_name])]
        best[j] = max(best[j], 0.01 * float(norms[0] / norms[1]))
    return best


def effort_residual(problem: Problem, values: Float[np.ndarray, " p"]) -> float:
    """Return the share of the smoothed effort that the parameters leave unexplained [-]."""
    found = dict(zip(problem.sought.names, values.tolist(), strict=True)) | {**problem.sought.known}
    delay = found.pop("effort_delay", 0.0)
    columns, target = _force_rows(problem, round(delay / problem.sampling_time))
    residual = target - _model_effort(columns, target, found)
    return float(np.linalg.norm(residual) / np.linalg.norm(target))


def _model_effort(
    columns: Mapping[str, Float[np.ndarray, " n"]],
    target: Float[np.ndarray, " n"],
    values: Mapping[str, float],
) -> Float[np.ndarray, " n"]:
    return sum((value * columns[name] for name, value in values.items()), 0.0 * target)


def _force_rows(
    problem: Problem, shift: int
) -> tuple[dict[str, Float[np.ndarray, " n"]], Float[np.ndarray, " n"]]:
    """Return the force of each parameter of unit value, and the smoothed effort, in slip."""
    parts: list[dict[str, Float[np.ndarray, " n"]]] = []
    efforts: list[Float[np.ndarray, " n"]] = []
    for segment in problem.segments:
        s, v = segment.direction.astype(float), segment.smooth_velocity
        loads = segment.loads.T
        first = len(problem.sought.names) - len(loads)
        parts.append(
            {
                problem.mass_name: segment.smooth_acceleration,
                "viscous_friction": v,
                "viscous_friction_positive": np.where(s > 0, v, 0.0),
                "viscous_friction_negative": np.where(s < 0, v, 0.0),
                "coulomb_friction": s,
                "coulomb_friction_positive": np.where(s > 0, s, 0.0),
                "coulomb_friction_negative": np.where(s < 0, s, 0.0),
                "offset": np.ones(s.size),
                **dict(zip(problem.sought.names[first:], loads, strict=True)),
            }
        )
        at = np.clip(np.arange(s.size) - shift, 0, s.size - 1)
        efforts.append(segment.smooth_effort[at])
    columns = {name: problem.in_slip([part[name] for part in parts]) for name in parts[0]}
    return columns, problem.in_slip(efforts)


def _slip_segments(
    parts: Sequence[LogPart], sampling_time: float, noise: float, tuning: Tuning
) -> list[SlipSegment]:
    """Return the stretches in which the axis slips, with the direction of travel of every sample.

    Samples slower than a share of the largest speed are masked, and those beside them: there the
    direction is not certain, and friction is not that of the model if it depends on position or
    rises at low speed. The noise is that of the position, its standard deviation [m or rad].
    """
    T = sampling_time
    long = _odd(max(tuning.smoothing_time / T, tuning.least_window))
    parts = [part for part in parts if part.time.size > 2 * long]
    speeds = (float(np.max(np.abs(_polynomial(p.position, long, T, 1)))) for p in parts)
    slow = tuning.min_speed_ratio * max(speeds, default=0.0)
    if slow == 0.0:
        return []
    # Slope of a line through w samples: its variance is 12 sigma^2/(w^3 T^2)
    needed = (12.0 * (tuning.speed_certainty * noise / (slow * T)) ** 2) ** (1.0 / 3.0)
    window = min(_odd(max(needed, tuning.least_window)), long)
    slow = max(slow, tuning.speed_certainty * (noise * float(np.sqrt(12.0 / window**3)) / T))
    segments: list[SlipSegment] = []
    for part in parts:
        velocity = _polynomial(part.position, window, T, 1)
        moving = (np.abs(velocity) > slow) & part.usable
        direction = np.where(moving, np.sign(velocity), 0.0).astype(np.int64)
        segments.append(
            SlipSegment(
                **vars(part),
                feedback=_feedback_effort(part.effort, part.position),
                direction=_eroded(direction, window // 2 + 1, tuning.least_stretch),
                jumps=np.zeros(direction.size, dtype=bool),
                smooth_velocity=_polynomial(part.position, long, T, 1),
                smooth_acceleration=_polynomial(part.position, long, T, 2),
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
    kept = np.zeros_like(direction)
    for start, stop in zip([0, *edges.tolist()], [*edges.tolist(), direction.size], strict=True):
        first = start + (margin if start else 0)
        last = stop - (margin if stop < direction.size else 0)
        if direction[start] != 0 and last - first >= least:
            kept[first:last] = direction[start]
    return kept


def _feedback_effort(
    effort: Float[np.ndarray, " n"], position: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """Return the part of an effort that answers to the noise of the encoder [N or N m].

    j(k) = sum_i h_i n(k-i), with n the deviation of the position from a smooth one and h from least
    squares of the third differences of the effort on those of n. A controller differentiates the
    noise of the encoder; this part of the effort is rough, known, and acts on the axis. What it
    leaves of the effort is smooth, but for noise. Zero if it explains nothing.
    """
    none = np.zeros_like(effort)
    lags = _FEEDBACK_LAGS
    if effort.size < 10 * (lags + _DIFFERENCES):
        return none
    noise = position - np.asarray(savgol_filter(position, _FEEDBACK_WINDOW, 2))
    target = np.diff(effort, _DIFFERENCES)[lags - 1 :]
    change = np.diff(noise, _DIFFERENCES)
    columns = [change[lags - 1 - lag : change.size - lag] for lag in range(lags)]
    scale = float(np.sqrt(np.mean(change**2)))
    if scale == 0.0:
        return none
    regressors = np.column_stack(columns) / scale
    values, *_ = np.linalg.lstsq(regressors, target, rcond=1e-10)
    left = target - regressors @ values
    if np.sum(left**2) > (1.0 - _FEEDBACK_SHARE) * np.sum(target**2):
        return none
    padded = np.concatenate((np.zeros(lags - 1), noise))
    return np.convolve(padded, values / scale, mode="valid")
