"""Uncertainty of the maximum: covariance, tests of the model, and the Cramer-Rao bound."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.special import kolmogorov, stdtr
from scipy.stats import norm

from stickslip.estimation.fit.intervals import robust_uncertainty, t_quantile
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.likelihood.bound import CramerRaoBound
from stickslip.estimation.likelihood.process_noise.problem import (
    Problem,
    Tuning,
    parts_of,
    problem_of,
)
from stickslip.estimation.likelihood.process_noise.search import (
    ROUGHNESS,
    Evaluation,
    Maximum,
    evaluate,
    inverted,
)
from stickslip.records import AxisLog, FrictionEstimate, InputError

_SURELY_SLIPPING = 0.003  # of the largest speed: a log without noise shows the direction
_NEGLIGIBLE = 1e-6  # of the effort's rms: a noise of zero has no logarithm
_DIFFUSE = 100.0  # s^-1, relative rate of change of an effort that nothing is known of


@dataclass(frozen=True, kw_only=True)
class Intervals:
    """Intervals of the parameters sought."""

    covariance: Float[np.ndarray, "p p"]  # [SI]
    half: Float[np.ndarray, " p"]  # of each 95 % interval [SI]
    classical: Float[np.ndarray, " p"]  # standard errors by the Fisher information [SI]
    white: bool = True  # whether the innovations are
    growth: float = 1.0  # largest ratio to the interval for white innovations
    notes: tuple[str, ...] = ()  # what widens them

    def widened(self, differences: Float[np.ndarray, " p"]) -> "Intervals":
        """Return intervals that also hold an estimate that differs by this much [SI]."""
        half = np.hypot(self.half, differences)
        ratio = half / np.where(self.half > 0, self.half, 1.0)
        return replace(self, half=half, covariance=self.covariance * np.outer(ratio, ratio))


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """An estimate beside that of the selected model, which leaves out fast motion."""

    differences: dict[str, float]  # of the parameters that both determine [SI]
    unshared: tuple[str, ...]  # names of those that the other does not determine
    causes: tuple[str, ...]  # differences beyond chance, one sentence each


def compare_with_windows(
    values: Mapping[str, float], std: Mapping[str, float], windows: FrictionEstimate, level: float
) -> Comparison:
    """Compare an estimate and its standard errors [SI] with that of the selected model.

    Both are consistent if the model is right. Windows leave out what is fast, such as a resonance
    of the drive, so that a wrong model moves the two differently (Hausman 1978). The variance of
    the difference is at most the sum of both. The level is the probability of a false alarm.
    """
    names = [name for name in windows.parameters if name in values]
    shared = [name for name in names if windows.parameters[name].identified]
    largest = float(norm.isf(0.5 * level / max(len(shared), 1)))
    differences: dict[str, float] = {}
    causes: list[str] = []
    for name in shared:
        other = windows.parameters[name]
        differences[name] = abs(values[name] - (other.value or 0.0))
        if differences[name] > largest * np.hypot(std[name], other.std or 0.0):
            causes.append(
                f"{name.replace('_', ' ')} is {values[name]:.4g} {other.unit} from all frequencies "
                f"and {other.value:.4g} {other.unit} from windows, which leave out fast motion: "
                "the axis is not that of the model"
            )
    unshared = tuple(name for name in names if name not in shared)
    return Comparison(differences=differences, unshared=unshared, causes=tuple(causes))


def intervals_of(
    problem: Problem, maximum: Maximum, found: Evaluation, rows: Regression, tuning: Tuning
) -> Intervals:
    """Return the intervals, wider by what is measured where the innovations are not white.

    ``found`` and ``rows`` are the innovations at the maximum.
    """
    covariance, degrees = covariance_of(problem, found, tuning.roughness_spread)
    classical = np.sqrt(np.diag(covariance_of(problem, found, 0.0)[0]))
    half = np.sqrt(np.diag(covariance)) * np.array([t_quantile(float(d)) for d in degrees])
    residual = rows.target - rows.regressors @ maximum.values
    channels = 2 if problem.segments[0].velocity is None else 3
    probability = channels * min(
        whiteness_probability(residual[c::channels]) for c in range(channels)
    )
    plain = Intervals(covariance=covariance, half=half, classical=classical)
    if probability > tuning.whiteness_level:
        return plain
    left, singular, right = np.linalg.svd(rows.regressors, full_matrices=False)
    robust = robust_uncertainty(left, right.T / singular, residual)
    spread = np.sqrt(np.diag(robust.covariance))
    wide = spread * np.array([t_quantile(float(d)) for d in robust.degrees_of_freedom])
    ratio = np.maximum(wide / half, 1.0)
    growth = float(np.max(ratio))
    note = (
        f"the innovations are not white (probability {probability:.1g}): the axis, or its noise, "
        f"is not that of the model; intervals are widened by up to {growth:.2g}"
    )
    return replace(
        plain,
        covariance=covariance * np.outer(ratio, ratio),
        half=half * ratio,
        white=False,
        growth=growth,
        notes=(note,),
    )


def covariance_of(
    problem: Problem, found: Evaluation, roughness_spread: float
) -> tuple[Float[np.ndarray, "p p"], Float[np.ndarray, " p"]]:
    """Return the covariance of the parameters [SI], and degrees of freedom of each interval.

    The covariance is the inverse of the Fisher information at the estimated noise levels, and what
    the model of the effort adds: an effort is no random walk of one roughness, and in a closed loop
    it answers to the disturbance. With the score g = X'e, the estimate moves by (X'X)^-1 g_a for a
    unit change of the logarithm of the roughness, of which the spread about the estimated one is
    given. The noise levels have errors of their own: with C = (X'X)^-1, dC/da = -C X'X_a C, and the
    Fisher information on the levels, the variance V of a parameter has a variance, and Student's
    distribution with 2 V^2/Var(V) degrees of freedom takes it into account (Satterthwaite 1946).
    """
    inverse = inverted(found.gram[1:, 1:])
    spread = np.linalg.inv(found.information + np.diag(problem.prior_spread**-2.0))
    change = -np.einsum("ji,aik,kj->aj", inverse, found.gram_change[:, 1:, 1:], inverse)
    variance = np.diag(inverse)
    moved = roughness_spread * inverse @ found.gram_change[ROUGHNESS, 1:, 0]
    uncertainty = np.einsum("aj,ab,bj->j", change, spread, change)
    degrees = 2.0 * variance**2 / np.maximum(uncertainty, 1e-12 * variance**2)
    left = inverse @ found.gram[1:, 0]
    covariance = inverse + np.outer(moved, moved) + np.outer(left, left)
    return covariance, np.maximum(degrees, 1.0)


def shift_by_low_speed(
    problem: Problem, maximum: Maximum, tuning: Tuning
) -> Float[np.ndarray, " p"] | None:
    """Return the change of the parameters if friction were higher or lower at low speed [SI].

    The force exp(-|v|/v_s) against the motion, with v_s a share of the largest speed, is one more
    column of the innovations. None if its coefficient is zero within chance.
    """
    largest = max(float(np.max(np.abs(s.smooth_velocity))) for s in problem.segments)
    scale = tuning.low_speed_share * largest
    forces = [s.direction * np.exp(-np.abs(s.smooth_velocity) / scale) for s in problem.segments]
    segments = [
        replace(s, loads=np.column_stack((s.loads, force)))
        for s, force in zip(problem.segments, forces, strict=True)
    ]
    names = (*problem.sought.names, "low_speed_friction")
    wider = replace(problem, segments=segments, sought=replace(problem.sought, names=names))
    values = np.append(maximum.values, 0.0)
    found = evaluate(wider, values, maximum.levels, with_rows=True, changes="none")
    rows = problem.in_slip(found.rows)
    rows = rows.reshape(-1, rows.shape[-1])
    left, singular, right = np.linalg.svd(rows[:, 1:], full_matrices=False)
    change = right.T / singular @ (left.T @ rows[:, 0])
    robust = robust_uncertainty(left, right.T / singular, rows[:, 0] - rows[:, 1:] @ change)
    own = inverted(found.gram[1:, 1:])[-1, -1]
    ratio = abs(change[-1]) / np.sqrt(max(robust.covariance[-1, -1], own))
    probability = 2.0 * stdtr(robust.degrees_of_freedom[-1], -ratio)
    step = inverted(found.gram[1:-1, 1:-1]) @ found.gram[1:-1, 0]
    return change[:-1] - step if probability < tuning.low_speed_level else None


def whiteness_probability(values: Float[np.ndarray, " n"]) -> float:
    """Return the probability of a cumulative periodogram as uneven as this if white.

    The largest distance D of the cumulative periodogram from a straight line, times sqrt(m) with m
    frequencies, has the distribution of Kolmogorov and Smirnov (Bartlett 1955).
    """
    power = np.abs(np.fft.rfft(values - np.mean(values))[1:]) ** 2
    m = power.size
    total = float(np.sum(power))
    if m < 2 or total == 0.0:
        return 1.0
    share = np.cumsum(power) / total
    distance = float(np.max(np.abs(share - np.arange(1, m + 1) / m)))
    return float(kolmogorov(distance * np.sqrt(m)))


@dataclass(frozen=True, kw_only=True)
class NoiseLevels:
    """Noise of a log and forces on its axis."""

    effort: float  #: Standard deviation of the white noise of the logged effort [N or N m].
    white_force: float = 0.0  #: Of a white disturbance force, held over each sample [N or N m].
    correlated_force: float = 0.0  #: Of an autoregressive disturbance force [N or N m].
    time_constant: float = 0.1  #: Its correlation time [s].
    position: float  #: Of the measured position; step/sqrt(12) of an encoder [m or rad].
    #: Of the measured velocity [m/s or rad/s]; without effect if none is measured.
    velocity: float = 1.0


def process_noise_bound(
    true_log: AxisLog,
    parameters: Mapping[str, float],
    noise: NoiseLevels,
    *,
    known: Mapping[str, float] | None = None,
) -> CramerRaoBound:
    """Return the Cramer-Rao bound of the parameters of a rigid axis under process noise.

    The Fisher information is that of the innovations while the axis slips. Noise levels are known;
    nothing is known beforehand of the true effort, which may come from any controller, nor of the
    first state of each stretch in one direction.

    Parameters
    ----------
    true_log
        True motion and true effort of the axis, without noise.
    parameters
        True values of the parameters that are sought, by name [SI].
    noise
        Noise levels.
    known
        Values of the parameters that are known, by name [SI]; None for none.

    Raises
    ------
    InputError
        If the axis does not slip in the log, or there is neither effort nor position noise.
    """
    problem = problem_of(
        parts_of(true_log),
        true_log.kind,
        true_log.sampling_time,
        sought=tuple(parameters),
        known=known or {},
        tuning=Tuning(min_speed_ratio=_SURELY_SLIPPING, speed_certainty=0.0),
    )
    if problem is None:
        raise InputError("no_slip")
    if noise.effort <= 0 or noise.position <= 0:
        raise InputError(
            "noise_of_bound_not_positive", effort=noise.effort, position=noise.position
        )
    segments = [replace(s, feedback=np.zeros_like(s.feedback)) for s in problem.segments]
    size = float(np.sqrt(np.mean(true_log.effort**2)))
    least = _NEGLIGIBLE * size
    variances = [
        noise.position**2,
        noise.effort**2,
        (_DIFFUSE * size) ** 2 / true_log.sampling_time,
        max(noise.white_force, least) ** 2,
        max(noise.correlated_force, least) ** 2,
        noise.time_constant,
    ]
    if true_log.measured_velocity is not None:
        variances.append(noise.velocity**2)
    values = np.array(list(parameters.values()))
    found = evaluate(replace(problem, segments=segments), values, np.log(variances), changes="none")
    information = found.gram[1:, 1:]
    return CramerRaoBound(
        names=tuple(parameters),
        information=information,
        covariance=inverted(information),
        units={name: true_log.unit(name) for name in parameters},
    )
