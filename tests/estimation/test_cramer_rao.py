"""The Cramer-Rao bound: closed forms, a Monte Carlo that attains it, and what it refuses."""

from typing import Any

import numpy as np
import pytest
from laws import uneven
from refusals import refuses
from scipy.stats import chi2

from stickslip.estimation import CramerRaoBound, MaximumLikelihoodEstimator, cramer_rao_bound
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.simulation import Sensors, simulate

LAW = CoulombViscousFriction.symmetric(coulomb_friction=0.5, viscous_friction=0.1, offset=0.05)
SERVO = SingleMass(mass=0.05, friction=LAW, kind="rotary")
SAMPLING_TIME = 2e-3
TIME = np.arange(1000) * SAMPLING_TIME
EFFORT = 0.8 * np.sin(2 * np.pi * 0.7 * TIME) + 0.6 * np.sin(2 * np.pi * 2.9 * TIME + 1.0)
STATE = (0.0, 0.5)

RUNS = 30
UNLUCKY = 1e-4
"""Chance that the mean square error of so many runs that attain the bound exceeds the limit, in any
of the parameters (Bonferroni); 400 runs gave ratios of 0.94 to 1.03."""

COASTING = 1e-5
"""Relative; the last run of equal readings also holds the end of the motion into the rest."""


def bound_of(sensors: Sensors, effort: np.ndarray = EFFORT, **settings: Any) -> CramerRaoBound:
    return cramer_rao_bound(SERVO, effort, sampling_time=SAMPLING_TIME, sensors=sensors, **settings)


def test_velocity_of_a_sliding_mass_in_closed_form() -> None:
    """v(t) = v_0 - (f_c/m) t: with the mass known and v_0 sought, a straight line is fitted."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=2.0, viscous_friction=0.0)
    n, T, mass, noise = 40, 0.01, 1.5, 0.02
    bound = cramer_rao_bound(
        SingleMass(mass=mass, friction=law),
        np.zeros(n),
        sampling_time=T,
        sensors=Sensors(position_noise=1e6, velocity_noise=noise),
        initial_state=(0.0, 3.0),
        sought=("coulomb_friction",),
    )
    time = T * np.arange(n + 1)
    spread = float(np.sum((time - time.mean()) ** 2))
    expected = mass * noise / np.sqrt(spread)
    assert bound.std["coulomb_friction"] == pytest.approx(expected, rel=1e-9)
    assert bound.information[0, 0] == pytest.approx(expected**-2, rel=1e-9)


@pytest.mark.slow
def test_maximum_likelihood_attains_the_bound() -> None:
    sensors = Sensors(position_noise=1e-2, velocity_noise=0.1)
    bound = bound_of(sensors, initial_state=STATE)
    truth = {"inertia": 0.05, "viscous_friction": 0.1, "coulomb_friction": 0.5, "offset": 0.05}
    motion = simulate(SERVO, EFFORT, sampling_time=SAMPLING_TIME, initial_state=STATE)
    generator = np.random.default_rng(1)
    estimator = MaximumLikelihoodEstimator(noise="white")
    fits = [estimator.fit(sensors.measure(motion, generator)) for _ in range(RUNS)]
    limit = chi2.isf(UNLUCKY / len(truth), RUNS)
    least = chi2.ppf(UNLUCKY / len(truth), RUNS)
    for name, value in truth.items():
        scaled = [(fit.value(name) - value) / bound.std[name] for fit in fits]
        assert least < float(np.sum(np.square(scaled))) < limit, name
        classical = np.mean([fit.diagnostics.classical_std[name] for fit in fits])
        assert classical == pytest.approx(bound.std[name], rel=0.1)


def test_undetermined_parameters_are_unbounded() -> None:
    """One way only: Coulomb friction and offset are the same force."""
    one_way = 1.2 + 0.3 * np.sin(9.0 * TIME)
    bound = bound_of(Sensors(position_noise=1e-3, velocity="none"), one_way)
    assert bound.std["coulomb_friction"] == np.inf
    assert bound.std["offset"] == np.inf
    assert bound.std["inertia"] < 1e-3


def test_readings_of_an_encoder_at_rest_are_one() -> None:
    sensors = Sensors(encoder_step=1e-3, velocity="none")
    short, long = (bound_of(sensors, np.append(EFFORT, np.zeros(rest))) for rest in (500, 20_000))
    for name, std in short.std.items():
        assert long.std[name] == pytest.approx(std, rel=COASTING)


def test_every_parameter_of_an_arm_is_bounded() -> None:
    law = uneven(coulomb=(0.15, 0.2), static=(0.2, 0.2), viscous=(0.1, 0.1))
    arm = FlexibleArm(mass_1=1.0, mass_2=0.8, stiffness=30.0, friction=law)
    effort = np.repeat(np.random.default_rng(2).uniform(-0.6, 0.6, 20), 50)
    sensors = Sensors(position_noise=1e-3, velocity="none")
    bound = cramer_rao_bound(arm, effort, sampling_time=0.01, sensors=sensors)
    assert bound.names[:3] == ("mass", "load_mass", "stiffness")
    assert "coulomb_friction_negative" in bound.names
    assert all(0.0 < std < 0.1 for std in bound.std.values())
    motor = Sensors(position_noise=1e-3, velocity="none", load=False)
    less = cramer_rao_bound(arm, effort, sampling_time=0.01, sensors=motor)
    assert all(less.std[name] > std for name, std in bound.std.items())


@pytest.mark.parametrize(
    "sensors",
    [Sensors(velocity="none"), Sensors(position_noise=1e-3)],
    ids=["position", "velocity"],
)
def test_exact_sensors_have_no_bound(sensors: Sensors) -> None:
    with refuses("exact_velocities" if sensors.position_noise else "exact_positions"):
        bound_of(sensors)
