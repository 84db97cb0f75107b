"""Standard errors of the maximum, and whether innovations are white."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.special import stdtr
from scipy.stats import norm

from stickslip.estimation.fit.intervals import robust_uncertainty, t_quantile
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.likelihood.process_noise.problem import Problem
from stickslip.estimation.likelihood.process_noise.search import (
    ROUGHNESS,
    Evaluation,
    Maximum,
    evaluate,
    inverted,
)
from stickslip.estimation.likelihood.process_noise.tuning import Tuning
from stickslip.records import FrictionEstimate

__all__ = [
    "Comparison",
    "Intervals",
    "compare_with_windows",
    "covariance_of",
    "intervals_of",
    "shift_by_low_speed",
    "whiteness_probability",
]


@dataclass(frozen=True, kw_only=True)
class Intervals:
    """Intervals of the parameters sought.

    Attributes
    ----------
    covariance
        [SI], shape (p, p).
    half
        Half of each 95 % interval [SI], shape (p,).
    classical
        Standard errors by the Fisher information [SI], shape (p,).
    white
        Whether the innovations are white.
    growth
        Largest ratio of an interval to the one for white innovations [-]; 1 if they are white.
    notes
        What widens the intervals.
    """

    covariance: Float[np.ndarray, "p p"]
    half: Float[np.ndarray, " p"]
    classical: Float[np.ndarray, " p"]
    white: bool
    growth: float
    notes: tuple[str, ...]

    def widened(self, differences: Float[np.ndarray, " p"]) -> "Intervals":
        """Return intervals that hold another estimate, too.

        Parameters
        ----------
        differences
            From it, of each parameter; 0 if it has none [SI].
        """
        half = np.hypot(self.half, differences)
        ratio = half / np.where(self.half > 0, self.half, 1.0)
        return replace(self, half=half, covariance=self.covariance * np.outer(ratio, ratio))


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """An estimate beside that of the selected model, which leaves out fast motion.

    Attributes
    ----------
    differences
        Of the parameters that both determine, by name [SI].
    unshared
        Names of those that the other does not determine.
    causes
        Differences beyond chance, one sentence each.
    """

    differences: dict[str, float]
    unshared: tuple[str, ...]
    causes: tuple[str, ...]


def compare_with_windows(
    values: Mapping[str, float],
    std: Mapping[str, float],
    windows: FrictionEstimate,
    level: float,
) -> Comparison:
    """Compare an estimate with that of the selected model.

    Both are consistent if the model is right. Windows leave out what is fast, such as a resonance
    of the drive, so that a wrong model moves the two differently (Hausman 1978). The variance of
    the difference is at most the sum of both.

    Parameters
    ----------
    values, std
        Estimates and standard errors by name [SI].
    windows
        Of the selected model.
    level
        Probability of a false alarm [-].
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
    return Comparison(
        differences=differences,
        unshared=tuple(name for name in names if name not in shared),
        causes=tuple(causes),
    )


def intervals_of(
    problem: Problem, maximum: Maximum, found: Evaluation, rows: Regression, tuning: Tuning
) -> Intervals:
    """Return the intervals, wider by what is measured where the innovations are not white.

    Parameters
    ----------
    problem, maximum, found, rows
        The log, the maximum of its likelihood, the innovations there, and these as rows.
    tuning
        Level of the test for white innovations.
    """
    covariance, degrees = covariance_of(problem, found, tuning.roughness_spread)
    classical = np.sqrt(np.diag(covariance_of(problem, found, 0.0)[0]))
    half = np.sqrt(np.diag(covariance)) * np.array([t_quantile(float(d)) for d in degrees])
    residual = rows.target - rows.regressors @ maximum.values
    channels = 2 if problem.segments[0].velocity is None else 3
    probability = channels * min(
        whiteness_probability(residual[c::channels]) for c in range(channels)
    )
    if probability > tuning.whiteness_level:
        return Intervals(
            covariance=covariance, half=half, classical=classical, white=True, growth=1.0, notes=()
        )
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
    return Intervals(
        covariance=covariance * np.outer(ratio, ratio),
        half=half * ratio,
        classical=classical,
        white=False,
        growth=growth,
        notes=(note,),
    )


def covariance_of(
    problem: Problem, found: Evaluation, roughness_spread: float
) -> tuple[Float[np.ndarray, "p p"], Float[np.ndarray, " p"]]:
    """Return the covariance of the parameters [SI], and degrees of freedom of each interval [-].

    The covariance is the inverse of the Fisher information at the estimated noise levels, and what
    the model of the effort adds: an effort is no random walk of one roughness, and in a closed loop
    it answers to the disturbance. With the score g = X'e, the estimate moves by (X'X)^-1 g_a for a
    unit change of the logarithm of the roughness. The noise levels
    have errors of their own: with C = (X'X)^-1, dC/da = -C X'X_a C, and the Fisher information on
    the levels, the variance V of a parameter has a variance, and Student's distribution with
    2 V^2/Var(V) degrees of freedom takes it into account (Satterthwaite 1946).

    Parameters
    ----------
    problem
        The log.
    found
        Innovations at the maximum of the likelihood, with all derivatives.
    roughness_spread
        Standard deviation of the logarithm of the roughness that holds where the parameters are
        determined, about the one estimated from all of the effort [-].
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

    Parameters
    ----------
    problem, maximum
        The log and the maximum of its likelihood.
    tuning
        The share, and the level of the test.
    """
    largest = max(float(np.max(np.abs(s.smooth_velocity))) for s in problem.segments)
    scale = tuning.low_speed_share * largest
    columns = [s.direction * np.exp(-np.abs(s.smooth_velocity) / scale) for s in problem.segments]
    segments = [
        replace(s, loads=np.column_stack((s.loads, column)))
        for s, column in zip(problem.segments, columns, strict=True)
    ]
    sought = (*problem.layout.sought, "low_speed_friction")
    wider = replace(problem, segments=segments, layout=replace(problem.layout, sought=sought))
    found = evaluate(
        wider, np.append(maximum.values, 0.0), maximum.levels, with_rows=True, changes="none"
    )
    kept = [s.direction != 0 for s in problem.segments]
    rows = np.concatenate([r[k] for r, k in zip(found.rows, kept, strict=True)])
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
    """Return the probability of a cumulative periodogram as uneven as this if white [-].

    The largest distance D of the cumulative periodogram from a straight line has the distribution
    of Kolmogorov and Smirnov, P(D sqrt(m) > z) = 2 sum (-1)^(j-1) exp(-2 j^2 z^2), with m
    frequencies (Bartlett 1955).

    Parameters
    ----------
    values
        Normalised innovations in the order of time, shape (n,).
    """
    power = np.abs(np.fft.rfft(values - np.mean(values))[1:]) ** 2
    m = power.size
    total = float(np.sum(power))
    if m < 2 or total == 0.0:
        return 1.0
    share = np.cumsum(power) / total
    distance = float(np.max(np.abs(share - np.arange(1, m + 1) / m)))
    z = max(distance * np.sqrt(m), 0.2)
    j = np.arange(1, 101)
    return float(np.clip(2.0 * np.sum((-1.0) ** (j - 1) * np.exp(-2.0 * (j * z) ** 2)), 0.0, 1.0))
