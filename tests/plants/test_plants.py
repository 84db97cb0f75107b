import numpy as np
import pytest
from refusals import refuses

from stickslip.friction import CoulombViscousFriction, StribeckFriction
from stickslip.planning import PulseLaw, PulseSeriesPlanner
from stickslip.plants import FlexibleArm, SingleMass, check_affine
from stickslip.simulation import simulate, simulate_sensitivity

LAW = CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=0.1)
STRIBECK = StribeckFriction.symmetric(
    coulomb_friction=1.0, static_friction=1.5, viscous_friction=0.4, stribeck_velocity=1e-3
)
MASS = SingleMass(mass=1.0, friction=STRIBECK)
ARM = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=STRIBECK)


@pytest.mark.parametrize("mass", [0.0, -1.0, np.nan, np.inf])
def test_rejects_a_mass_that_is_not_positive_and_finite(mass):
    with refuses("not_positive" if np.isfinite(mass) else "not_finite", name="mass"):
        SingleMass(mass=mass, friction=LAW)


@pytest.mark.parametrize("name", ["mass_1", "mass_2", "stiffness"])
def test_rejects_an_arm_without_one_of_its_parts(name):
    values = {"mass_1": 1.0, "mass_2": 1.0, "stiffness": 1.0, name: 0.0}
    with refuses("not_positive", name=name, value=0.0):
        FlexibleArm(friction=LAW, **values)


def test_a_rotary_axis_names_its_own_unit():
    with refuses("not_positive", name="mass", value=-1.0, unit="kg m^2"):
        SingleMass(mass=-1.0, friction=LAW, kind="rotary")


@pytest.mark.parametrize("friction", [None, 3.0, CoulombViscousFriction])
@pytest.mark.usefixtures("without_shape_checks")
def test_a_plant_needs_a_friction_law(friction):
    for make in (
        lambda: SingleMass(mass=1.0, friction=friction),
        lambda: FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=friction),
    ):
        with refuses("wrong_type", name="friction", needed=["FrictionLaw"]):
            make()
    with refuses("wrong_type", name="plant"):
        simulate(friction, [1.0], sampling_time=0.01)


def test_energies_of_a_frictionless_swing():
    """The stretch of the spring is cos(w t), w^2 = k (1 / m_1 + 1 / m_2), at rest in the middle."""
    arm = FlexibleArm(mass_1=2.0, mass_2=3.0, stiffness=4.8, friction=LAW)
    time = np.linspace(0.0, 5.0, 50)
    stretch, rate = np.cos(2.0 * time), -2.0 * np.sin(2.0 * time)
    kinetic = arm.kinetic_energy(0.6 * rate, -0.4 * rate)
    potential = arm.potential_energy(0.6 * stretch, -0.4 * stretch)
    np.testing.assert_allclose(potential, 2.4 * np.cos(2.0 * time) ** 2, atol=1e-14)
    np.testing.assert_allclose(kinetic + potential, 2.4, rtol=1e-14)
    assert SingleMass(mass=2.0, friction=LAW).kinetic_energy(np.array([3.0])).tolist() == [9.0]


@pytest.mark.parametrize(
    "plan",
    [
        lambda: check_affine(MASS),
        lambda: PulseLaw.of(MASS),
        lambda: PulseSeriesPlanner(arm=ARM, sampling_time=0.05, effort_limit=3.0),
        lambda: simulate_sensitivity(MASS, [1.0, 2.0], sampling_time=0.01),
    ],
    ids=["check", "pulse law", "series of pulses", "sensitivity"],
)
@pytest.mark.usefixtures("without_shape_checks")
def test_what_needs_affine_friction_rejects_another_law(plan):
    with refuses("not_affine", law="StribeckFriction"):
        plan()
