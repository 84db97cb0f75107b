"""The balance of work with the inertia sought: the truth, the Cramer-Rao bound, coverage."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
import scipy.stats
from estimates import covered
from simulated_logs import autoregression, disturbed

from stickslip.estimation import EnergyEstimator, cramer_rao_bound
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.records import AxisLog, FrictionEstimate, Status
from stickslip.simulation import Sensors, simulate

RUNS = 40
SURE = 0.999  # probability with which a right estimator passes a statistical bound
NEAR_BOUND = 6.0
"""RMSE over the Cramer-Rao bound, which includes the stops of the axis: 3 to 5 in long studies, and
ten times as much for the levels of energy from which the search begins."""
CLEAN = 1e-5  # relative, without noise: what friction that turns within a sample leaves

T = 0.002
TRUTH = {"mass": 1.5, "viscous_friction": 3.0, "coulomb_friction": 2.0, "offset": 0.2}
LAW = CoulombViscousFriction.symmetric(
    coulomb_friction=TRUTH["coulomb_friction"],
    viscous_friction=TRUTH["viscous_friction"],
    offset=TRUTH["offset"],
)
RIGID = SingleMass(mass=TRUTH["mass"], friction=LAW)
ARM = FlexibleArm(mass_1=TRUTH["mass"], mass_2=0.8, stiffness=300.0, friction=LAW)
NOISY = Sensors(position_noise=1e-4, velocity_noise=1e-2)
POSITIONS = Sensors(position_noise=1e-5, velocity="none")


@dataclass(frozen=True, kw_only=True)
class Case:
    """An axis, its sensors, and a force that disturbs it."""

    plant: SingleMass | FlexibleArm
    sensors: Sensors
    disturbance: float = 0.0


CASES = {
    "velocity": Case(plant=RIGID, sensors=NOISY),
    "positions": Case(plant=RIGID, sensors=POSITIONS),
    "encoder": Case(plant=RIGID, sensors=Sensors(encoder_step=2e-5, velocity="none")),
    "disturbed": Case(plant=RIGID, sensors=NOISY, disturbance=0.1),
    "arm": Case(plant=ARM, sensors=POSITIONS),
}


def estimator(plant: SingleMass | FlexibleArm, *, offset: bool = True) -> EnergyEstimator:
    if isinstance(plant, SingleMass):
        return EnergyEstimator(offset=offset)
    return EnergyEstimator(load_inertia=plant.mass_2, stiffness=plant.stiffness, offset=offset)


def effort_of(generator: np.random.Generator, samples: int = 3_000) -> np.ndarray:
    time = T * np.arange(samples)
    phases = generator.uniform(0.0, 2.0 * np.pi, 2)
    return 4.0 * np.sin(np.pi * time + phases[0]) + 3.0 * np.sin(2.6 * np.pi * time + phases[1])


def log_of(case: Case, effort: np.ndarray, generator: np.random.Generator) -> AxisLog:
    """Return a log; a disturbing force is an autoregression of coefficient 0.98, and not logged."""
    force = case.disturbance * autoregression(generator, effort.size, 0.98)
    start = float(generator.uniform(0.0, 2e-5))
    state = (start, 0.0) if isinstance(case.plant, SingleMass) else (start, 0.0, start, 0.0)
    return disturbed(
        case.plant, effort, force, case.sensors, generator, sampling_time=T, state=state
    )


@pytest.mark.parametrize("plant", [RIGID, ARM], ids=["rigid", "arm"])
def test_without_noise_the_truth_is_found(plant: SingleMass | FlexibleArm) -> None:
    generator = np.random.default_rng(5)
    effort = effort_of(generator)
    log = Sensors().measure(simulate(plant, effort, sampling_time=T), generator)
    estimate = estimator(plant).fit(log)
    assert estimate.status is Status.OK
    for name, true in TRUTH.items():
        assert estimate.value(name) == pytest.approx(true, rel=CLEAN)


@cache
def fits(name: str) -> list[tuple[np.ndarray, FrictionEstimate]]:
    """Return the effort and the estimate of each run of a case."""
    found: list[tuple[np.ndarray, FrictionEstimate]] = []
    for seed in np.random.SeedSequence(23).spawn(RUNS):
        generator = np.random.default_rng(seed)
        effort = effort_of(generator)
        log = log_of(CASES[name], effort, generator)
        found.append((effort, estimator(CASES[name].plant).fit(log)))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_intervals_hold_the_truth(name: str) -> None:
    """In every case: what is measured, what disturbs, and whether a load swings."""
    held = dict.fromkeys(TRUTH, 0)
    for _, estimate in fits(name):
        assert estimate.status is Status.OK
        for parameter, inside in covered(estimate, TRUTH).items():
            held[parameter] += inside
    least = scipy.stats.binom.ppf(1.0 - SURE, RUNS, 0.93)
    assert all(count >= least for count in held.values()), held


@pytest.mark.slow
def test_the_error_is_near_the_bound() -> None:
    squares = dict.fromkeys(TRUTH, 0.0)
    for effort, estimate in fits("velocity"):
        bound = cramer_rao_bound(RIGID, effort, sampling_time=T, sensors=NOISY).std
        for name, true in TRUTH.items():
            squares[name] += ((estimate.value(name) - true) / bound[name]) ** 2 / RUNS
    # The root mean square of RUNS normal errors is this much larger than theirs at most
    chance = np.sqrt(scipy.stats.chi2.ppf(SURE, RUNS) / RUNS)
    # The stops determine an offset the most, and this estimator does not use them
    for name in ("mass", "viscous_friction", "coulomb_friction"):
        assert np.sqrt(squares[name]) < chance * NEAR_BOUND, squares


def test_constant_speed_does_not_identify_the_mass() -> None:
    law = CoulombViscousFriction.symmetric(coulomb_friction=2.0, viscous_friction=3.0)
    plant = SingleMass(mass=1.5, friction=law)
    generator = np.random.default_rng(3)
    motion = simulate(plant, np.full(3_000, 5.0), sampling_time=T, initial_state=(0.0, 1.0))
    estimate = EnergyEstimator(offset=False).fit(NOISY.measure(motion, generator))
    assert estimate.parameters["mass"].value is None


def test_a_drive_that_bends_at_the_rate_of_the_samples_is_left_to_the_energies() -> None:
    """A stiff spring, shaken at all frequencies: slowly both masses move, and quickly the first."""
    generator = np.random.default_rng(8)
    bends = replace(ARM, stiffness=1e5)
    effort = effort_of(generator, 10_000) + 3.0 * generator.normal(size=10_000)
    log = NOISY.measure(simulate(bends, effort, sampling_time=T), generator)
    log = replace(log, measured_load_position=None, measured_load_velocity=None)
    estimate = EnergyEstimator().fit(log)
    assert estimate.status is Status.OK
    assert estimate.diagnostics.notes[0].startswith("energies averaged")
    assert all(covered(estimate, TRUTH | {"mass": ARM.mass_1 + ARM.mass_2}).values())
