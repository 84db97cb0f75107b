"""Joint maximum of the likelihood over parameters and noise levels."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float

from stickslip.estimation.likelihood.process_noise.problem import Problem, Tuning
from stickslip.estimation.likelihood.process_noise.slip_filter import (
    DISTURBANCE_STATE,
    EFFORT_STATE,
    RATE_STATE,
    STATES,
    FilterNoise,
    SlipModel,
    innovate,
    slip_model,
)

POSITION, EFFORT, ROUGHNESS, FORCE, DISTURBANCE, TIME_CONSTANT, VELOCITY = range(7)
"""Places of the noise levels: logarithms of variances, and of the time constant."""

_LARGEST_STEP = 2.0  # of a logarithm, in one iteration
_MASS_RANGE = 1.5  # factor by which one iteration changes the mass at most
_GAIN_GROWTH, _LARGEST_GAIN = 1.5, 4.0  # of steps onward, where the information is too large
_LARGEST_DAMPING, _DAMPING_RATIO = 1e4, 100.0  # at its end, and after a step that gains nothing


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Innovations of a log at values of the parameters and noise levels, summed up.

    The derivatives by the noise levels are zero where they were not asked for.
    """

    gram: Float[np.ndarray, "q q"]  # of the rows: innovation, then one column a parameter
    gram_change: Float[np.ndarray, "a q q"]  # its derivatives
    logs: float  # sum of the logarithms of the innovations' variances
    logs_change: Float[np.ndarray, " a"]  # its derivatives
    information: Float[np.ndarray, "a a"]  # Fisher information on the noise levels
    rows: tuple[Float[np.ndarray, "n c q"], ...]  # normalised, one array a segment

    def restricted(self) -> float:
        """Return minus twice the restricted log likelihood.

        l = sum log S + e'e + log det X'X: the last term makes up for the parameters that are fitted
        beside the noise levels (REML; Patterson and Thompson 1971).
        """
        scale = _scale(self.gram[1:, 1:])
        _, determinant = np.linalg.slogdet(self.gram[1:, 1:] / np.outer(scale, scale))
        value = self.logs + self.gram[0, 0] + determinant + 2.0 * np.sum(np.log(scale))
        return float(value) if np.isfinite(value) else np.inf

    def likelihood_change(self) -> Float[np.ndarray, " a"]:
        """Return the derivatives of sum log S + e'e by the noise levels."""
        return self.logs_change + self.gram_change[:, 0, 0]

    def determinant_change(self) -> Float[np.ndarray, " a"]:
        """Return the derivatives of log det X'X by the noise levels."""
        inverse = inverted(self.gram[1:, 1:])
        return np.einsum("ij,aji->a", inverse, self.gram_change[:, 1:, 1:])

    def parameter_step(self) -> Float[np.ndarray, " p"]:
        """Return the Gauss-Newton step of the parameters."""
        return inverted(self.gram[1:, 1:]) @ self.gram[1:, 0]


def _scale(matrix: Float[np.ndarray, "p p"]) -> Float[np.ndarray, " p"]:
    scale = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    return np.where(scale > 0, scale, 1.0)


def inverted(matrix: Float[np.ndarray, "p p"]) -> Float[np.ndarray, "p p"]:
    """Return the pseudoinverse of a symmetric matrix, whatever the units of its rows."""
    scale = _scale(matrix)
    inner = np.linalg.pinv(matrix / np.outer(scale, scale), rcond=1e-13, hermitian=True)
    return np.asarray(inner / np.outer(scale, scale))


def evaluate(
    problem: Problem,
    values: Float[np.ndarray, " p"],
    levels: Float[np.ndarray, " a"],
    *,
    with_rows: bool = False,
    changes: Literal["all", "innovations", "none"] = "all",
) -> Evaluation:
    """Run the filter over all segments, and keep the normalised rows if asked to.

    The derivatives by the noise levels are those of ``"all"`` rows, of the ``"innovations"`` alone,
    in a third of the time, or of ``"none"``, in a ninth.
    """
    T, p, a = problem.sampling_time, len(problem.sought.names), levels.size
    level = np.exp(levels)
    model = slip_model(
        problem.sought,
        values,
        mass_name=problem.mass_name,
        sampling_time=T,
        correlation=float(np.exp(-T / level[TIME_CONSTANT])),
        ramped=problem.averaged > 1,
    )
    noise = _filter_noise(problem, model, level)
    if changes == "none":
        noise = FilterNoise(*(each[:1] for each in noise))
    channels = noise.R.shape[1]
    H, dH = np.zeros((channels, STATES)), np.zeros((p, channels, STATES))
    H[0, 0] = H[1, EFFORT_STATE] = 1.0
    # A mean of held efforts acts half a sample of the log after that of the positions
    lag = 0.5 * T / problem.averaged if problem.averaged > 1 else 0.0
    H[1, RATE_STATE] = model.fraction + lag
    H[2:, 1] = 1.0
    delay = problem.sought.column("effort_delay")
    if delay is not None:
        dH[delay, 1, RATE_STATE] = 1.0
    deep = 1 + p if changes == "all" else 1
    gram, logs = np.zeros((1 + a, 1 + p, 1 + p)), np.zeros(1 + a)
    information = np.zeros((a, a))
    kept: list[Float[np.ndarray, "n c q"]] = []
    for segment in problem.segments:
        rows = np.zeros((segment.time.size if with_rows else 0, channels, 1 + p))
        loads = segment.loads.shape[1]
        record = segment.record(model.shift, values[p - loads :])
        found = innovate(model, noise, H, dH, record, rows, deep)
        computed = found[1].size
        gram[:computed] += found[0]
        logs[:computed] += found[1]
        information[: computed - 1, : computed - 1] += found[2]
        kept.append(rows)
    # The derivatives e_j = -h' z_j enter with the sign of the least-squares columns
    sign = np.where(np.arange(1 + p) > 0, -1.0, 1.0)
    gram = (gram + np.triu(gram, 1).swapaxes(1, 2)) * np.outer(sign, sign)
    return Evaluation(
        gram=gram[0],
        gram_change=gram[1:],
        logs=float(logs[0]),
        logs_change=logs[1:],
        information=information + np.triu(information, 1).T,
        rows=tuple(kept),
    )


def _filter_noise(
    problem: Problem, model: SlipModel, level: Float[np.ndarray, " a"]
) -> FilterNoise:
    """Return the noise of the filter; the levels are also the derivatives by their logarithms."""
    T, a, d = problem.sampling_time, level.size, DISTURBANCE_STATE
    r = float(np.exp(-T / level[TIME_CONSTANT]))
    r_by = np.zeros(1 + a)
    r_by[0], r_by[1 + TIME_CONSTANT] = r, r * T / level[TIME_CONSTANT]
    measured = (POSITION, EFFORT, VELOCITY)[: 3 if a > VELOCITY else 2]
    R = np.zeros((1 + a, len(measured)))
    R[0] = level[list(measured)]
    for c, place in enumerate(measured):
        R[1 + place, c] = level[place]
    Q = np.zeros((1 + a, 2, STATES, STATES))
    for side in range(2):
        b = model.B[side, 0]
        Q[1 + FORCE, side] = level[FORCE] * np.outer(b, b)
        Q[1 + DISTURBANCE, side, d, d] = level[DISTURBANCE] * (1.0 - r * r)
        Q[1 + ROUGHNESS, side] = level[ROUGHNESS] * model.rate_noise[side]
    Q[0] = np.sum(Q[1:], axis=0)
    Q[1 + TIME_CONSTANT, :, d, d] = -2.0 * level[DISTURBANCE] * r * r_by[1 + TIME_CONSTANT]
    first = np.zeros((1 + a, STATES))
    first[0] = [R[0, 0], problem.speed**2, level[DISTURBANCE], R[0, 1], problem.effort_rate**2]
    for place, state in ((POSITION, 0), (EFFORT, EFFORT_STATE), (DISTURBANCE, d)):
        first[1 + place, state] = level[place]
    return FilterNoise(Q, R, first, r_by)


@dataclass(frozen=True, kw_only=True)
class Maximum:
    """Where the likelihood is largest."""

    values: Float[np.ndarray, " p"]  # parameters sought [SI]
    levels: Float[np.ndarray, " a"]  # noise levels
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
    the likelihood rises (Levenberg-Marquardt), with ``most`` evaluations. The information is block
    diagonal. The values are a first guess of the parameters [SI], the noise levels begin at those
    of an earlier maximum, or at the likeliest of a grid. The ``first`` search, before that of the
    jumps, ends earlier.
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
        step = best.parameter_step()
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
        tried_values = _moved(problem, values, step / (1.0 + damping))
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
    """
    rows = evaluate(problem, maximum.values, maximum.levels, with_rows=True, changes="none").rows
    marked = [
        replace(segment, jumps=segment.jumps | (np.abs(row[:, 1, 0]) > largest))
        for segment, row in zip(problem.segments, rows, strict=True)
    ]
    found = replace(problem, segments=marked)
    return found if jumps_in(found) > jumps_in(problem) else None


def jumps_in(problem: Problem) -> int:
    """Return the number of samples in which the effort jumps."""
    return sum(int(np.count_nonzero(segment.jumps)) for segment in problem.segments)


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
            found = evaluate(problem, values, levels, changes="none")
            cost = _posterior(problem, found, levels)
            cost -= found.gram[0, 1:] @ inverted(found.gram[1:, 1:]) @ found.gram[1:, 0]
            costs.append((float(cost), levels))
    return min(costs, key=lambda each: each[0])[1]


def _moved(
    problem: Problem, values: Float[np.ndarray, " p"], step: Float[np.ndarray, " p"]
) -> Float[np.ndarray, " p"]:
    """Return the values after a step that keeps the mass positive."""
    after = values + step
    if problem.mass_name in problem.sought.names:
        j = problem.sought.names.index(problem.mass_name)
        after[j] = np.clip(after[j], values[j] / _MASS_RANGE, values[j] * _MASS_RANGE)
    return after
