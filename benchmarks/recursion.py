"""Online estimation beside others: the recursion alone, and with the samples before it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Protocol

import numpy as np
from jaxtyping import Float
from rich.progress import Progress

from benchmarks.measuring import Comparison, Rows, Target
from benchmarks.other_recursions import (
    INITIAL_VARIANCE,
    by_filterpy,
    by_numpy,
    by_padasip,
    by_statsmodels,
)
from stickslip.estimation import EnergyEstimator, PublishedEnergyEstimator, RecursiveLeastSquares
from stickslip.records import AxisLog
from stickslip.simulation import simulate
from stickslip.tasks import surrogate
from studies.van_de_wijdeven.part_a.noise_compensation import absolute_bias

_STEP = {2: 1.0, 4: 2.0}
"""Goals [us a sample] of a step called from Python, by the number of parameters."""

_COMPILED = {2: 60.0, 4: 120.0}
"""Goals [ns a sample] in a compiled loop."""

_SAME = 1e-8
"""Goal for how far estimates may differ, relative: rounding, times the condition of the rows."""

_REST = 40_000
"""Rows of a rest: with the forgetting factor, P would grow by more than doubles hold."""

_FORGETTING_FACTOR = 0.98

_AFTER = 0.01
"""Goal for the estimates when the axis moves again, relative: it remembers the noise of 50
samples."""

Values = Float[np.ndarray, " p"]
Sample = tuple[float, float, float, float, float]


class _Stepping(Protocol):
    """An estimator that takes samples."""

    def step(
        self, state: Float[np.ndarray, " s"], sample: Sample
    ) -> tuple[Float[np.ndarray, " s"], Values]: ...


@dataclass(frozen=True, kw_only=True)
class _Problem:
    """The surrogate arm of the thesis under its bang-bang input, as its sensors show it."""

    log: AxisLog  #: N samples.
    #: W(k) and y(k) of the balance of the thesis with noise compensation, with or without B and S.
    rows: Float[np.ndarray, "n p"]
    targets: Float[np.ndarray, " n"]

    @property
    def samples(self) -> list[Sample]:
        """Input of a controller at each sample."""
        log = self.log
        columns = (
            log.effort,
            log.measured_position,
            log.measured_velocity,
            log.measured_load_position,
            log.measured_load_velocity,
        )
        return list(
            zip(*(column.tolist() for column in columns if column is not None), strict=True)
        )


def compare(progress: Progress) -> list[Comparison]:
    """Time the recursion, the estimators around it, and see what forgetting does in a rest."""
    return [
        *(compare_recursion(progress, parameters) for parameters in (2, 4)),
        compare_samples(progress),
        compare_rest(progress),
    ]


def _log() -> AxisLog:
    motion = simulate(
        surrogate.surrogate_arm(),
        surrogate.bang_bang_effort(),
        sampling_time=surrogate.SAMPLING_TIME,
    )
    return surrogate.surrogate_sensors().measure(motion, np.random.default_rng(1))


def _problem(parameters: int) -> _Problem:
    """Write van de Wijdeven's balance down in NumPy (Eqs. 4.3, 4.4, 5.26, 5.27, 6.2)."""
    log = _log()
    T, m1, m2, ks = (
        surrogate.SAMPLING_TIME,
        surrogate.MASS_1,
        surrogate.MASS_2,
        surrogate.STIFFNESS,
    )
    sigma, sigma_w = surrogate.VELOCITY_NOISE, surrogate.POSITION_NOISE
    v, v2 = log.measured_velocity, log.measured_load_velocity
    x, x2 = log.measured_position, log.measured_load_position
    if v is None or v2 is None or x2 is None:
        raise TypeError("the surrogate's sensors measure both masses")
    correction = np.cumsum(T * absolute_bias(v, sigma))
    columns = [np.cumsum(T * np.abs(v)) - correction, np.cumsum(T * (v**2 - sigma**2))]
    columns += [np.ones_like(v), correction][: parameters - 2]
    stored = 0.5 * m1 * v**2 + 0.5 * m2 * v2**2 + 0.5 * ks * (x - x2) ** 2
    bias = 0.5 * (m1 + m2) * sigma**2 + ks * sigma_w**2  # Eqs. 5.6 and 5.7
    return _Problem(
        log=log,
        rows=np.column_stack(columns),
        targets=np.cumsum(T * log.effort * v) - stored + bias,
    )


def _least_squares(problem: _Problem) -> Values:
    """Return what all of them should end at, by one orthogonal decomposition."""
    p = problem.rows.shape[1]
    rows = np.vstack([problem.rows, INITIAL_VARIANCE**-0.5 * np.eye(p)])
    return np.linalg.lstsq(rows, np.append(problem.targets, np.zeros(p)))[0]


def _stepped(
    rls: RecursiveLeastSquares, state: Float[np.ndarray, " s"], pairs: list[tuple[Values, float]]
) -> Values:
    """Take row after row from Python."""
    step, values = rls.step, np.empty(0)
    for pair in pairs:
        state, values = step(state, pair)
    return values


def _stepped_through(
    estimator: _Stepping, state: Float[np.ndarray, " s"], samples: list[Sample]
) -> Values:
    """Take sample after sample from Python."""
    step, values = estimator.step, np.empty(0)
    for sample in samples:
        state, values = step(state, sample)
    return values


def _published_estimator(parameters: int) -> PublishedEnergyEstimator:
    return PublishedEnergyEstimator(
        inertia=surrogate.MASS_1,
        load_inertia=surrogate.MASS_2,
        stiffness=surrogate.STIFFNESS,
        compensation="settled",
        position_noise=surrogate.POSITION_NOISE,
        velocity_noise=surrogate.VELOCITY_NOISE,
        error_terms=parameters == 4,
        initial_variance=INITIAL_VARIANCE,
    )


def compare_recursion(progress: Progress, parameters: int, *, repetitions: int = 20) -> Comparison:
    """Solve the same rows by recursive least squares, ours and others'.

    There are 2 parameters, or 4 with B and S. Others are measured half as often as ours.
    """
    problem = _problem(parameters)
    n, p = problem.rows.shape
    best = _least_squares(problem)

    def error(values: Values) -> float:
        return float(np.max(np.abs(values / best - 1.0)))

    rls = RecursiveLeastSquares()
    first = rls.init(initial_values=[0.0] * p, initial_variance=INITIAL_VARIANCE)
    pairs = list(zip(list(problem.rows), problem.targets.tolist(), strict=True))
    published = _published_estimator(parameters)
    at_rest = published.init(sampling_time=surrogate.SAMPLING_TIME)
    ours: list[tuple[str, Callable[[], Values]]] = [
        (
            "RecursiveLeastSquares.run",
            lambda: rls.run(first, problem.rows, problem.targets)[1][-1],
        ),
        ("RecursiveLeastSquares.step, from Python", partial(_stepped, rls, first, pairs)),
        (
            "PublishedEnergyEstimator.run, from samples",
            lambda: published.run(at_rest, problem.log)[1][-1],
        ),
        (
            "PublishedEnergyEstimator.step, from Python",
            partial(_stepped_through, published, at_rest, problem.samples),
        ),
    ]
    others: list[tuple[str, Callable[[Any, Any], Values]]] = [
        ("statsmodels RecursiveLS, whole log", by_statsmodels),
        ("NumPy, written down", by_numpy),
        ("padasip FilterRLS", by_padasip),
        ("filterpy KalmanFilter", by_filterpy),
    ]
    rows = Rows(progress, "recursion", total=len(ours) + len(others))
    for name, function in ours:
        rows.add(name, function, n, error=error, repetitions=repetitions, ours=True)
    for name, by in others:
        rows.add(
            name,
            partial(by, problem.rows, problem.targets),
            n,
            error=error,
            repetitions=max(repetitions // 2, 1),
        )
    compiled_rows, stepped_rows = rows.rows[:4:2], rows.rows[1:4:2]
    return Comparison(
        title=(
            f"Recursive least squares of {p} parameters, {n} rows of van de Wijdeven's balance; "
            "error relative to least squares by QR"
        ),
        item="sample",
        error_name="error",
        rows=tuple(rows.rows),
        targets=(
            *(
                Target(
                    text=f"{row.name}, ns", measured=row.nanoseconds, limit=_COMPILED[parameters]
                )
                for row in compiled_rows
            ),
            *(
                Target(
                    text=f"{row.name}, µs",
                    measured=row.nanoseconds / 1e3,
                    limit=_STEP[parameters],
                )
                for row in stepped_rows
            ),
            Target(
                text="largest error of all, ours and others'",
                measured=max(row.error for row in rows.rows if row.error is not None),
                limit=_SAME,
            ),
        ),
    )


def compare_samples(progress: Progress, *, repetitions: int = 20) -> Comparison:
    """Take the samples of one noisy log by every estimator that works on line."""
    problem = _problem(2)
    n = problem.targets.size
    samples = problem.samples
    known = EnergyEstimator(
        inertia=surrogate.MASS_1, load_inertia=surrogate.MASS_2, stiffness=surrogate.STIFFNESS
    )
    sought = replace(known, inertia=None)
    published = _published_estimator(2)
    T = surrogate.SAMPLING_TIME

    def off(coulomb_at: int) -> Callable[[Values], float]:
        return lambda values: abs(float(values[coulomb_at]) - surrogate.COULOMB_FRICTION)

    rows = Rows(progress, "samples", total=6)
    for name, estimator, names in (
        ("published", published, published.parameter_names("linear")),
        ("energy, masses known", known, known.parameter_names("linear")),
        ("energy, driven mass sought", sought, sought.parameter_names("linear")),
    ):
        first, error = estimator.init(sampling_time=T), off(names.index("coulomb_friction"))

        def run(estimator: Any = estimator, first: Any = first) -> Values:
            return estimator.run(first, problem.log)[1][-1]

        rows.add(f"{name}, compiled", run, n, error=error, repetitions=repetitions, ours=True)
        rows.add(
            f"{name}, from Python",
            partial(_stepped_through, estimator, first, samples),
            n,
            error=error,
            repetitions=repetitions,
            ours=True,
        )
    return Comparison(
        title=(
            f"Friction of the surrogate arm on line, {n} samples of one noisy log; error of the "
            "Coulomb friction at its end"
        ),
        item="sample",
        error_name="error, N",
        rows=tuple(rows.rows),
    )


def compare_rest(progress: Progress, *, repetitions: int = 3) -> Comparison:
    """Forget through a long rest, whose rows are zero, and move again."""
    truth = np.array([surrogate.COULOMB_FRICTION, surrogate.VISCOUS_FRICTION])
    generator = np.random.default_rng(2)
    moving = generator.uniform(-1.0, 1.0, size=(1000, 2))
    rows_ = np.concatenate([moving, np.zeros((_REST, 2)), moving])
    targets = rows_ @ truth + generator.normal(scale=1e-3, size=len(rows_))
    rls = RecursiveLeastSquares(forgetting_factor=_FORGETTING_FACTOR)
    first = rls.init(initial_values=[0.0, 0.0], initial_variance=INITIAL_VARIANCE)
    exponential = RecursiveLeastSquares(
        forgetting_factor=_FORGETTING_FACTOR, forgetting="exponential"
    )

    def error(values: Values) -> float:
        return float(np.max(np.abs(values / truth - 1.0)))

    rows = Rows(progress, "rest", total=5)
    for name, ours in (("restricted", rls), ("exponential, bounded", exponential)):
        rows.add(
            f"RecursiveLeastSquares, {name}",
            lambda ours=ours: ours.run(first, rows_, targets)[1][-1],
            len(rows_),
            error=error,
            repetitions=repetitions,
            ours=True,
        )
    others: list[tuple[str, Callable[[Any, Any, float], Values]]] = [
        ("NumPy, written down", by_numpy),
        ("padasip FilterRLS", by_padasip),
        ("filterpy KalmanFilter, fading memory", by_filterpy),
    ]
    for name, by in others:
        with np.errstate(all="ignore"):  # that they overflow is what is shown
            rows.add(
                name,
                partial(by, rows_, targets, _FORGETTING_FACTOR),
                len(rows_),
                error=error,
                repetitions=repetitions,
            )
    return Comparison(
        title=(
            f"Forgetting factor {_FORGETTING_FACTOR:g}, a rest of {_REST} rows that are zero, then "
            "a move; relative error of the estimates"
        ),
        item="row",
        error_name="error",
        rows=tuple(rows.rows),
        targets=tuple(
            Target(
                text=f"{row.name}, error after the rest",
                measured=float("nan") if row.error is None else row.error,
                limit=_AFTER,
            )
            for row in rows.rows
            if row.ours
        ),
    )
