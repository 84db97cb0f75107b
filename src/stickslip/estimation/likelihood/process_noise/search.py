"""Joint maximum of the likelihood over parameters and noise levels."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float

from stickslip.estimation.likelihood.process_noise.problem import Problem
from stickslip.estimation.likelihood.process_noise.slip_filter import (
    DISTURBANCE_STATE,
    EFFORT_STATE,
    STATES,
    AxisModel,
    innovate,
)
from stickslip.estimation.likelihood.process_noise.tuning import Tuning

__all__ = [
    "Evaluation",
    "Maximum",
    "evaluate",
    "inverted",
    "maximise",
    "with_jumps",
]

POSITION, EFFORT, ROUGHNESS, FORCE, DISTURBANCE, TIME_CONSTANT, VELOCITY = range(7)
"""Places of the noise levels: logarithms of variances, and of the time constant."""

Changes = Literal["all", "innovations", "none"]

_LARGEST_STEP = 2.0  # of a logarithm, in one iteration
_MASS_RANGE = 1.5  # factor by which one iteration changes the mass at most
_GAIN_GROWTH, _LARGEST_GAIN = 1.5, 4.0  # of steps onward, where the information is too large
_LARGEST_DAMPING, _DAMPING_RATIO = 1e4, 100.0


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Innovations of a log at values of the parameters and noise levels, summed up.

    Attributes
    ----------
    gram, gram_change
        Gramian of the normalised rows (innovation, then one column a parameter), shape (q, q), and
        its derivatives by the noise levels, shape (a, q, q); zero where they were not asked for.
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

    def restricted(self) -> float:
        """Return minus twice the restricted log likelihood.

        l = sum log S + e'e + log det X'X: the last term makes up for the parameters that are fitted
        beside the noise levels (REML; Patterson and Thompson 1971).
        """
        scale = np.sqrt(np.maximum(np.diag(self.gram)[1:], 0.0))
        scale = np.where(scale > 0, scale, 1.0)
        inner = self.gram[1:, 1:] / np.outer(scale, scale)
        _, determinant = np.linalg.slogdet(inner)
        value = self.logs + self.gram[0, 0] + determinant + 2.0 * np.sum(np.log(scale))
        return float(value) if np.isfinite(value) else np.inf

    def likelihood_change(self) -> Float[np.ndarray, " a"]:
        """Return the derivatives of sum log S + e'e by the noise levels."""
        return self.logs_change + self.gram_change[:, 0, 0]

    def determinant_change(self) -> Float[np.ndarray, " a"]:
        """Return the derivatives of log det X'X by the noise levels."""
        inverse = inverted(self.gram[1:, 1:])
        return np.einsum("ij,aji->a", inverse, self.gram_change[:, 1:, 1:])


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
    changes: Changes = "all",
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
    changes
        Of what the derivatives by the noise levels are computed: of ``"all"`` rows, of the
        ``"innovations"`` alone, in a third of the time, or of ``"none"``, in a ninth.
    """
    T = problem.sampling_time
    level = np.exp(levels)  # also the derivatives by the logarithms
    time_constant = float(level[TIME_CONSTANT])
    r = float(np.exp(-T / time_constant))
    r_by = r * T / time_constant
    model = AxisModel.of(
        problem.layout,
        values,
        mass_name=problem.mass_name,
        sampling_time=T,
        correlation=r,
        ramped=problem.averaged > 1,
    )
    a = levels.size
    measured_as = (POSITION, EFFORT, VELOCITY)[: 3 if a > VELOCITY else 2]
    channels, p = len(measured_as), len(problem.layout.sought)
    H = np.zeros((channels, STATES))
    H[0, 0] = H[1, EFFORT_STATE] = 1.0
    # A mean of held efforts acts half a sample of the log after that of the positions
    lag = 0.5 * T / problem.averaged if problem.averaged > 1 else 0.0
    H[1, EFFORT_STATE + 1] = model.fraction + lag
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
        Q_n[ROUGHNESS, side] = level[ROUGHNESS] * model.rate_noise[side]
    Q = np.sum(Q_n, axis=0)
    Q_n[TIME_CONSTANT, :, d, d] = -2.0 * level[DISTURBANCE] * r * r_by
    A_n = np.zeros((a, STATES, STATES))
    A_n[TIME_CONSTANT, d, d] = r_by
    first, first_n = np.zeros(STATES), np.zeros((a, STATES))
    first[0], first[EFFORT_STATE], first[d] = R[0], R[1], level[DISTURBANCE]
    first[1], first[p_u] = problem.speed**2, problem.effort_rate**2
    first_n[POSITION, 0], first_n[EFFORT, EFFORT_STATE] = R[0], R[1]
    first_n[DISTURBANCE, d] = level[DISTURBANCE]
    computed = slice(0) if changes == "none" else slice(None)
    q = 1 + len(problem.layout.sought)
    gram, gram_n = np.zeros((q, q)), np.zeros((a, q, q))
    logs, logs_n, information = 0.0, np.zeros(a), np.zeros((a, a))
    loads = problem.segments[0].loads.shape[1]
    coefficients = values[p - loads :]  # the last parameters
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
            segment.known_with(model.shift, coefficients),
            segment.measured_with(model.shift),
            segment.direction,
            segment.jumps,
            segment.loads,
            rows,
            q if changes == "all" else 1,
        )
        gram += found[0]
        logs += found[2]
        if changes != "none":
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
    converged
        Whether the search ended before its last iteration.
    """

    values: Float[np.ndarray, " p"]
    levels: Float[np.ndarray, " a"]
    converged: bool


def maximise(
    problem: Problem,
    values: Float[np.ndarray, " p"],
    tuning: Tuning,
    start: Maximum | None = None,
    *,
    most: int,
    first: bool = False,
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
        An earlier maximum, of which the noise levels are the first guess; None takes the likeliest
        of a grid.
    most
        Most evaluations.
    first
        Whether this is a search before that of the jumps, which ends earlier.
    """
    levels = _first_levels(problem, values) if start is None else start.levels
    best = evaluate(problem, values, levels, changes="innovations")
    cost = _posterior(problem, best, levels)
    # Of the determinant, which changes slowly: those last computed
    determinant_change = np.zeros(levels.size)
    largest, before = np.full(levels.size, _LARGEST_STEP), np.zeros(levels.size)
    gain = np.ones(levels.size)
    damping, converged, current = 1e-3, False, False
    tolerance = tuning.jump_tolerance if first else tuning.tolerance
    for _ in range(most):
        gradient = best.likelihood_change() + determinant_change
        gradient = gradient + 2.0 * (levels - problem.prior) / problem.prior_spread**2
        step = inverted(best.gram[1:, 1:]) @ best.gram[1:, 0]
        hessian = 2.0 * (best.information + np.diag(problem.prior_spread**-2.0))
        change = np.linalg.solve(hessian + damping * np.diag(np.diag(hessian)), -gradient)
        expected = float(step @ best.gram[1:, 0]) - 0.5 * float(change @ gradient)
        if expected < tolerance:
            if current or first:
                converged = True
                break
            best, current = evaluate(problem, values, levels), True
            determinant_change = best.determinant_change()
            continue
        # A step that takes back the last one overshot; one that goes on may be larger
        onward = change * before > 0
        largest = np.minimum(np.where(change * before < 0, 0.5, 1.5) * largest, _LARGEST_STEP)
        gain = np.where(onward, np.minimum(_GAIN_GROWTH * gain, _LARGEST_GAIN), 1.0)
        change = np.clip(gain * change, -largest, largest)
        tried_values = moved(problem, values, step / (1.0 + damping))
        tried = evaluate(problem, tried_values, levels + change, changes="innovations")
        tried_cost = _posterior(problem, tried, levels + change)
        if tried_cost < cost:
            values, levels, best, cost = tried_values, levels + change, tried, tried_cost
            before = change
            damping, current = max(0.1 * damping, 1e-6), False
        else:
            damping, before = max(_DAMPING_RATIO * damping, 1e-2), np.zeros(levels.size)
            if damping > _LARGEST_DAMPING:  # the likelihood rises no more
                converged = True
                break
    return Maximum(values=values, levels=levels, converged=converged)


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
    rows = evaluate(problem, maximum.values, maximum.levels, with_rows=True, changes="none").rows
    marked = [
        replace(segment, jumps=segment.jumps | (np.abs(row[:, 1, 0]) > largest))
        for segment, row in zip(problem.segments, rows, strict=True)
    ]
    before = sum(int(np.count_nonzero(segment.jumps)) for segment in problem.segments)
    after = sum(int(np.count_nonzero(segment.jumps)) for segment in marked)
    return replace(problem, segments=marked) if after > before else None


def _posterior(problem: Problem, evaluation: Evaluation, levels: Float[np.ndarray, " a"]) -> float:
    """Return the cost with the prior of the noise levels."""
    z = (levels - problem.prior) / problem.prior_spread
    return evaluation.restricted() + float(z @ z)


def _first_levels(problem: Problem, values: Float[np.ndarray, " p"]) -> Float[np.ndarray, " a"]:
    """Return the likeliest of a grid of disturbances, each with parameters of its own."""
    costs: list[tuple[float, Float[np.ndarray, " a"]]] = []
    for size in (-12.0, -6.0, -2.0):
        for time_constant in (0.02, 0.3) if size > -12.0 else (0.1,):
            levels = problem.prior.copy()
            levels[DISTURBANCE] = levels[EFFORT] + size
            levels[TIME_CONSTANT] = np.log(time_constant)
            evaluation = evaluate(problem, values, levels, changes="none")
            cost = _posterior(problem, evaluation, levels)
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
