"""Joint maximum of the likelihood over parameters and noise levels."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.estimation.likelihood.process_noise.axis_model import (
    STATES,
    AxisModel,
    Noise,
    ParameterLayout,
)
from stickslip.estimation.likelihood.process_noise.filter_kernels import innovate
from stickslip.estimation.likelihood.process_noise.stretches import SlipSegment
from stickslip.estimation.likelihood.process_noise.tuning import Tuning

__all__ = ["Evaluation", "Maximum", "Problem", "evaluate", "maximise"]

FORCE, DISTURBANCE, TIME_CONSTANT, POSITION, VELOCITY = range(5)
"""Places of the noise levels: logarithms of variances, and of the time constant."""

_LARGEST_STEP = 2.0  # of a logarithm, in one iteration
_MASS_RANGE = 2.0  # factor by which one iteration changes the mass at most


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
    speed
        Standard deviation of the velocity at the start of a stretch [m/s or rad/s].
    prior
        Median of the noise levels, as logarithms of variances and of the time constant [SI].
    prior_spread
        Standard deviations of these logarithms [-].
    """

    segments: list[SlipSegment]
    layout: ParameterLayout
    mass_name: str
    sampling_time: float
    speed: float
    prior: Float[np.ndarray, " a"]
    prior_spread: Float[np.ndarray, " a"]


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Innovations of a log at values of the parameters and noise levels, summed up.

    Attributes
    ----------
    gram, gram_change
        Gramian of the normalised rows (innovation, then one column a parameter), shape (q, q), and
        its derivatives by the noise levels, shape (a, q, q).
    logs, logs_change
        Sum of the logarithms of the innovations' variances, and its derivatives, shape (a,).
    information
        Fisher information on the noise levels [-], shape (a, a).
    rows
        The normalised rows where they were asked for, one array (n, c, q) a segment.
    """

    gram: Float[np.ndarray, "q q"]
    gram_change: Float[np.ndarray, "a q q"]
    logs: float
    logs_change: Float[np.ndarray, " a"]
    information: Float[np.ndarray, "a a"]
    rows: tuple[Float[np.ndarray, "n c q"], ...]

    @property
    def step(self) -> Float[np.ndarray, " p"]:
        """Gauss-Newton step of the parameters [SI]."""
        scale = self._scale
        inner = self.gram[1:, 1:] / np.outer(scale, scale)
        return np.linalg.lstsq(inner, self.gram[1:, 0] / scale, rcond=1e-14)[0] / scale

    @property
    def _scale(self) -> Float[np.ndarray, " p"]:
        scale = np.sqrt(np.diag(self.gram)[1:])
        return np.where(scale > 0, scale, 1.0)

    def restricted(self) -> tuple[float, Float[np.ndarray, " a"]]:
        """Return minus twice the restricted log likelihood, and its derivatives.

        l = sum log S + min over dt |e - X dt|^2 + log det X'X: the last term makes up for the
        parameters that are fitted beside the noise levels (REML; Patterson and Thompson 1971).
        """
        v = np.concatenate(([1.0], -self.step))
        scale = self._scale
        inner = self.gram[1:, 1:] / np.outer(scale, scale)
        sign, determinant = np.linalg.slogdet(inner)
        value = self.logs + v @ self.gram @ v + determinant + 2.0 * np.sum(np.log(scale))
        inverse = np.linalg.pinv(inner, rcond=1e-14, hermitian=True) / np.outer(scale, scale)
        change = (
            self.logs_change
            + np.einsum("i,aij,j->a", v, self.gram_change, v)
            + np.einsum("ij,aji->a", inverse, self.gram_change[:, 1:, 1:])
        )
        return float(value) if sign > 0 else np.inf, change


def evaluate(
    problem: Problem,
    values: Float[np.ndarray, " p"],
    levels: Float[np.ndarray, " a"],
    *,
    with_rows: bool = False,
    with_changes: bool = True,
) -> Evaluation:
    """Run the filter over all segments.

    Parameters
    ----------
    problem
        The log.
    values
        Parameters sought [SI].
    levels
        Logarithms of the noise variances and of the time constant [SI].
    with_rows
        Whether the normalised rows are kept.
    with_changes
        Whether the derivatives by the noise levels are computed; they are zero otherwise.
    """
    T = problem.sampling_time
    time_constant = float(np.exp(levels[TIME_CONSTANT]))
    r = float(np.exp(-T / time_constant))
    r_by = r * T / time_constant
    variance = float(np.exp(levels[DISTURBANCE]))
    force = float(np.exp(levels[FORCE]))
    model = AxisModel.of(
        problem.layout, values, mass_name=problem.mass_name, sampling_time=T, correlation=r
    )
    a, channels = levels.size, levels.size - POSITION
    R = np.exp(levels[POSITION:])
    Q, Q_n = np.zeros((2, STATES, STATES)), np.zeros((a, 2, STATES, STATES))
    for side in range(2):
        b = model.force_response[side]
        Q_n[FORCE, side] = force * np.outer(b, b)
        Q_n[DISTURBANCE, side, -1, -1] = variance * (1.0 - r * r)
        Q_n[TIME_CONSTANT, side, -1, -1] = -2.0 * variance * r * r_by
        Q[side] = Q_n[FORCE, side] + Q_n[DISTURBANCE, side]
    A_n, R_n = np.zeros((a, 2, STATES, STATES)), np.zeros((a, channels))
    A_n[TIME_CONSTANT, :, -1, -1] = r_by
    R_n[POSITION:] = np.diag(R)
    r_n, variance_n = np.zeros(a), np.zeros(a)
    r_n[TIME_CONSTANT], variance_n[DISTURBANCE] = r_by, variance
    computed = slice(None) if with_changes else slice(0)
    q = 1 + len(problem.layout.sought)
    gram, gram_n = np.zeros((q, q)), np.zeros((a, q, q))
    logs, logs_n, information = 0.0, np.zeros(a), np.zeros((a, a))
    kept: list[Float[np.ndarray, "n c q"]] = []
    for segment in problem.segments:
        rows = np.zeros((segment.time.size if with_rows else 0, channels, q))
        found = innovate(
            model.transition,
            model.inputs,
            model.transition_change,
            Q,
            R,
            r,
            variance,
            A_n[computed],
            Q_n[computed],
            R_n[computed],
            r_n[computed],
            variance_n[computed],
            segment.effort,
            segment.effort_rate,
            segment.measured,
            segment.direction,
            model.shift,
            problem.speed,
            rows,
        )
        gram += found[0]
        logs += found[2]
        if with_changes:
            gram_n += found[1]
            logs_n += found[3]
            information += found[4]
        kept.append(rows)
    return Evaluation(
        gram=gram,
        gram_change=gram_n,
        logs=logs,
        logs_change=logs_n,
        information=information,
        rows=tuple(kept),
    )


@dataclass(frozen=True, kw_only=True)
class Maximum:
    """Where the likelihood is largest.

    Attributes
    ----------
    values
        Parameters sought [SI].
    levels
        Logarithms of the noise variances and of the time constant [SI].
    evaluation
        Innovations there.
    converged
        Whether the search ended before its last iteration.
    """

    values: Float[np.ndarray, " p"]
    levels: Float[np.ndarray, " a"]
    evaluation: Evaluation
    converged: bool

    @property
    def noise(self) -> Noise:
        """The noise levels as standard deviations [SI]."""
        std = np.exp(0.5 * self.levels)
        return Noise(
            force=float(std[FORCE]),
            disturbance=float(std[DISTURBANCE]),
            time_constant=float(np.exp(self.levels[TIME_CONSTANT])),
            position=float(std[POSITION]),
            velocity=float(std[VELOCITY]) if std.size > VELOCITY else 0.0,
        )


def maximise(problem: Problem, values: Float[np.ndarray, " p"], tuning: Tuning) -> Maximum:
    """Search the maximum of the restricted likelihood from the best of a few noise levels.

    Gauss-Newton steps of the parameters and Fisher-scoring steps of the noise levels, damped
    (Levenberg-Marquardt) until the likelihood rises.

    Parameters
    ----------
    problem
        The log.
    values
        First guess of the parameters sought [SI].
    tuning
        When to stop.
    """
    values, levels = _first_levels(problem, values)
    best = evaluate(problem, values, levels)
    cost, gradient = _posterior(problem, best, levels)
    damping, converged = 1e-3, False
    for _ in range(tuning.max_iterations):
        hessian = 2.0 * (best.information + np.diag(problem.prior_spread**-2.0))
        step = np.linalg.solve(hessian + damping * np.diag(np.diag(hessian)), -gradient)
        step = np.clip(step, -_LARGEST_STEP, _LARGEST_STEP)
        tried_values = _moved(problem, values, best.step)
        tried = evaluate(problem, tried_values, levels + step)
        new_cost, new_gradient = _posterior(problem, tried, levels + step)
        if not new_cost < cost + tuning.tolerance:
            damping = max(10.0 * damping, 1e-2)
            if damping > 1e6:
                break
            continue
        fitted = float(best.step @ best.gram[1:, 0])
        drop = cost - new_cost
        values, levels, best = tried_values, levels + step, tried
        cost, gradient = new_cost, new_gradient
        damping = max(0.1 * damping, 1e-6)
        if drop < tuning.tolerance and fitted < tuning.tolerance:
            converged = True
            break
    return Maximum(values=values, levels=levels, evaluation=best, converged=converged)


def _posterior(
    problem: Problem, evaluation: Evaluation, levels: Float[np.ndarray, " a"]
) -> tuple[float, Float[np.ndarray, " a"]]:
    """Return the cost with the prior of the noise levels, and its derivatives."""
    value, change = evaluation.restricted()
    z = (levels - problem.prior) / problem.prior_spread
    return value + float(z @ z), change + 2.0 * z / problem.prior_spread


def _first_levels(
    problem: Problem, values: Float[np.ndarray, " p"]
) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " a"]]:
    """Return the likeliest of a grid of disturbances, and the parameters beside it."""
    costs: list[tuple[float, Float[np.ndarray, " p"], Float[np.ndarray, " a"]]] = []
    for size in (-12.0, -6.0, -2.0):
        for time_constant in (0.02, 0.3) if size > -12.0 else (0.1,):
            levels = problem.prior.copy()
            levels[DISTURBANCE] = levels[FORCE] + size
            levels[TIME_CONSTANT] = np.log(time_constant)
            found = values
            for _ in range(2):
                evaluation = evaluate(problem, found, levels, with_changes=False)
                found = _moved(problem, found, evaluation.step)
            cost, _ = _posterior(problem, evaluation, levels)
            costs.append((cost, found, levels))
    _, found, levels = min(costs, key=lambda each: each[0])
    return found, levels


def _moved(
    problem: Problem, values: Float[np.ndarray, " p"], step: Float[np.ndarray, " p"]
) -> Float[np.ndarray, " p"]:
    """Return the values after a step that keeps the mass positive."""
    moved = values + step
    if problem.mass_name in problem.layout.sought:
        j = problem.layout.sought.index(problem.mass_name)
        moved[j] = np.clip(moved[j], values[j] / _MASS_RANGE, values[j] * _MASS_RANGE)
    return moved
