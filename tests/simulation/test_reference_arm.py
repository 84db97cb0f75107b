"""The flexible arm against the 30-digit event-driven reference, in every stored case."""

import pytest
from against_reference import REFERENCE_TOLERANCE, largest_error, motion_of
from reference_cases import StoredRun, read

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm
from stickslip.simulation import simulate

RUNS = [*read("flexible_arm"), *read("design_case")]


@pytest.mark.parametrize("stored", RUNS, ids=lambda run: run.case.name)
def test_run_agrees_with_the_reference(stored: StoredRun) -> None:
    motion = motion_of(stored.case)
    assert largest_error(stored, motion) <= REFERENCE_TOLERANCE
    assert {k: bool(motion.stuck[k]) for k in stored.at_rest} == stored.at_rest
    if not stored.events["touch"]:  # a stop of no duration may be counted as none
        assert motion.event_count == sum(stored.events.values())


@pytest.mark.parametrize(
    ("load_velocity", "flagged"), [(0.0, True), (2.0**-20, False), (-(2.0**-20), False)]
)
def test_a_velocity_that_grazes_zero_is_flagged(load_velocity: float, flagged: bool) -> None:
    """v1 = 1 + (1 - v2(0)) cos(omega t) touches zero if the load starts at rest, else it does not.

    With static friction above Coulomb friction, staying and going on are then equally right.
    """
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=0.125, static_friction=0.1875, viscous_friction=0.0
    )
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
    start = (0.0, 2.0 - load_velocity, 0.0, load_velocity)
    motion = simulate(arm, [0.125] * 4, sampling_time=1.0, initial_state=start)
    assert motion.any_grazing == flagged
