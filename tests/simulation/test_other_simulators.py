"""The simulator against other software, within that software's own error."""

import numpy as np
import pytest

from benchmarks.other_simulators import by_mujoco, by_runge_kutta, by_solve_ivp
from benchmarks.reference import ReferenceRun, reference_runs
from stickslip.simulation import SimulatedMotion, simulate

SOLVE_IVP_TOLERANCE = 3e-8
"""Relative to the largest magnitude, at a tolerance of 1e-10: some hundred steps that each err by
it. Found were 1e-9 to 1.2e-8."""

MUJOCO_TOLERANCE = 2e-4
"""Relative to the largest magnitude, at 80 steps a sample: the friction constraint yields, and a
step is of first order. Found were 3.6e-5 and 1.5e-5, with the RK4 integrator 9.6e-5 and 1.2e-5."""

RUNS = {
    run.name: run
    for name in ("design_case", "single_mass", "flexible_arm")
    for run in reference_runs(name)
}

# Both plants, with and without viscous friction and static above Coulomb friction; per direction;
# offset; many sticks, reversals and breakaways. Double crossings within a step are left out: an
# integrator that looks for sign changes at its steps is blind to them.
CASES = [
    "design",
    "bang-bang",
    "surrogate",
    "micrometres",
    "light-motor-directions",
    "swinging-load",
    "dry-T0.1-k1",
    "dry-static-T0.5-k1",
    "viscous-static-T0.1-k1",
    "directions-T0.1-k1",
    "very-viscous-T1-k1",
    "table-1-pulses",
    "positioning-stage",
    "directions-T0.1",
    "dry-static-T1",
]


def _simulate(run: ReferenceRun) -> SimulatedMotion:
    return simulate(
        run.plant, run.effort, sampling_time=run.sampling_time, initial_state=run.initial_state
    )


def _states(motion: SimulatedMotion) -> np.ndarray:
    columns = [motion.position, motion.velocity]
    if motion.load_position is not None and motion.load_velocity is not None:
        columns += [motion.load_position, motion.load_velocity]
    return np.stack(columns, axis=1)


def _difference(states: np.ndarray, other: np.ndarray) -> float:
    """Largest difference of all samples, relative to the largest magnitude of its kind."""
    return max(
        float(
            np.abs(states[:, part::2] - other[:, part::2]).max() / np.abs(states[:, part::2]).max()
        )
        for part in (0, 1)
    )


@pytest.mark.parametrize("name", CASES)
def test_agrees_with_solve_ivp_with_events(name: str) -> None:
    run = RUNS[name]
    states = _states(_simulate(run))
    scale = float(np.abs(states).max())
    other = by_solve_ivp(run, method="RK45", tolerance=1e-10, scale=scale)
    assert _difference(states, other) < SOLVE_IVP_TOLERANCE


def test_solve_ivp_comes_closer_with_its_tolerance() -> None:
    run = RUNS["dry-static-T0.5-k1"]
    states = _states(_simulate(run))
    errors = [
        _difference(states, by_solve_ivp(run, method="RK45", tolerance=tolerance))
        for tolerance in (1e-4, 1e-7, 1e-10)
    ]
    assert errors[0] > 30 * errors[1] > 900 * errors[2]


@pytest.mark.parametrize("name", ["design", "surrogate"])
def test_mujoco_comes_closer_with_its_step(name: str) -> None:
    run = _shortened(RUNS[name], seconds=16.0)
    states = _states(_simulate(run))
    errors = [
        _difference(states, by_mujoco(run, substeps=substeps, integrator="implicitfast"))
        for substeps in (5, 20, 80)
    ]
    assert errors[0] > 2 * errors[1] > 4 * errors[2]  # first order, roughened by the stops
    assert errors[2] < MUJOCO_TOLERANCE


def test_fixed_steps_through_the_sign_function_come_closer_with_their_step() -> None:
    run = RUNS["design"]
    states = _states(_simulate(run))
    errors = [_difference(states, by_runge_kutta(run, substeps=n)) for n in (1, 10, 100)]
    assert errors[0] > 3 * errors[1] > 9 * errors[2]


def _shortened(run: ReferenceRun, *, seconds: float) -> ReferenceRun:
    effort = run.effort[: round(seconds / run.sampling_time)]
    return ReferenceRun(
        name=run.name,
        plant=run.plant,
        sampling_time=run.sampling_time,
        initial_state=run.initial_state,
        effort_runs=tuple((float(value), 1) for value in effort),
        samples=run.samples,
        states=run.states,
        touches=run.touches,
    )
