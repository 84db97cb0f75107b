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

__all__ = [
    "Evaluation",
    "Maximum",
    "Problem",
    "corrected_step",
    "evaluate",
    "inverted",
    "log_share",
    "maximise",
]

FORCE, DISTURBANCE, TIME_CONSTANT, POSITION, VELOCITY = range(5)
"""Places of the noise levels: logarithms of variances, and of the time constant."""

_LARGEST_STEP = 2.0  # of a logarithm, in one iteration
_MASS_RANGE = 1.5  # factor by which one iteration changes the mass at most
_LARGEST_DAMPING = 1e6
_LEAST_SIGNAL = 0.05  # share of the columns that is not noise of the effort


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
    effort_noise
        Standard deviation of the white noise of the logged effort [N or N m].
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
    effort_noise: float
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
        scale = np.sqrt(np.diag(self.gram)[1:])
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
    """Search the parameters and the noise levels in turn.

    The parameters solve their corrected score equation at the noise levels (`correction`); the
    noise levels maximise the restricted likelihood at the parameters, by damped Fisher scoring. A
    joint maximum would be wrong where the logged effort is noisy: a heavier axis under a larger
    disturbance predicts a smooth motion better than a noisy effort does.

    Parameters
    ----------
    problem
        The log.
    values
        First guess of the parameters sought [SI].
    tuning
        When to stop.
    """
    levels = _first_levels(problem, values)
    best = evaluate(problem, values, levels)
    damping, converged = 1e-3, False
    for _ in range(tuning.max_iterations):
        # Parameters at the noise levels
        step, information = corrected_step(problem, values, best, levels)
        size = float(step @ information @ step)
        if size > 0.1 * tuning.tolerance:
            values = moved(problem, values, step)
            best = evaluate(problem, values, levels)
        # Noise levels at the parameters
        cost, gradient = _posterior(problem, best, levels)
        hessian = 2.0 * (best.information + np.diag(problem.prior_spread**-2.0))
        while damping < _LARGEST_DAMPING:
            change = np.linalg.solve(hessian + damping * np.diag(np.diag(hessian)), -gradient)
            change = np.clip(change, -_LARGEST_STEP, _LARGEST_STEP)
            tried = evaluate(problem, values, levels + change)
            new_cost, _ = _posterior(problem, tried, levels + change)
            if new_cost <= cost + 1e-9 * abs(cost):
                break
            damping = max(10.0 * damping, 1e-2)
        else:
            break
        levels, best = levels + change, tried
        damping = max(0.1 * damping, 1e-6)
        if cost - new_cost < tuning.tolerance and size < tuning.tolerance:
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


def _first_levels(problem: Problem, values: Float[np.ndarray, " p"]) -> Float[np.ndarray, " a"]:
    """Return the likeliest of a grid of disturbances, each with parameters of its own."""
    costs: list[tuple[float, Float[np.ndarray, " a"]]] = []
    for size in (-12.0, -6.0, -2.0):
        for time_constant in (0.02, 0.3) if size > -12.0 else (0.1,):
            levels = problem.prior.copy()
            levels[DISTURBANCE] = levels[FORCE] + size
            levels[TIME_CONSTANT] = np.log(time_constant)
            evaluation = evaluate(problem, values, levels, with_changes=False)
            cost, _ = _posterior(problem, evaluation, levels)
            cost -= evaluation.gram[0, 1:] @ inverted(evaluation.gram[1:, 1:]) @ evaluation.gram[1:, 0]
            costs.append((cost, levels))
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


def log_share(problem: Problem, levels: Float[np.ndarray, " a"]) -> float:
    """Return the share of the white force's variance that is noise of the log [-]."""
    return float(min(problem.effort_noise**2 / np.exp(levels[FORCE]), 1.0))


def corrected_step(
    problem: Problem,
    values: Float[np.ndarray, " p"],
    evaluation: Evaluation,
    levels: Float[np.ndarray, " a"],
) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, "p p"]]:
    """Return the step that solves the corrected score equation, and the information behind it.

    The filter predicts the motion from the logged effort u + n. If n acts on the axis (a force),
    its innovations are independent of what it predicts from, in closed loop too. If n is noise of
    the log, the predictions contain it, and with a perfectly known motion the likelihood

        sum (m a - u_l)^2/(2 W) - n log m

    has its maximum at a mass that is too large: the Jacobian n log m belongs to a force only
    (errors in variables). With the share rho = R_u/W of the white force that is noise of the log,
    the score g of the mass is corrected by what the Jacobian adds. As the innovations depend on
    W/m^2, the corrected score is

        g_m - b_m,   b_m = -(rho/m) d/dlog W (e' S^-1 e),

    which has zero mean for noise of the log, white forces, and sensor noise together, without a
    model of the controller or of the true effort. The information is that without the noise in the
    columns.

    Parameters
    ----------
    problem
        The log.
    values, levels
        Where the innovations were evaluated [SI].
    evaluation
        The innovations.
    """
    score, information = evaluation.gram[1:, 0].copy(), evaluation.gram[1:, 1:].copy()
    if problem.mass_name in problem.layout.sought:
        j = problem.layout.sought.index(problem.mass_name)
        share = log_share(problem, levels)
        score[j] += share / values[j] * evaluation.gram_change[FORCE, 0, 0]
        noise = share / values[j] ** 2 * evaluation.logs_change[FORCE]
        information[j, j] = max(information[j, j] - noise, _LEAST_SIGNAL * information[j, j])
    return inverted(information) @ score, information
