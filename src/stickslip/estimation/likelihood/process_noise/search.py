"""Joint maximum of the likelihood over parameters and noise levels."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.likelihood.process_noise.axis_model import (
    DISTURBANCE_STATE,
    EFFORT_STATE,
    STATES,
    AxisModel,
    ParameterLayout,
)
from stickslip.estimation.likelihood.process_noise.filter_kernels import innovate
from stickslip.estimation.likelihood.process_noise.stretches import SlipSegment
from stickslip.estimation.likelihood.process_noise.tuning import Tuning

__all__ = [
    "Evaluation",
    "Maximum",
    "Problem",
    "evaluate",
    "inverted",
    "maximise",
    "with_jumps",
]

POSITION, EFFORT, ROUGHNESS, FORCE, DISTURBANCE, TIME_CONSTANT, VELOCITY = range(7)
"""Places of the noise levels: logarithms of variances, and of the time constant."""

_LARGEST_STEP = 2.0  # of a logarithm, in one iteration
_MASS_RANGE = 1.5  # factor by which one iteration changes the mass at most
_LARGEST_DAMPING = 1e6


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
    speed: float
    effort_rate: float
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

    def restricted(self) -> tuple[float, Float[np.ndarray, " a"]]:
        """Return minus twice the restricted log likelihood, and its derivatives.

        l = sum log S + e'e + log det X'X: the last term makes up for the parameters that are fitted
        beside the noise levels (REML; Patterson and Thompson 1971).
        """
        scale = np.sqrt(np.maximum(np.diag(self.gram)[1:], 0.0))
        scale = np.where(scale > 0, scale, 1.0)
        inner = self.gram[1:, 1:] / np.outer(scale, scale)
        _, determinant = np.linalg.slogdet(inner)
        inverse = inverted(self.gram[1:, 1:])
        value = self.logs + self.gram[0, 0] + determinant + 2.0 * np.sum(np.log(scale))
        change = self.logs_change + self.gram_change[:, 0, 0]
        change = change + np.einsum("ij,aji->a", inverse, self.gram_change[:, 1:, 1:])
        return float(value) if np.isfinite(value) else np.inf, change


def inverted(matrix: Float[np.ndarray, "p p"]) -> Float[np.ndarray, "p p"]:
    """Return the pseudoinverse of a symmetric matrix, whatever the units of its rows."""
    scale = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    scale = np.where(scale > 0, scale, 1.0)
    inner = np.linalg.pinv(matrix / np.outer(scale, scale), rcond=1e-13, hermitian=True)
    return np.asarray(inner / np.outer(scale, scale))


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
    level = np.exp(levels)  # also the derivatives by the logarithms
    time_constant = float(level[TIME_CONSTANT])
    r = float(np.exp(-T / time_constant))
    r_by = r * T / time_constant
    model = AxisModel.of(
        problem.layout, values, mass_name=problem.mass_name, sampling_time=T, correlation=r
    )
    a = levels.size
    measured_as = (POSITION, EFFORT, VELOCITY)[: 3 if a > VELOCITY else 2]
    channels, p = len(measured_as), len(problem.layout.sought)
    H = np.zeros((channels, STATES))
    H[0, 0] = H[1, EFFORT_STATE] = 1.0
    H[1, EFFORT_STATE + 1] = model.fraction
    H[2:, 1] = 1.0
    dH = np.zeros((p, channels, STATES))
    delay = problem.layout.column("effort_delay", 1)
    if delay is not None:
        dH[delay, 1, EFFORT_STATE + 1] = 1.0
    R, R_n = level[list(measured_as)], np.zeros((a, channels))
    for c, place in enumerate(measured_as):
        R_n[place, c] = level[place]
    Q_n = np.zeros((a, 2, STATES, STATES))
    d, p_u = DISTURBANCE_STATE, EFFORT_STATE + 1
    for side in range(2):
        b = model.force_response[side, 0]
        Q_n[FORCE, side] = level[FORCE] * np.outer(b, b)
        Q_n[DISTURBANCE, side, d, d] = level[DISTURBANCE] * (1.0 - r * r)
        Q_n[ROUGHNESS, side, p_u, p_u] = level[ROUGHNESS] * T
    Q = np.sum(Q_n, axis=0)
    Q_n[TIME_CONSTANT, :, d, d] = -2.0 * level[DISTURBANCE] * r * r_by
    A_n = np.zeros((a, STATES, STATES))
    A_n[TIME_CONSTANT, d, d] = r_by
    first, first_n = np.zeros(STATES), np.zeros((a, STATES))
    first[0], first[EFFORT_STATE], first[d] = R[0], R[1], level[DISTURBANCE]
    first[1], first[p_u] = problem.speed**2, problem.effort_rate**2
    first_n[POSITION, 0], first_n[EFFORT, EFFORT_STATE] = R[0], R[1]
    first_n[DISTURBANCE, d] = level[DISTURBANCE]
    computed = slice(None) if with_changes else slice(0)
    q = 1 + len(problem.layout.sought)
    gram, gram_n = np.zeros((q, q)), np.zeros((a, q, q))
    logs, logs_n, information = 0.0, np.zeros(a), np.zeros((a, a))
    kept: list[Float[np.ndarray, "n c q"]] = []
    for segment in problem.segments:
        rows = np.zeros((segment.time.size if with_rows else 0, channels, q))
        found = innovate(
            model.transition,
            model.constant,
            model.force_response,
            model.transition_change,
            Q,
            H,
            dH,
            R,
            first,
            A_n[computed],
            Q_n[computed],
            R_n[computed],
            first_n[computed],
            segment.known_with(model.shift),
            segment.measured_with(model.shift),
            segment.direction,
            segment.jumps,
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


def maximise(
    problem: Problem,
    values: Float[np.ndarray, " p"],
    tuning: Tuning,
    start: Float[np.ndarray, " a"] | None = None,
) -> Maximum:
    """Search the maximum of the restricted likelihood of parameters and noise levels.

    Gauss-Newton steps of the parameters and Fisher-scoring steps of the noise levels, damped until
    the likelihood rises (Levenberg-Marquardt). The information is block diagonal.

    Parameters
    ----------
    problem
        The log.
    values
        First guess of the parameters sought [SI].
    tuning
        When to stop.
    start
        First guess of the noise levels; None takes the likeliest of a grid.
    """
    levels = _first_levels(problem, values) if start is None else start
    best = evaluate(problem, values, levels)
    cost, gradient = _posterior(problem, best, levels)
    damping, converged = 1e-3, False
    for _ in range(tuning.max_iterations):
        step = inverted(best.gram[1:, 1:]) @ best.gram[1:, 0]
        hessian = 2.0 * (best.information + np.diag(problem.prior_spread**-2.0))
        change = np.linalg.solve(hessian + damping * np.diag(np.diag(hessian)), -gradient)
        change = np.clip(change, -_LARGEST_STEP, _LARGEST_STEP)
        expected = float(step @ best.gram[1:, 0]) - 0.5 * float(change @ gradient)
        if expected < tuning.tolerance:
            converged = True
            break
        tried_values = moved(problem, values, step / (1.0 + damping))
        tried = evaluate(problem, tried_values, levels + change)
        tried_cost, tried_gradient = _posterior(problem, tried, levels + change)
        if tried_cost < cost:
            values, levels, best = tried_values, levels + change, tried
            cost, gradient = tried_cost, tried_gradient
            damping = max(0.1 * damping, 1e-6)
        else:
            damping = max(10.0 * damping, 1e-2)
            if damping > _LARGEST_DAMPING:
                break
    return Maximum(values=values, levels=levels, evaluation=best, converged=converged)


def with_jumps(problem: Problem, maximum: Maximum, largest: float) -> Problem | None:
    """Return the log with the jumps of its effort marked, None if there are no new ones.

    A jump is an innovation of the effort of too many standard deviations for white noise. A
    reversal of friction or a step of the reference makes one, and would pass for noise otherwise.

    Parameters
    ----------
    problem, maximum
        The log, and what was found in it.
    largest
        Most standard deviations of an innovation [-].
    """
    rows = evaluate(
        problem, maximum.values, maximum.levels, with_rows=True, with_changes=False
    ).rows
    marked = [
        replace(segment, jumps=segment.jumps | (np.abs(row[:, 1, 0]) > largest))
        for segment, row in zip(problem.segments, rows, strict=True)
    ]
    before = sum(int(np.count_nonzero(segment.jumps)) for segment in problem.segments)
    after = sum(int(np.count_nonzero(segment.jumps)) for segment in marked)
    return replace(problem, segments=marked) if after > before else None


def _posterior(
    problem: Problem, evaluation: Evaluation, levels: Float[np.ndarray, " a"]
) -> tuple[float, Float[np.ndarray, " a"]]:
    """Return the cost with the prior of the noise levels, and its derivatives."""
    value, change = evaluation.restricted()
    z = (levels - problem.prior) / problem.prior_spread
    return value + float(z @ z), change + 2.0 * z / problem.prior_spread


def _first_levels(problem: Problem, values: Float[np.ndarray, " p"]) -> Float[np.ndarray, " a"]:
    """Return the likeliest of a grid of disturbances, each with parameters of its own."""
    costs: list[tuple[float, Float[np.ndarray, " a"]]] = []
    for size in (-12.0, -6.0, -2.0):
        for time_constant in (0.02, 0.3) if size > -12.0 else (0.1,):
            levels = problem.prior.copy()
            levels[DISTURBANCE] = levels[EFFORT] + size
            levels[TIME_CONSTANT] = np.log(time_constant)
            evaluation = evaluate(problem, values, levels, with_changes=False)
            cost, _ = _posterior(problem, evaluation, levels)
            cost -= (
                evaluation.gram[0, 1:] @ inverted(evaluation.gram[1:, 1:]) @ evaluation.gram[1:, 0]
            )
            costs.append((float(cost), levels))
    return min(costs, key=lambda each: each[0])[1]


def moved(
    problem: Problem, values: Float[np.ndarray, " p"], step: Float[np.ndarray, " p"]
) -> Float[np.ndarray, " p"]:
    """Return the values after a step that keeps the mass positive."""
    after = values + step
    if problem.mass_name in problem.layout.sought:
        j = problem.layout.sought.index(problem.mass_name)
        after[j] = np.clip(after[j], values[j] / _MASS_RANGE, values[j] * _MASS_RANGE)
    return after
