"""Compare the package's simulator with the stored reference cases."""

from laws import uneven
from mpmath import mp, mpf
from reference_cases import Case, StoredRun

from stickslip.plants import FlexibleArm, SingleMass
from stickslip.simulation import SimulatedMotion, simulate

REFERENCE_TOLERANCE = 1e-13
"""Error of any state over the largest magnitude of its kind (position, velocity) in the run.

Rounding is 1.1e-16 an operation. It adds up over some thousand samples like a random walk (factor
of 10 to 100) and the cases amplify it by up to a hundred (each states by how much)."""


def plant_of(case: Case) -> SingleMass | FlexibleArm:
    """Make the package's plant of a case."""
    friction = uneven(
        coulomb=case.coulomb, static=case.static, viscous=case.viscous, offset=case.offset
    )
    if "mass" in case.plant:
        return SingleMass(mass=case.plant["mass"], friction=friction)
    return FlexibleArm(**case.plant, friction=friction)


def motion_of(case: Case) -> SimulatedMotion:
    """Simulate a case with the package."""
    return simulate(
        plant_of(case),
        case.effort,
        sampling_time=case.sampling_time,
        initial_state=case.initial_state,
    )


def largest_error(stored: StoredRun, motion: SimulatedMotion) -> float:
    """Largest error of the stored samples, relative to the largest magnitude of its kind."""
    columns = [motion.position, motion.velocity]
    if motion.load_position is not None and motion.load_velocity is not None:
        columns += [motion.load_position, motion.load_velocity]
    sizes = (stored.largest_position, stored.largest_velocity)
    worst = 0.0
    with mp.workdps(40):
        for k, state in stored.states.items():
            assert len(state) == len(columns)
            for i, value in enumerate(state):
                size = sizes[i % 2]
                error = float(abs(mpf(value) - mpf(float(columns[i][k]))))
                worst = max(worst, error / size if size else error)
    return worst
