"""Runs of the surrogate arm with its sensors, in both loops, and five of them in a row."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from stickslip.estimation import PublishedEnergyEstimator
from stickslip.records import AxisLog
from stickslip.simulation import SimulatedMotion, simulate, simulate_closed_loop
from stickslip.tasks import surrogate
from studies.van_de_wijdeven.part_a.cases import Case
from studies.van_de_wijdeven.part_a.loops import feedback_controller

Loop = Literal["feedforward", "feedback"]
LOOPS: tuple[Loop, ...] = ("feedforward", "feedback")
RUNS_IN_A_ROW = 5
"""Simulations after which the source looks at its figures."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """One simulated run: the truth, and what the sensors recorded of it."""

    motion: SimulatedMotion
    log: AxisLog


@dataclass(frozen=True, kw_only=True)
class Trace:
    """Results of an estimator over consecutive runs."""

    #: Which ones.
    loop: Loop
    case: Case
    time: Float[np.ndarray, " n"]  #: Of a single run [s], shape (n,).
    #: Estimates of Coulomb and viscous friction [N, N s/m], shape (runs, n, 2).
    values: Float[np.ndarray, "runs n 2"]
    error: Float[np.ndarray, "runs n"]  #: Prediction error e_y [J], shape (runs, n).


def one_run(
    loop: Loop,
    noise: float,
    generator: np.random.Generator,
    estimator: PublishedEnergyEstimator,
    state: Float[np.ndarray, " s"],
) -> Run:
    """Simulate the arm for the whole duration, from rest.

    The noise of the sensors is relative to that of the surrogate values [-]. The feedback
    controller compensates the running estimates of the estimator, which begins with the state; both
    are without use in the feedforward.
    """
    sensors = surrogate.surrogate_sensors(noise)
    if loop == "feedforward":
        motion = simulate(
            surrogate.surrogate_arm(),
            surrogate.bang_bang_effort(),
            sampling_time=surrogate.SAMPLING_TIME,
        )
        return Run(motion=motion, log=sensors.measure(motion, generator))
    run = simulate_closed_loop(
        surrogate.surrogate_arm(),
        feedback_controller(estimator, state),
        sampling_time=surrogate.SAMPLING_TIME,
        samples=round(surrogate.DURATION / surrogate.SAMPLING_TIME),
        sensors=sensors,
        generator=generator,
    )
    return Run(motion=run.motion, log=run.log)


def five_runs(loop: Loop, case: Case, seeds: Sequence[np.random.SeedSequence]) -> Trace:
    """Run a case once for each seed, each time with what the run before has taught the estimator.

    Its energies begin at zero in each run; its estimates and P are kept.
    """
    estimator = case.estimator
    state = estimator.init(sampling_time=surrogate.SAMPLING_TIME)
    values: list[Float[np.ndarray, "n 2"]] = []
    errors: list[Float[np.ndarray, " n"]] = []
    time = np.empty(0)
    for seed in seeds:
        state = estimator.resume(state)
        run = one_run(loop, case.noise, np.random.default_rng(seed), estimator, state)
        time = run.log.time
        # The log holds what the controller's own estimator was handed, so this repeats it, and
        # takes the last sample, after which nothing was commanded, as well.
        errors.append(estimator.prediction_errors(state, run.log))
        state, estimates = estimator.run(state, run.log)
        values.append(estimates[:, :2])
    return Trace(loop=loop, case=case, time=time, values=np.array(values), error=np.array(errors))


def itse(
    time: Float[np.ndarray, " n"], error: Float[np.ndarray, "runs n"]
) -> Float[np.ndarray, " runs"]:
    """Return the integral of time-multiplied squared error of each run (Eq. 6.3) [J^2 s^2]."""
    return np.trapezoid(time * error**2, time, axis=1)
