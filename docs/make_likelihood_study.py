"""Measure the maximum-likelihood estimator against the Cramer-Rao bound, and print the tables.

    python docs/make_likelihood_study.py [RUNS]

400 runs take some five minutes on one core.
"""

import sys
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from stickslip import AxisLog, CoulombViscousFriction, Sensors, SingleMass, simulate
from stickslip.estimation import MaximumLikelihoodEstimator, cramer_rao_bound

TRUTH = {"inertia": 0.05, "viscous_friction": 0.1, "coulomb_friction": 0.5, "offset": 0.05}
PLANT = SingleMass(
    mass=TRUTH["inertia"],
    friction=CoulombViscousFriction.symmetric(
        coulomb_friction=TRUTH["coulomb_friction"],
        viscous_friction=TRUTH["viscous_friction"],
        offset=TRUTH["offset"],
    ),
    kind="rotary",
)
SAMPLING_TIME = 1e-3
SAMPLES = 10_000
COUNT = 2.0 * np.pi / 4096
TONES = ((0.6, 0.3), (0.5, 0.7), (0.5, 1.3), (0.4, 2.9), (0.4, 5.1))  # N m, Hz
CASES = {
    "encoder only": Sensors(encoder_step=COUNT, velocity="none"),
    "position and velocity noise": Sensors(position_noise=1e-2, velocity_noise=0.1),
}


def multisine(generator: np.random.Generator) -> Float[np.ndarray, " n"]:
    """Return an effort with random phases [N m]."""
    time = np.arange(SAMPLES) * SAMPLING_TIME
    effort = np.zeros(SAMPLES)
    for (amplitude, frequency), phase in zip(
        TONES, generator.uniform(0.0, 2.0 * np.pi, len(TONES)), strict=True
    ):
        effort += amplitude * np.sin(2.0 * np.pi * frequency * time + phase)
    return effort


def scenarios(runs: int, sensors: Sensors) -> Iterator[tuple[AxisLog, dict[str, float]]]:
    """Yield logs of random inputs and first positions, each with the bound of its scenario."""
    for seed in range(runs):
        generator = np.random.default_rng(seed)
        effort = multisine(generator)
        state = (float(generator.uniform(0.0, COUNT)), 0.0)
        motion = simulate(PLANT, effort, sampling_time=SAMPLING_TIME, initial_state=state)
        bound = cramer_rao_bound(
            PLANT, effort, sampling_time=SAMPLING_TIME, sensors=sensors, initial_state=state
        )
        yield sensors.measure(motion, generator), bound.std


def study(runs: int, sensors: Sensors) -> None:
    """Print bias, error over the bound and coverage of each parameter."""
    estimator = MaximumLikelihoodEstimator()
    rows: dict[str, list[tuple[float, float, bool]]] = {name: [] for name in TRUTH}
    statuses: list[str] = []
    for log, bound in scenarios(runs, sensors):
        estimate = estimator.fit(log)
        statuses.append(estimate.status.value)
        for name, true in TRUTH.items():
            parameter = estimate.parameters[name]
            low, high = parameter.ci95 or (np.nan, np.nan)
            error = estimate.value(name) - true
            rows[name].append((error, error / bound[name], low <= true <= high))
    print(f"status ok in {statuses.count('ok')} of {runs}")
    print("| parameter | bias [%] | RMSE [%] | RMSE over the bound | coverage [%] |")
    print("| --- | --- | --- | --- | --- |")
    for name, found in rows.items():
        error, scaled, held = (np.array(column) for column in zip(*found, strict=True))
        bias, spread = 100 * error.mean() / TRUTH[name], 100 * np.sqrt(np.mean(error**2))
        print(
            f"| {name.replace('_', ' ')} | {bias:+.1g} | {spread / TRUTH[name]:.2g} "
            f"| {np.sqrt(np.mean(scaled**2)):.2f} | {100 * held.mean():.1f} |"
        )


if __name__ == "__main__":
    wanted = int(sys.argv[1]) if len(sys.argv) > 1 else 400
    for title, sensors in CASES.items():
        print(f"\n{title}, {wanted} runs")
        study(wanted, sensors)
