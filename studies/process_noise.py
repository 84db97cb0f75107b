"""Errors and intervals of the maximum likelihood with process noise, against its bound.

Run ``python -m studies.process_noise --runs N``: logs of the noise cases of `studies.mismatch`,
whose plant shares no code with the package.
"""

import argparse
import sys
import time
from dataclasses import dataclass, replace
from multiprocessing import Pool

import numpy as np
from jaxtyping import Float

from stickslip.estimation.likelihood.process_noise import (
    NoiseLevels,
    ProcessNoiseLikelihoodEstimator,
    process_noise_bound,
)
from studies.mismatch.axes import physical
from studies.mismatch.cases import Recorded, record

__all__ = ["CASES", "Run", "main", "run"]

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


@dataclass(frozen=True, kw_only=True)
class Run:
    """One log.

    Attributes
    ----------
    error, std, half_interval, bound
        Of each parameter [SI], shape (p,).
    status
        Of the estimate.
    seconds
        Processor time of the fit [s].
    """

    error: Float[np.ndarray, " p"]
    std: Float[np.ndarray, " p"]
    half_interval: Float[np.ndarray, " p"]
    bound: Float[np.ndarray, " p"]
    status: str
    seconds: float


def noise_of(recorded: Recorded) -> NoiseLevels:
    """Return the true noise levels of a recording."""
    setup = recorded.setup
    plant = physical(setup)
    effort = setup.noise * plant.limit
    if recorded.log.name.startswith("quantized"):
        levels = np.unique(recorded.log.effort)
        steps = np.diff(levels)
        effort = np.hypot(effort, float(np.min(steps[steps > 1e-9 * plant.limit])) / np.sqrt(12))
    correlated = setup.correlated_disturbance > 0.0
    return NoiseLevels(
        effort=float(effort),
        white_force=setup.white_disturbance * plant.limit,
        correlated_force=setup.correlated_disturbance * setup.coulomb * plant.limit,
        time_constant=-1e-3 / float(np.log(setup.correlation)) if correlated else 0.1,
        position=float(setup.encoder_step / np.sqrt(12.0)),
        velocity=_VELOCITY_NOISE * setup.top_speed,
    )


def run(job: tuple[str, int]) -> Run:
    """Record and identify one log.

    Parameters
    ----------
    job
        Case and seed.
    """
    recorded = record(*job)
    start = time.process_time()
    estimate = ProcessNoiseLikelihoodEstimator().fit(recorded.log)
    seconds = time.process_time() - start
    truth = {name: recorded.truth[name] for name in estimate.parameters}
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
    found = [
        (nan, nan, nan)
        if p.value is None or p.std is None
        else (p.value - truth[name], p.std, p.std * p.quantile)
        for name, p in estimate.parameters.items()
    ]
    error, std, half = np.array(found).T
    return Run(
        error=error,
        std=std,
        half_interval=half,
        bound=np.array([bound.std[name] for name in truth]),
        status=estimate.status.value,
        seconds=seconds,
    )


def main() -> None:
    """Run the study and print its table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=100, help="logs of each case [default: 100]")
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
            coverage = 100.0 * np.nanmean(np.abs(error) <= half, axis=0)
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
