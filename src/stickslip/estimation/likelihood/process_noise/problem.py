"""From a log to the likelihood: stretches of slip, sought parameters, first guesses and priors."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.signal import savgol_filter

from stickslip.estimation.fit.rows import least_squares
from stickslip.estimation.likelihood.process_noise.slip_filter import ParameterLayout
from stickslip.estimation.likelihood.process_noise.tuning import Tuning
from stickslip.estimation.signals.kinematics import noise_level
from stickslip.estimation.signals.sensor_noise import position_noise
from stickslip.records import AxisKind, AxisLog

__all__ = [
    "LogPart",
    "Problem",
    "SlipSegment",
    "averages_of",
    "effort_residual",
    "first_guess",
    "parts_of",
    "problem_of",
]

_ROUGHNESS_LAGS = (2, 4, 8, 16, 32)  # samples
_ROUGHNESS_RATIO = 4.0  # of differences to those of neighbours, from which they are no noise
_FORCE_SHARE = 0.02  # of the variance of the effort's noise, first guess of that of the forces
_LEAST_SHARE = 1e-5  # of the effort's rms: noise of an effort without any
_DIFFERENCES = 3  # of the differences: references and smooth efforts leave nothing in them
_FEEDBACK_LAGS = (
    12  # samples; a derivative filtered at a fifth of the sampling rate has decayed to 1e-6
)
_FEEDBACK_WINDOW = 21  # samples of the smoothed position, whose deviations are the encoder's noise
_FEEDBACK_SHARE = 0.02  # share of the rough effort that must be explained


@dataclass(frozen=True, kw_only=True)
class LogPart:
    """One stretch of a log without gaps, evenly sampled.

    Attributes
    ----------
    time, effort, position
        [s, N or N m, m or rad], shape (n,).
    velocity
        As measured [m/s or rad/s], shape (n,), or None.
    usable
        Whether a sample may be used, shape (n,).
    loads
        Columns of the load terms, as efforts for unit coefficients [SI], shape (n, l).
    """

    time: Float[np.ndarray, " n"]
    effort: Float[np.ndarray, " n"]
    position: Float[np.ndarray, " n"]
    velocity: Float[np.ndarray, " n"] | None
    usable: Bool[np.ndarray, " n"]
    loads: Float[np.ndarray, "n l"]


def parts_of(log: AxisLog) -> list[LogPart]:
    """Return the stretches of a log between its gaps, as they are and without loads.

    Parameters
    ----------
    log
        Uniformly sampled but for gaps.
    """
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

    Parameters
    ----------
    part
        Stretch without gaps.
    samples
        Of each mean.
    """
    n = part.time.size // samples

    def mean(values: Float[np.ndarray, " m"]) -> Float[np.ndarray, " n"]:
        return np.asarray(values[: n * samples].reshape(n, samples).mean(axis=1))

    loads = np.array([mean(column) for column in part.loads.T]).reshape(-1, n)
    following = np.minimum(np.arange(n) + 1, n - 1)
    return LogPart(
        time=part.time[: n * samples : samples],
        effort=mean(part.effort),
        position=mean(part.position),
        velocity=None if part.velocity is None else mean(part.velocity),
        usable=np.asarray(part.usable[: n * samples].reshape(n, samples).all(axis=1)),
        loads=0.5 * (loads + loads[:, following]).T,
    )


@dataclass(frozen=True, kw_only=True)
class SlipSegment:
    """One stretch of a log without gaps, with what the filter needs of it.

    Attributes
    ----------
    time, effort
        [s, N or N m], shape (n,).
    feedback
        Part of the effort that answers to the measured position [N or N m], shape (n,).
    position
        As measured [m or rad], shape (n,).
    velocity
        As measured [m/s or rad/s], shape (n,), or None.
    direction
        1, -1, or 0 where the axis does not surely slip [-], shape (n,).
    jumps
        Where the effort jumps, shape (n,).
    smooth_velocity, smooth_acceleration, smooth_effort
        By local polynomials over one window [SI], shape (n,).
    loads
        As `LogPart` has them, shape (n, l).
    """

    time: Float[np.ndarray, " n"]
    effort: Float[np.ndarray, " n"]
    feedback: Float[np.ndarray, " n"]
    position: Float[np.ndarray, " n"]
    velocity: Float[np.ndarray, " n"] | None
    direction: Int[np.ndarray, " n"]
    jumps: Bool[np.ndarray, " n"]
    smooth_velocity: Float[np.ndarray, " n"]
    smooth_acceleration: Float[np.ndarray, " n"]
    smooth_effort: Float[np.ndarray, " n"]
    loads: Float[np.ndarray, "n l"]

    def known_with(
        self, shift: int, coefficients: Float[np.ndarray, " l"]
    ) -> Float[np.ndarray, " n"]:
        """Return the feedback as it acts so many samples later, less the loads."""
        return (
            -self.loads @ coefficients
            + self.feedback[np.clip(np.arange(self.time.size) - shift, 0, self.time.size - 1)]
        )

    def measured_with(self, shift: int) -> Float[np.ndarray, "n c"]:
        """Return position, effort without feedback as it acts later, and velocity if measured."""
        places = np.clip(np.arange(self.time.size) - shift, 0, self.time.size - 1)
        columns = [self.position, (self.effort - self.feedback)[places]]
        if self.velocity is not None:
            columns.append(self.velocity)
        return np.column_stack(columns)


@dataclass(frozen=True, kw_only=True)
class Problem:
    """A log as the likelihood needs it.

    Attributes
    ----------
    segments
        Stretches without gaps.
    layout
        Parameters sought and known.
    mass_name
        ``"mass"`` or ``"inertia"``.
    sampling_time
        [s].
    averaged
        Samples of the log that each sample is the mean of [-].
    speed
        Standard deviation of the velocity at the start of a stretch [m/s or rad/s].
    effort_rate
        Standard deviation of the rate of change of the effort there [N/s or N m/s].
    prior
        Median of the noise levels, as logarithms of variances and of the time constant [SI].
    prior_spread
        Standard deviations of these logarithms [-].
    """

    segments: list[SlipSegment]
    layout: ParameterLayout
    mass_name: str
    sampling_time: float
    averaged: int
    speed: float
    effort_rate: float
    prior: Float[np.ndarray, " a"]
    prior_spread: Float[np.ndarray, " a"]


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

    Parameters
    ----------
    parts
        Stretches of the log without gaps.
    kind
        ``"linear"`` or ``"rotary"``.
    sampling_time
        [s].
    sought
        Names of the parameters that are estimated, those of the loads last.
    known
        Values of the others [SI].
    tuning
        Tuning constants.
    averaged
        Samples of the log that each sample of the likelihood is the mean of [-].
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
    rate = max(float(np.std(savgol_filter(rest, window, 2, deriv=1, delta=T))) for rest in rests)
    rate = max(rate, _LEAST_SHARE * size / T)
    speed = max(float(np.max(np.abs(s.smooth_velocity))) for s in segments)
    force = 2.0 * np.log(effort) + np.log(_FORCE_SHARE)
    prior = [
        2.0 * np.log(noise),
        2.0 * np.log(effort),
        np.log(max(_roughness(rests, T), (_LEAST_SHARE * size / T) ** 2 * T)),
        force,
        force,
        np.log(tuning.time_constant_prior),
    ]
    near, far = tuning.noise_prior_spread, tuning.disturbance_prior_spread
    spread = [near, near, far, far, far, tuning.time_constant_prior_spread]
    measured = [s.velocity for s in segments if s.velocity is not None]
    if measured:
        level = max(*(noise_level(v) for v in measured), 1e-9 * speed)
        prior.append(2.0 * np.log(level))
        spread.append(near)
    return Problem(
        segments=segments,
        layout=ParameterLayout(sought=sought, known=dict(known)),
        mass_name="mass" if kind == "linear" else "inertia",
        sampling_time=T,
        averaged=averaged,
        speed=tuning.initial_speed_ratio * speed,
        effort_rate=tuning.initial_speed_ratio**2 * rate,
        prior=np.array(prior),
        prior_spread=np.array(spread),
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

    Parameters
    ----------
    problem
        The log.
    delays
        Delays of the effort that are compared, in samples; at least one.
    """
    layout = problem.layout
    linear = [name for name in layout.sought if name != "effort_delay"]
    best, cost = np.zeros(len(layout.sought)), np.inf
    for shift in delays:
        columns, target = _force_rows(problem, shift)
        known = sum((value * columns[name] for name, value in layout.known.items()), 0.0 * target)
        regressors = np.column_stack([columns[name] for name in linear])
        values = least_squares(regressors, target - known)
        left = float(np.sum((target - known - regressors @ values) ** 2))
        if left < cost:
            cost = left
            found = dict(zip(linear, values.tolist(), strict=True))
            found["effort_delay"] = shift * problem.sampling_time
            best = np.array([found[name] for name in layout.sought])
    if problem.mass_name in layout.sought:
        # A mass that noise turned negative: one that takes all of the effort is a start
        j = layout.sought.index(problem.mass_name)
        columns, target = _force_rows(problem, 0)
        norms = [np.linalg.norm(each) for each in (target, columns[problem.mass_name])]
        best[j] = max(best[j], 0.01 * float(norms[0] / norms[1]))
    return best


def effort_residual(problem: Problem, values: Float[np.ndarray, " p"]) -> float:
    """Return the share of the smoothed effort that the parameters leave unexplained [-].

    Parameters
    ----------
    problem
        The log.
    values
        Parameters sought [SI].
    """
    found = dict(zip(problem.layout.sought, values.tolist(), strict=True)) | problem.layout.known
    delay = found.pop("effort_delay", 0.0)
    columns, target = _force_rows(problem, round(delay / problem.sampling_time))
    model = sum((value * columns[name] for name, value in found.items()), 0.0 * target)
    return float(np.linalg.norm(target - model) / np.linalg.norm(target))


def _force_rows(
    problem: Problem, shift: int
) -> tuple[dict[str, Float[np.ndarray, " n"]], Float[np.ndarray, " n"]]:
    """Return the force of each parameter of unit value, and the smoothed effort, in slip."""
    parts: list[tuple[dict[str, Float[np.ndarray, " n"]], Float[np.ndarray, " n"]]] = []
    for segment in problem.segments:
        kept = segment.direction != 0
        s = segment.direction.astype(float)
        v = segment.smooth_velocity
        columns: dict[str, Float[np.ndarray, " n"]] = {
            problem.mass_name: segment.smooth_acceleration,
            "viscous_friction": v,
            "viscous_friction_positive": np.where(s > 0, v, 0.0),
            "viscous_friction_negative": np.where(s < 0, v, 0.0),
            "coulomb_friction": s,
            "coulomb_friction_positive": np.where(s > 0, s, 0.0),
            "coulomb_friction_negative": np.where(s < 0, s, 0.0),
            "offset": np.ones(s.size),
        }
        loads = segment.loads.T
        first = len(problem.layout.sought) - len(loads)
        columns |= dict(zip(problem.layout.sought[first:], loads, strict=True))
        places = np.clip(np.arange(s.size) - shift, 0, s.size - 1)
        parts.append(
            (
                {name: column[kept] for name, column in columns.items()},
                segment.smooth_effort[places][kept],
            )
        )
    names = parts[0][0]
    joined = {name: np.concatenate([part[0][name] for part in parts]) for name in names}
    return joined, np.concatenate([part[1] for part in parts])


def _slip_segments(
    parts: Sequence[LogPart], sampling_time: float, position_noise: float, tuning: Tuning
) -> list[SlipSegment]:
    """Return the stretches in which the axis slips, with the direction of travel of every sample.

    Samples slower than a share of the largest speed are masked, and those beside them: there the
    direction is not certain, and friction is not that of the model if it depends on position or
    rises at low speed.

    Parameters
    ----------
    parts
        Stretches without gaps.
    sampling_time
        [s].
    position_noise
        Standard deviation [m or rad].
    tuning
        Windows and thresholds.
    """
    T = sampling_time
    long = _odd(max(tuning.smoothing_time / T, tuning.least_window))
    parts = [part for part in parts if part.time.size > 2 * long]
    largest = max(
        (float(np.max(np.abs(_polynomial(p.position, long, T, 1)))) for p in parts),
        default=0.0,
    )
    slow = tuning.min_speed_ratio * largest
    if slow == 0.0:
        return []
    # Slope of a line through w samples: its variance is 12 sigma^2/(w^3 T^2)
    needed = (12.0 * (tuning.speed_certainty * position_noise / (slow * T)) ** 2) ** (1.0 / 3.0)
    window = min(_odd(max(needed, tuning.least_window)), long)
    noise = position_noise * float(np.sqrt(12.0 / window**3)) / T
    slow = max(slow, tuning.speed_certainty * noise)
    segments: list[SlipSegment] = []
    for part in parts:
        velocity = _polynomial(part.position, window, T, 1)
        moving = (np.abs(velocity) > slow) & part.usable
        direction = np.where(moving, np.sign(velocity), 0.0).astype(np.int64)
        segments.append(
            SlipSegment(
                time=part.time,
                effort=part.effort,
                feedback=_feedback_effort(part.effort, part.position),
                position=part.position,
                velocity=part.velocity,
                direction=_eroded(direction, window // 2 + 1, tuning.least_stretch),
                jumps=np.zeros(direction.size, dtype=bool),
                smooth_velocity=_polynomial(part.position, long, T, 1),
                smooth_acceleration=_polynomial(part.position, long, T, 2),
                smooth_effort=_polynomial(part.effort, long, T, 0),
                loads=part.loads,
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
    bounds = np.concatenate(([0], edges, [direction.size]))
    kept = np.zeros_like(direction)
    for start, stop in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
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

    Parameters
    ----------
    effort
        As logged, without gaps [N or N m].
    position
        As measured [m or rad].
    """
    none = np.zeros_like(effort)
    if effort.size < 10 * (_FEEDBACK_LAGS + _DIFFERENCES):
        return none
    noise = position - np.asarray(savgol_filter(position, _FEEDBACK_WINDOW, 2))
    target = np.diff(effort, _DIFFERENCES)[_FEEDBACK_LAGS - 1 :]
    change = np.diff(noise, _DIFFERENCES)
    columns = [
        change[_FEEDBACK_LAGS - 1 - lag : change.size - lag] for lag in range(_FEEDBACK_LAGS)
    ]
    regressors = np.column_stack(columns)
    scale = float(np.sqrt(np.mean(change**2)))
    if scale == 0.0:
        return none
    values, *_ = np.linalg.lstsq(regressors / scale, target, rcond=1e-10)
    left = target - (regressors / scale) @ values
    if np.sum(left**2) > (1.0 - _FEEDBACK_SHARE) * np.sum(target**2):
        return none
    padded = np.concatenate((np.zeros(_FEEDBACK_LAGS - 1), noise))
    return np.convolve(padded, values / scale, mode="valid")
