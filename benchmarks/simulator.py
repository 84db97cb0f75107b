"""The simulator beside others, on the stored reference run of a flexible arm."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import cycle, repeat

import numpy as np
from rich.progress import Progress

from benchmarks.measuring import Comparison, Row, Rows, Target
from benchmarks.other_simulators import by_mujoco, by_runge_kutta, by_solve_ivp
from benchmarks.reference import ReferenceRun, reference_runs
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, Plant, SingleMass
from stickslip.simulation import (
    PlantStepper,
    SimulatedBatch,
    SimulatedMotion,
    simulate,
    simulate_batch,
)

_LONG = 10
"""The long run repeats the effort of the reference run so many times."""

_ONE_TRAJECTORY = 10.0
"""Goal [ns a sample]."""

_ONE_STEP = 1.0
"""Goal [us a sample] of a step called from Python."""

_BATCH = 256
"""Trajectories of a batch, each as long as the long run."""

_BATCHES = 40
"""Batches of different arms."""

_SPREAD = 0.1
"""Relative spread of their friction, and spread of the load's velocity at the start [m/s]."""

_BATCH_RATE = 200.0
"""Goal [million samples a second] on one core."""

_TWO_CORES = 1.8
"""Goal for the speed of two cores, in that of one."""


def compare(progress: Progress) -> list[Comparison]:
    """Time one trajectory and one step, and how far a stuck mass creeps."""
    (run,) = reference_runs("design_case")
    return [_trajectory(run, progress), _creep(progress)]


def _states(motion: SimulatedMotion) -> np.ndarray:
    columns = [motion.position, motion.velocity, motion.load_position, motion.load_velocity]
    return np.stack([column for column in columns if column is not None], axis=1)


def _simulate(run: ReferenceRun, effort: np.ndarray) -> SimulatedMotion:
    return simulate(
        run.plant, effort, sampling_time=run.sampling_time, initial_state=run.initial_state
    )


def _stepped(
    run: ReferenceRun, stepper: PlantStepper, efforts: list[float]
) -> list[tuple[float, ...]]:
    """Step through the run sample by sample from Python."""
    step, state = stepper.step, stepper.init(run.initial_state)
    outputs = [run.initial_state]
    for effort in efforts:
        state, output = step(state, effort)
        outputs.append(output)
    return outputs


def _batch_of(run: ReferenceRun, seed: int) -> list[FlexibleArm]:
    """Draw arms with friction around the run's; the first has the run's own."""
    arm = run.plant
    if not isinstance(arm, FlexibleArm):
        raise TypeError(f"the run {run.name} is not of an arm")
    law = arm.friction
    factors = np.random.default_rng(seed).uniform(1 - _SPREAD, 1 + _SPREAD, size=(_BATCH, 2))
    factors[0] = 1.0
    return [
        replace(
            arm,
            friction=CoulombViscousFriction.symmetric(
                coulomb_friction=law.coulomb_friction_positive * coulomb,
                viscous_friction=law.viscous_friction_positive * viscous,
            ),
        )
        for coulomb, viscous in factors.tolist()
    ]


def _starts(run: ReferenceRun) -> np.ndarray:
    """Draw initial states with a swinging load; the first is the run's own."""
    states = np.tile(np.asarray(run.initial_state, dtype=np.float64), (_BATCH, 1))
    states[1:, 3] += np.random.default_rng(1).normal(scale=_SPREAD, size=_BATCH - 1)
    return states


def _first_states(batch: SimulatedBatch) -> np.ndarray:
    columns = [batch.position, batch.velocity, batch.load_position, batch.load_velocity]
    return np.stack([column[0] for column in columns if column is not None], axis=1)


def _others(run: ReferenceRun) -> list[tuple[str, Callable[[], np.ndarray], int]]:
    """Return name, states of the run and repetitions of each other simulator."""
    return [
        (
            "solve_ivp with events, RK45 1e-10",
            partial(by_solve_ivp, run, method="RK45", tolerance=1e-10),
            3,
        ),
        (
            "solve_ivp with events, LSODA 1e-10",
            partial(by_solve_ivp, run, method="LSODA", tolerance=1e-10),
            3,
        ),
        (
            "solve_ivp with events, Radau 1e-10",
            partial(by_solve_ivp, run, method="Radau", tolerance=1e-10),
            1,
        ),
        (
            "the same, RK45 1e-6, anew at each sample",
            partial(by_solve_ivp, run, method="RK45", tolerance=1e-6, each_sample=True),
            1,
        ),
        ("compiled RK4 with sign(v), step T", partial(by_runge_kutta, run, substeps=1), 50),
        ("compiled RK4 with sign(v), step T/100", partial(by_runge_kutta, run, substeps=100), 5),
        (
            "MuJoCo as it comes, step T",
            partial(by_mujoco, run, substeps=1, integrator="Euler", stiff=False),
            3,
        ),
        (
            "MuJoCo, stiff, implicitfast, step T/100",
            partial(by_mujoco, run, substeps=100, integrator="implicitfast"),
            1,
        ),
        (
            "MuJoCo, stiff, RK4, step T/100",
            partial(by_mujoco, run, substeps=100, integrator="RK4"),
            1,
        ),
    ]


def _targets(ours: Row, step: Row, batch: list[float]) -> tuple[Target, ...]:
    """Return the goals; ``batch`` is the time of a sample on one core and on two [ns]."""
    one, two = batch
    return (
        Target(
            text="one trajectory, ns a sample",
            measured=ours.nanoseconds,
            limit=_ONE_TRAJECTORY,
        ),
        Target(text="one step from Python, µs", measured=step.nanoseconds / 1e3, limit=_ONE_STEP),
        Target(
            text="batch, million samples a second and core",
            measured=1e3 / one,
            limit=_BATCH_RATE,
            at_least=True,
        ),
        Target(
            text="batch, two cores over one",
            measured=one / two,
            limit=_TWO_CORES,
            at_least=True,
        ),
    )


def _trajectory(run: ReferenceRun, progress: Progress) -> Comparison:
    n = run.effort.size
    rows = Rows(progress, "one trajectory", total=15)
    effort, long_effort = run.effort, np.tile(run.effort, _LONG)
    error = run.position_error
    ours = rows.add(
        f"stickslip, {_LONG * n} samples",
        partial(_simulate, run, long_effort),
        _LONG * n,
        error=lambda motion: error(_states(motion)),
        repetitions=50,
        ours=True,
    )
    rows.add(
        f"stickslip, {n} samples",
        partial(_simulate, run, effort),
        n,
        error=lambda motion: error(_states(motion)),
        repetitions=200,
        ours=True,
    )
    step = rows.add(
        "stickslip, step by step from Python",
        partial(
            _stepped,
            run,
            PlantStepper(run.plant, sampling_time=run.sampling_time),
            effort.tolist(),
        ),
        n,
        error=lambda outputs: error(np.array(outputs)),
        repetitions=20,
        ours=True,
    )
    starts = _starts(run)
    # Other arms at each repetition, so that their matrices have to be computed
    drawn = cycle([_batch_of(run, seed) for seed in range(_BATCHES)])

    def batch_row(name: str, arms: Iterator[Plant | list[FlexibleArm]], cores: int) -> Row:
        def propagated(effort: np.ndarray, store_every: int | None) -> SimulatedBatch:
            return simulate_batch(
                next(arms),
                effort,
                sampling_time=run.sampling_time,
                initial_states=starts,
                store_every=store_every,
                threads=cores,
            )

        return rows.add(
            f"stickslip, {_BATCH} {name}, {cores} core{'s' * (cores > 1)}",
            partial(propagated, long_effort, None),
            _BATCH * _LONG * n,
            error=lambda _: error(_first_states(propagated(effort, 1))),
            repetitions=30,
            ours=True,
        )

    batch = [batch_row("starts", repeat(run.plant), cores).nanoseconds for cores in (1, 2)]
    batch_row("starts, each another arm", drawn, 1)
    for name, function, repetitions in _others(run):
        rows.add(name, function, n, error=error, repetitions=repetitions)
    return Comparison(
        title=(
            f"Flexible arm, {n} samples of {run.sampling_time:g} s, ±0.5 N for 2 s each, "
            "then none; error against a 30-digit reference"
        ),
        item="sample",
        error_name="error, m",
        rows=tuple(rows.rows),
        targets=_targets(ours, step, batch),
    )


def _creep(progress: Progress) -> Comparison:
    """Hold a mass of 150 kg with 100 N of friction under 95 N for 60 s: it must not move."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=100.0, viscous_friction=700.0)
    n, sampling_time = 6000, 0.01
    run = ReferenceRun(
        name="creep",
        plant=SingleMass(mass=150.0, friction=law),
        sampling_time=sampling_time,
        initial_state=(0.0, 0.0),
        effort_runs=((95.0, n),),
        samples=np.arange(n + 1),
        states=np.zeros((n + 1, 2)),
        touches=0,
    )
    rows = Rows(progress, "creep", total=4)
    rows.add(
        "stickslip",
        partial(_simulate, run, run.effort),
        n,
        error=lambda motion: run.position_error(_states(motion)),
        repetitions=200,
        ours=True,
    )
    rows.add(
        "solve_ivp with events, LSODA 1e-10",
        partial(by_solve_ivp, run, method="LSODA", tolerance=1e-10),
        n,
        error=run.position_error,
        repetitions=3,
    )
    for name, substeps, stiff in (
        ("MuJoCo as it comes, step T", 1, False),
        ("MuJoCo, stiff, implicitfast, step T/10", 10, True),
    ):
        rows.add(
            name,
            partial(by_mujoco, run, substeps=substeps, integrator="implicitfast", stiff=stiff),
            n,
            error=run.position_error,
            repetitions=3,
        )
    return Comparison(
        title="A mass held by 100 N of friction under 95 N for 60 s: how far it creeps",
        item="sample",
        error_name="creep, m",
        rows=tuple(rows.rows),
    )
