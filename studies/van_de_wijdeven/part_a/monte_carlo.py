"""Every variant of the estimator over many runs with noise."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from itertools import product

import numpy as np
from jaxtyping import Float

from stickslip.records import AxisLog
from stickslip.tasks import surrogate
from stickslip.tasks.parallel import in_parallel
from studies.van_de_wijdeven.part_a.cases import VARIANTS, published_estimator, robust_estimator
from studies.van_de_wijdeven.part_a.effects import NoiseEffects, noise_effects
from studies.van_de_wijdeven.part_a.runs import LOOPS, Loop, one_run
from studies.van_de_wijdeven.records import VariantScore

NOISES = (0.5, 1.0, 2.0)
"""Noise of the sensors, over that of the surrogate values [-]."""

ASSUMED = (0.5, 1.0, 2.0)
"""Standard deviations that a variant is given, over the true ones [-]."""

ROBUST_OFFLINE = "noise-robust, whole log"
ROBUST_ONLINE = "noise-robust, on line"

_NORMAL_95 = 1.959963984540054
_STREAM = 1  # of the seeds
_PARAMETERS = tuple(surrogate.TRUTH)

Key = tuple[str, float | None]
"""A variant and the standard deviations it is given, over the true ones."""


@dataclass(frozen=True, kw_only=True)
class Study:
    """Results of the runs."""

    scores: tuple[VariantScore, ...]  #: Of every variant, loop, noise and assumption.
    #: Effects of the noise of the surrogate values on the energies, by loop, one a run.
    effects: Mapping[Loop, tuple[NoiseEffects, ...]]


@dataclass(frozen=True, kw_only=True)
class _Outcome:
    """Results of one run: estimates, and whether their intervals hold the truth."""

    values: dict[Key, Float[np.ndarray, " 2"]] = field(default_factory=dict)
    covered: dict[Key, Float[np.ndarray, " 2"]] = field(default_factory=dict)
    effects: NoiseEffects


def monte_carlo(
    runs: int,
    seed: int,
    *,
    workers: int,
    advance: Callable[[], None],
) -> Study:
    """Score every variant by so many runs for each loop and noise.

    The result does not depend on the workers; ``advance`` is called after each run.
    """
    cells = list(product(enumerate(LOOPS), enumerate(NOISES), range(runs)))
    found = in_parallel(
        [
            partial(
                _one, loop, noise, np.random.SeedSequence(seed, spawn_key=(_STREAM, at, level, run))
            )
            for (at, loop), (level, noise), run in cells
        ],
        workers=workers,
        advance=advance,
    )
    outcomes = {
        (loop, noise, run): outcome
        for ((_, loop), (_, noise), run), outcome in zip(cells, found, strict=True)
    }
    return Study(
        scores=tuple(
            score
            for loop, noise in product(LOOPS, NOISES)
            for score in _scores(loop, noise, [outcomes[loop, noise, k] for k in range(runs)])
        ),
        effects={
            loop: tuple(outcomes[loop, 1.0, k].effects for k in range(runs)) for loop in LOOPS
        },
    )


def _one(loop: Loop, noise: float, seed: np.random.SeedSequence) -> _Outcome:
    T = surrogate.SAMPLING_TIME
    guide = published_estimator(compensation="printed", assumed=noise, error_terms=True)
    run = one_run(loop, noise, np.random.default_rng(seed), guide, guide.init(sampling_time=T))
    outcome = _Outcome(effects=noise_effects(run))
    for variant in VARIANTS:
        for assumed in ASSUMED if variant.informed else (None,):
            estimator = variant.estimator(noise * (assumed or 1.0))
            _, values = estimator.run(estimator.init(sampling_time=T), run.log)
            outcome.values[variant.name, assumed] = values[-1, :2].copy()  # no view of all samples
    _robust(run.log, noise, outcome)
    return outcome


def _robust(log: AxisLog, noise: float, outcome: _Outcome) -> None:
    """Add what this package's own estimator finds, from the whole log and on line."""
    truth = np.array([surrogate.TRUTH[name] for name in _PARAMETERS])
    estimator = robust_estimator()
    found = estimator.fit(log)
    parameters = [found.parameters[name] for name in _PARAMETERS]
    key: Key = (ROBUST_OFFLINE, None)
    outcome.values[key] = np.array(
        [np.nan if each.value is None else each.value for each in parameters]
    )
    outcome.covered[key] = np.array(
        [
            np.nan if each.ci95 is None else float(each.ci95[0] <= true <= each.ci95[1])
            for each, true in zip(parameters, truth, strict=True)
        ]
    )
    order = [estimator.parameter_names(log.kind).index(name) for name in _PARAMETERS]
    for assumed in (None, *ASSUMED):
        robust = robust_estimator(None if assumed is None else assumed * noise)
        state, values = robust.run(robust.init(sampling_time=log.sampling_time), log)
        key = (ROBUST_ONLINE, assumed)
        outcome.values[key] = values[-1, order]
        widths = _NORMAL_95 * np.sqrt(np.diag(robust.covariance(state))[order])
        outcome.covered[key] = (np.abs(values[-1, order] - truth) <= widths).astype(float)


def _scores(loop: Loop, noise: float, outcomes: list[_Outcome]) -> Iterator[VariantScore]:
    truth = np.array([surrogate.TRUTH[name] for name in _PARAMETERS])
    for variant, assumed in outcomes[0].values:
        errors = np.array([each.values[variant, assumed] for each in outcomes]) / truth - 1.0
        found = np.isfinite(errors).all(axis=1)
        covered = [each.covered.get((variant, assumed)) for each in outcomes]
        shares = None if covered[0] is None else _mean(np.array(covered)[found])
        kept = errors[found]
        yield VariantScore(
            loop=loop,
            variant=variant,
            noise=noise,
            assumed=assumed,
            runs=len(outcomes),
            failed=int(np.sum(~found)),
            bias=_by_name(_mean(kept)),
            rmse=_by_name(np.sqrt(_mean(kept**2))),
            coverage=None if shares is None else _by_name(shares),
        )


def _mean(values: Float[np.ndarray, "found 2"]) -> Float[np.ndarray, " 2"]:
    """Return the mean of each column, NaN of none."""
    return np.mean(values, axis=0) if len(values) else np.full(2, np.nan)


def _by_name(values: Float[np.ndarray, " 2"]) -> dict[str, float]:
    return dict(zip(_PARAMETERS, values.tolist(), strict=True))
