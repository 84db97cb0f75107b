"""From a log to the likelihood: sought parameters, first guesses and priors of noise levels."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from scipy.signal import savgol_filter

from stickslip.estimation.fit.rows import least_squares
from stickslip.estimation.likelihood.process_noise.axis_model import ParameterLayout
from stickslip.estimation.likelihood.process_noise.search import Problem
from stickslip.estimation.likelihood.process_noise.stretches import slip_segments
from stickslip.estimation.likelihood.process_noise.tuning import Tuning
from stickslip.estimation.signals.kinematics import noise_level
from stickslip.estimation.signals.sensor_noise import position_noise
from stickslip.records import AxisLog

__all__ = ["effort_residual", "first_guess", "problem_of"]

_ROUGHNESS_TIME = 0.03  # s in which the rate of the effort changes by its rms, at a first guess
_FORCE_SHARE = 0.02  # of the variance of the effort's noise, first guess of that of the forces
_LEAST_SHARE = 1e-5  # of the effort's rms: noise of an effort without any


def problem_of(
    log: AxisLog,
    *,
    sought: tuple[str, ...],
    known: Mapping[str, float],
    tuning: Tuning,
) -> Problem | None:
    """Return a log as the likelihood needs it, or None if the axis never surely slips in it.

    Parameters
    ----------
    log
        Uniformly sampled but for gaps.
    sought
        Names of the parameters that are estimated.
    known
        Values of the others [SI].
    tuning
        Tuning constants.
    """
    T = log.sampling_time
    noise = max(position_noise(part.measured_position) for part in log.segments())
    noise = max(noise, float(np.finfo(float).eps) * float(np.max(np.abs(log.measured_position))))
    segments = slip_segments(log, noise, tuning)
    if not segments:
        return None
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
        2.0 * np.log(rate) - np.log(_ROUGHNESS_TIME),
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
        mass_name="mass" if log.kind == "linear" else "inertia",
        sampling_time=T,
        speed=tuning.initial_speed_ratio * speed,
        effort_rate=tuning.initial_speed_ratio**2 * rate,
        prior=np.array(prior),
        prior_spread=np.array(spread),
    )


def first_guess(problem: Problem, largest_delay: int) -> Float[np.ndarray, " p"]:
    """Return parameters from least squares of the smoothed effort on the smoothed motion [SI].

    Parameters
    ----------
    problem
        The log.
    largest_delay
        Delays from minus to plus so many samples are compared if the delay is sought.
    """
    layout = problem.layout
    linear = [name for name in layout.sought if name != "effort_delay"]
    best, cost = np.zeros(len(layout.sought)), np.inf
    shifts = range(-largest_delay, largest_delay + 1) if "effort_delay" in layout.sought else (0,)
    for shift in shifts:
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
        columns = {
            problem.mass_name: segment.smooth_acceleration,
            "viscous_friction": v,
            "viscous_friction_positive": np.where(s > 0, v, 0.0),
            "viscous_friction_negative": np.where(s < 0, v, 0.0),
            "coulomb_friction": s,
            "coulomb_friction_positive": np.where(s > 0, s, 0.0),
            "coulomb_friction_negative": np.where(s < 0, s, 0.0),
            "offset": np.ones(s.size),
        }
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
