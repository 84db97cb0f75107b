import numpy as np
import pytest

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.records import InputError

LAW = CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=0.1)


@pytest.mark.parametrize("mass", [0.0, -1.0, float("nan"), float("inf")])
def test_refuses_a_mass_that_is_none(mass):
    with pytest.raises(InputError, match=r"mass is .* kg, it must be (positive|finite)"):
        SingleMass(mass=mass, friction=LAW)


@pytest.mark.parametrize("name", ["mass_1", "mass_2", "stiffness"])
def test_refuses_an_arm_without_one_of_its_parts(name):
    values = {"mass_1": 1.0, "mass_2": 1.0, "stiffness": 1.0, name: 0.0}
    with pytest.raises(InputError, match=f"{name} is 0 "):
        FlexibleArm(friction=LAW, **values)


def test_a_rotary_axis_names_its_own_unit():
    with pytest.raises(InputError, match=r"mass is -1 kg m\^2"):
        SingleMass(mass=-1.0, friction=LAW, kind="rotary")


def test_energies():
    arm = FlexibleArm(mass_1=2.0, mass_2=3.0, stiffness=4.0, friction=LAW)
    assert arm.kinetic_energy(np.array([1.0]), np.array([2.0])).tolist() == [7.0]
    assert arm.potential_energy(np.array([1.0]), np.array([3.0])).tolist() == [8.0]
    assert SingleMass(mass=2.0, friction=LAW).kinetic_energy(np.array([3.0])).tolist() == [9.0]
