"""Published formulas and numbers that a simulation must reproduce."""

import numpy as np
import pytest
from scipy.optimize import brentq

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.simulation import simulate

# Report part B, Table 1
MASS, FC, C, FS, FP, T = 150.0, 100.0, 700.0, 130.0, 300.0, 0.01
ROUNDING = 1e-13


def table(viscous):
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=FC, viscous_friction=viscous, static_friction=FS
    )
    return SingleMass(mass=MASS, friction=law)


def displacement(width, viscous=C, sign=1.0):
    """Rest to rest under one pulse of this width, held over one sample."""
    motion = simulate(table(viscous), [sign * FP, 0.0, 0.0], sampling_time=max(width, 0.5))
    if width < 0.5:
        motion = simulate(table(viscous), [sign * FP] + [0.0] * 400, sampling_time=width)
    assert motion.stuck[-1]
    return float(motion.position[-1])


@pytest.mark.parametrize("width", [0.001, 0.01, 0.03, 0.092, 0.3])
def test_pulse_without_viscous_friction(width):
    """Part B Eq. 2."""
    expected = FP * (FP - FC) / (2 * MASS * FC) * width**2
    assert displacement(width, viscous=0.0) == pytest.approx(expected, rel=ROUNDING)
    assert displacement(width, viscous=0.0, sign=-1.0) == pytest.approx(-expected, rel=ROUNDING)


@pytest.mark.parametrize("width", [0.03, 0.092, 0.3])
@pytest.mark.parametrize("viscous", [70.0, 700.0, 7000.0])
def test_pulse_with_viscous_friction(width, viscous):
    """Part B Eq. 3."""
    z = viscous * width / MASS
    expected = FP * width / viscous - MASS * FC / viscous**2 * np.log1p(FP / FC * np.expm1(z))
    # The formula is a difference of nearly equal terms where z is small; the simulation is not
    assert displacement(width, viscous) == pytest.approx(expected, rel=1e-15 * 4 / z**2 + ROUNDING)


def test_viscous_friction_fades_out_continuously():
    """Eq. 3 goes over into Eq. 2, with the first-order term of its expansion in c."""
    width = 0.03
    plain = displacement(width, viscous=0.0)
    for viscous in (1e-3, 1e-6, 1e-9):
        # d Eq. 3 / dc at c = 0: -(fp (fp - fc)(2 fp - fc) t^3)/(6 m^2 fc^2)
        slope = -FP * (FP - FC) * (2 * FP - FC) * width**3 / (6 * MASS**2 * FC**2)
        expected = plain + slope * viscous
        # The next term is smaller by c t fp/(m fc)
        second_order = abs(slope * viscous) * viscous * width * FP / (MASS * FC)
        assert displacement(width, viscous) == pytest.approx(
            expected, rel=ROUNDING, abs=second_order
        )


def test_time_to_stop():
    """t_stop = (m/c) ln(1 + c v/fc)."""
    v = 0.25
    motion = simulate(table(C), np.zeros(100), sampling_time=T, initial_state=(0.0, v))
    assert motion.event_mode.tolist() == [0]
    expected = MASS / C * np.log1p(C * v / FC)
    assert motion.event_time[0] == pytest.approx(expected, rel=1e-13)


def test_displacement_numbers_of_the_report():
    """Section 3.1 of part B: what the report prints, to the digits it prints."""
    b = FP * (FP - FC) / (2 * MASS * FC)
    exact = brentq(lambda t: displacement(t) - 0.01, 0.02, 0.2, xtol=1e-12)
    assert round(exact, 3) == 0.092
    assert np.sqrt(0.01 / b) == pytest.approx(0.070, abs=1e-3)  # 0.0707, cut off
    b_hat = 0.01 / exact**2
    assert round(b_hat / b, 1) == 0.6
    assert round(displacement(0.03) / 0.03**2 / b, 2) == 0.81
    too_long = np.sqrt(0.002 / b_hat)
    right = brentq(lambda t: displacement(t) - 0.002, 0.01, 0.1, xtol=1e-12)
    assert (round(too_long, 3), round(right, 3)) == (0.041, 0.036)
    assert displacement(too_long) == pytest.approx(2.5e-3, abs=1e-4)  # 2.56 mm, cut off


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
