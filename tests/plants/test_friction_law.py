import pytest

from stickslip.friction import CoulombViscousFriction, StribeckFriction
from stickslip.planning import PulseLaw, PulseSeriesPlanner
from stickslip.plants import FlexibleArm, SingleMass, check_affine
from stickslip.records import InputError
from stickslip.simulation import simulate_sensitivity

STRIBECK = StribeckFriction.symmetric(
    coulomb_friction=1.0, static_friction=1.5, viscous_friction=0.4, stribeck_velocity=1e-3
)
MASS = SingleMass(mass=1.0, friction=STRIBECK)
ARM = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=STRIBECK)


def test_coulomb_and_viscous_friction_is_affine():
    law = CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=0.4)
    check_affine(SingleMass(mass=1.0, friction=law))


@pytest.mark.parametrize(
    "plan",
    [
        lambda: PulseLaw.of(MASS),
        lambda: PulseSeriesPlanner(arm=ARM, sampling_time=0.05, effort_limit=3.0),
        lambda: simulate_sensitivity(MASS, [1.0, 2.0], sampling_time=0.01),
    ],
    ids=["pulse law", "series of pulses", "sensitivity"],
)
@pytest.mark.usefixtures("without_shape_checks")
def test_what_needs_affine_friction_refuses_another_law(plan):
    with pytest.raises(InputError, match="the plant's friction is a StribeckFriction, it must be"):
        plan()
