"""Published formulas and numbers that a simulation must reproduce.

The displacement of a pulse is compared with Eq. 3 of part B in `tests/planning/test_pulse_law.py`.
"""

import numpy as np
import pytest

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.simulation import simulate

# Report part B, Table 1
MASS, FC, C, T = 150.0, 100.0, 700.0, 0.01


def test_time_to_stop():
    """t_stop = (m/c) ln(1 + c v/fc)."""
    v = 0.25
    law = CoulombViscousFriction.symmetric(coulomb_friction=FC, viscous_friction=C)
    axis = SingleMass(mass=MASS, friction=law)
    motion = simulate(axis, np.zeros(100), sampling_time=T, initial_state=(0.0, v))
    assert motion.event_mode.tolist() == [0]
    expected = MASS / C * np.log1p(C * v / FC)
    assert motion.event_time[0] == pytest.approx(expected, rel=1e-13)


def test_stuck_for_a_minute_the_mass_does_not_move_at_all():
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=90.0, viscous_friction=10.0, static_friction=100.0
    )
    effort = np.full(6000, 95.0)
    rigid = simulate(
        SingleMass(mass=MASS, friction=law), effort, sampling_time=T, initial_state=(0.7, 0.0)
    )
    assert np.all(rigid.position == 0.7)
    arm = FlexibleArm(mass_1=MASS, mass_2=10.0, stiffness=5e3, friction=law)
    flexible = simulate(arm, effort, sampling_time=T, initial_state=(0.7, 0.0, 0.7009, 0.0))
    assert np.all(flexible.position == 0.7)
    assert np.ptp(flexible.load_position) > 1e-3


def test_the_surrogate_arm_comes_to_rest_and_its_load_swings_on():
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
    effort = np.concatenate((np.full(500, 1.0), np.full(500, -1.0), np.zeros(5000)))
    motion = simulate(arm, effort, sampling_time=T)
    assert round(float(motion.event_time[-1]), 1) == 20.2
    assert motion.event_mode[-1] == 0
    swing = motion.load_position[3000:] - motion.position[3000:]
    assert round(float(np.abs(swing).max()), 3) == 0.116
    assert not motion.any_grazing
