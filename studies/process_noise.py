"""Errors and intervals of the maximum likelihood with process noise, against its bound.

Run ``python -m studies.process_noise --runs N``: logs of the noise cases of `studies.mismatch`,
whose plant shares no code with the package. A log takes about a second on one core.
"""

import argparse
import sys
import time
from dataclasses import dataclass, replace
from multiprocessing import Pool

import numpy as np
from jaxtyping import Float

from stickslip.estimation import NoiseLevels, ProcessNoiseLikelihoodEstimator, process_noise_bound
from studies.mismatch.axes import physical
from studies.mismatch.cases import Recorded, record

CASES = (
    "noise",
    "noise_half",
    "noise_double",
    "noise_fourfold",
    "quantized",
    "correlated_098",
    "correlated_0998",
    "white_force",
)
"""Cases in which nothing but noise departs from the ideal."""

_VELOCITY_NOISE = 1e-3  # of the top speed, in the cases with a measured velocity
_FRICTION = ("viscous_friction", "coulomb_friction", "offset")
_MOVING = 0.05  # of the top speed
_LAGS = (4, 20)  # samples: beyond the noise, within the time in which an effort stays on one level
_HIGHEST_CORRELATION = 0.999


@dataclass(frozen=True, kw_only=True)
class Run:
    """One log."""

    #: Of each parameter [SI], shape (4,); not a number where it was not estimated.
    error: Float[np.ndarray, " 4"]
    half_interval: Float[np.ndarray, " 4"]
    bound: Float[np.ndarray, " 4"]
    status: str  #: Of the estimate.
    seconds: float  #: Processor time of the fit [s].


def noise_of(recorded: Recorded) -> NoiseLevels:
    """Return the true noise levels of a recording."""
    setup = recorded.setup
    plant = physical(setup)
    if recorded.log.name.startswith("quantized"):
        return _rounding_noise(recorded)
    correlated = setup.correlated_disturbance > 0.0
    return NoiseLevels(
        effort=setup.noise * plant.limit,
        white_force=setup.white_disturbance * plant.limit,
        correlated_force=setup.correlated_disturbance * setup.coulomb * plant.limit,
        time_constant=-1e-3 / float(np.log(setup.correlation)) if correlated else 0.1,
        position=float(setup.encoder_step / np.sqrt(12.0)),
        velocity=_VELOCITY_NOISE * setup.top_speed,
    )


def _rounding_noise(recorded: Recorded) -> NoiseLevels:
    """Return the noise of a rounded effort: white noise and a correlated part.

    An effort that hardly changes is rounded alike again and again. The correlated error acts on the
    parameters as a force does. Its variance v and correlation r come from the autocovariance
    v r^k at two lags, while the axis moves.
    """
    motion = recorded.run
    moving = np.abs(motion.velocity) > _MOVING * np.max(np.abs(motion.velocity))
    error = recorded.log.effort - motion.effort
    error = np.where(moving, error - np.mean(error[moving]), 0.0)
    variance = float(np.mean(error[moving] ** 2))
    near, far = _LAGS
    at_near, at_far = (
        max(float(np.sum(error[:-lag] * error[lag:])) / np.sum(moving), 1e-9 * variance)
        for lag in _LAGS
    )
    correlation = min((at_far / at_near) ** (1.0 / (far - near)), _HIGHEST_CORRELATION)
    correlated = min(at_near / correlation**near, 0.99 * variance)
    return NoiseLevels(
        effort=float(np.sqrt(variance - correlated)),
        correlated_force=float(np.sqrt(correlated)),
        time_constant=-1e-3 / float(np.log(correlation)),
        position=float(recorded.setup.encoder_step / np.sqrt(12.0)),
    )


def run(job: tuple[str, int]) -> Run:
    """Record and identify the log of a case and a seed."""
    recorded = record(*job)
    start = time.process_time()
    estimate = ProcessNoiseLikelihoodEstimator().fit(recorded.log)
    seconds = time.process_time() - start
    names = ("mass" if recorded.log.kind == "linear" else "inertia", *_FRICTION)
    truth = {name: recorded.truth[name] for name in names}
    log, motion = recorded.log, recorded.run
    true_log = replace(
        log,
        time=motion.time,
        effort=motion.effort,
        measured_position=motion.position,
        measured_velocity=None if log.measured_velocity is None else motion.velocity,
    )
    bound = process_noise_bound(true_log, truth, noise_of(recorded))
    nan = float("nan")
    found: list[tuple[float, float]] = []
    for name in names:
        p = estimate.parameters.get(name)  # a direction's friction has other names
        if p is None or p.value is None or p.ci95 is None:
            found.append((nan, nan))
        else:
            found.append((p.value - truth[name], 0.5 * (p.ci95[1] - p.ci95[0])))
    error, half = np.array(found).T
    return Run(
        error=error,
        half_interval=half,
        bound=np.array([bound.std[name] for name in truth]),
        status=estimate.status.value,
        seconds=seconds,
    )


def main() -> None:
    """Run the study and print its table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=30, help="logs of each case [default: 30]")
    parser.add_argument("--cases", nargs="*", default=list(CASES), help="[default: noise cases]")
    parser.add_argument("--workers", type=int, default=2, help="processes [default: 2]")
    options = parser.parse_args()
    out = sys.stdout
    out.write("mass, viscous friction, Coulomb friction, offset; median processor time of a fit\n")
    out.write(f"{'case':16s} {'RMSE / bound':24s} {'coverage [%]':26s}    ok   time  outliers\n")
    with Pool(options.workers) as pool:
        for case in options.cases:
            runs = pool.map(run, [(case, seed) for seed in range(options.runs)], chunksize=1)
            error, half, bound = (
                np.array([getattr(each, name) for each in runs])
                for name in ("error", "half_interval", "bound")
            )
            ratio = np.sqrt(np.nanmean((error / bound) ** 2, axis=0))
            covered = np.where(np.isnan(error), np.nan, np.abs(error) <= half)
            coverage = 100.0 * np.nanmean(covered, axis=0)
            ok = np.mean([each.status == "ok" for each in runs])
            seconds = float(np.median([each.seconds for each in runs]))
            worst = np.flatnonzero(np.nanmax(np.abs(error) / half, axis=1) > 2.0).tolist()
            out.write(
                f"{case:16s} {' '.join(f'{r:5.2f}' for r in ratio):24s} "
                f"{' '.join(f'{c:5.1f}' for c in coverage):26s} {100 * ok:4.0f}% {seconds:5.2f}s  "
                f"{worst}\n"
            )
            out.flush()


if __name__ == "__main__":
    main()
