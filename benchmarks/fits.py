"""Fitting whole logs of 25 000 samples: a simulated one whose truth is known, and the EMPS."""

import os
from functools import partial
from pathlib import Path
from typing import Protocol

import numpy as np
from rich.progress import Progress

from benchmarks.measuring import Comparison, Rows, Target
from stickslip.estimation import (
    EnergyEstimator,
    IdimInstrumentalVariables,
    IdimLeastSquares,
    MaximumLikelihoodEstimator,
)
from stickslip.friction import CoulombViscousFriction
from stickslip.logs import find_benchmark, read_log
from stickslip.plants import SingleMass
from stickslip.records import AxisLog, FrictionEstimate
from stickslip.simulation import Sensors, simulate
from stickslip.tasks import compare_log

_SAMPLES = 25_000
_SAMPLING_TIME = 0.001
_MASS, _COULOMB, _VISCOUS = 95.0, 20.0, 200.0
_FREQUENCIES = (0.3, 0.9, 2.1, 4.7)  # Hz
_AMPLITUDE = 30.0  # N
_FIT_SECONDS = 2.0
_COMPARE_SECONDS = 20.0
_SCHEMA = Path(__file__).parents[1] / "examples" / "emps.toml"


class _Estimator(Protocol):
    def fit(self, log: AxisLog) -> FrictionEstimate: ...


def _simulated() -> AxisLog:
    law = CoulombViscousFriction.symmetric(coulomb_friction=_COULOMB, viscous_friction=_VISCOUS)
    time = np.arange(_SAMPLES) * _SAMPLING_TIME
    angles = 2.0 * np.pi * np.outer(_FREQUENCIES, time) + np.array(_FREQUENCIES)[:, None]
    effort = _AMPLITUDE * np.sum(np.sin(angles), axis=0)
    motion = simulate(SingleMass(mass=_MASS, friction=law), effort, sampling_time=_SAMPLING_TIME)
    sensors = Sensors(position_noise=1e-5, velocity="measured", velocity_noise=1e-3)
    return sensors.measure(motion, np.random.default_rng(1))


def _error(estimate: FrictionEstimate) -> float:
    """Return the relative error of the Coulomb friction."""
    return abs(estimate.value("coulomb_friction") / _COULOMB - 1.0)


def compare(progress: Progress) -> list[Comparison]:
    """Fit by maximum likelihood and by quicker methods; then compare all of them on the EMPS."""
    log = _simulated()
    ways: dict[str, _Estimator] = {
        "maximum likelihood": MaximumLikelihoodEstimator(),
        "maximum likelihood, each direction apart": MaximumLikelihoodEstimator(per_direction=True),
        "energy, mass known": EnergyEstimator(inertia=_MASS),
        "energy, mass sought": EnergyEstimator(),
        "IDIM-LS, mass known": IdimLeastSquares(inertia=_MASS),
        "IDIM-IV, mass known": IdimInstrumentalVariables(inertia=_MASS),
    }
    rows = Rows(progress, "a simulated log", len(ways))
    for name, estimator in ways.items():
        apart = "apart" in name
        rows.add(
            name,
            partial(estimator.fit, log),
            1,
            error=None if apart else _error,
            repetitions=3,
            ours=not rows.rows,
        )
    comparisons = [
        Comparison(
            title=f"Fitting a log of {_SAMPLES} samples with position and velocity",
            item="fit",
            error_name="error of Coulomb friction",
            rows=tuple(rows.rows),
            targets=(
                Target(
                    text="seconds for a fit by maximum likelihood",
                    measured=rows.rows[0].nanoseconds * 1e-9,
                    limit=_FIT_SECONDS,
                ),
            ),
        )
    ]
    if os.environ.get("STICKSLIP_DATA"):
        comparisons.append(_emps(progress))
    return comparisons


def _emps(progress: Progress) -> Comparison:
    """Fit the EMPS log by maximum likelihood, and let all estimators do it side by side."""
    log = read_log(find_benchmark("emps") / "DATA_EMPS.mat", schema=_SCHEMA)
    rows = Rows(progress, "the EMPS", 3)
    fits = {
        "maximum likelihood": MaximumLikelihoodEstimator(),
        "maximum likelihood, each direction apart": MaximumLikelihoodEstimator(per_direction=True),
    }
    for name, estimator in fits.items():
        rows.add(name, partial(estimator.fit, log), 1, repetitions=2, ours=not rows.rows)
    whole = rows.add("all estimators compared", partial(compare_log, log), 1, repetitions=1)
    return Comparison(
        title=f"The EMPS log, {len(log)} samples of position and effort",
        item="fit",
        error_name=None,
        rows=tuple(rows.rows),
        targets=(
            Target(
                text="seconds for a fit by maximum likelihood",
                measured=rows.rows[0].nanoseconds * 1e-9,
                limit=_FIT_SECONDS,
            ),
            Target(
                text="seconds for the whole comparison",
                measured=whole.nanoseconds * 1e-9,
                limit=_COMPARE_SECONDS,
            ),
        ),
    )
