import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laws import uneven
from refusals import refuses

from stickslip.control import PD, FrictionCompensation, OnlineFriction
from stickslip.control.feedback.friction_compensation import compensating_effort, physical
from stickslip.control.feedback.linear_parts import pd_effort
from stickslip.estimation import EnergyEstimator
from stickslip.friction import CoulombViscousFriction

VALUE = st.floats(-1e6, 1e6)
SIZE = st.floats(0.0, 1e6)
LAW = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)


def never_learns(state, u, x, v, x2, v2):
    return True


def idle(**wrong):
    """Return an estimate of friction that stays as it is, with some wrong settings."""
    settings = {
        "kernel": never_learns,
        "first_state": np.zeros(4),
        "sampling_time": 0.01,
        "values_at": slice(0, 2),
        "needs_load": False,
    }
    return OnlineFriction(**settings | wrong)


@given(f_pos=SIZE, f_neg=SIZE, c_pos=SIZE, c_neg=SIZE, v=VALUE)
def test_what_is_compensated_is_the_friction_of_the_law(f_pos, f_neg, c_pos, c_neg, v):
    law = uneven(coulomb=(f_pos, f_neg), static=(f_pos, f_neg), viscous=(c_pos, c_neg))
    assert compensating_effort(f_pos, f_neg, c_pos, c_neg, v, 0.0) == law.friction(np.array([v]))[0]


@given(f=SIZE, c=SIZE, v=VALUE, band=SIZE)
def test_compensation_is_odd_and_silent_in_the_dead_band(f, c, v, band):
    there = compensating_effort(f, f, c, c, v, band)
    assert there == -compensating_effort(f, f, c, c, -v, band)
    assert there * v >= 0.0
    if abs(v) <= band:
        assert there == 0.0


@given(estimate=st.floats(allow_nan=True, allow_infinity=False))
def test_an_estimate_below_zero_compensates_nothing(estimate):
    assert physical(estimate) == (estimate if estimate > 0 else 0.0)


@given(kp=SIZE, kd=SIZE, r=VALUE, x=VALUE, r_dot=VALUE, v=VALUE)
def test_pd_is_its_equation(kp, kd, r, x, r_dot, v):
    assert pd_effort(kp, kd, r, x, r_dot, v) == kp * (r - x) + kd * (r_dot - v)


@pytest.mark.parametrize(
    ("make", "code"),
    [
        (lambda: PD(position_gain=0.0, velocity_gain=1.0), "not_positive"),
        (lambda: PD(position_gain=1.0, velocity_gain=-1.0), "negative"),
        (lambda: FrictionCompensation(friction=LAW, velocity="true"), "not_a_choice"),
        (lambda: FrictionCompensation(friction=LAW, dead_band=-0.1), "negative"),
        (lambda: idle(values_at=slice(0, 3)), "places_not_two"),
        (lambda: idle(first_state=np.array([0.0, np.nan])), "samples_not_finite"),
        (lambda: idle(kernel=None), "kernel_not_callable"),
        (lambda: idle(sampling_time=0.0), "not_positive"),
        (lambda: FrictionCompensation(friction=EnergyEstimator(inertia=1.0)), "wrong_type"),
    ],
)
@pytest.mark.usefixtures("without_shape_checks")
def test_refuses_what_cannot_be_used(make, code):
    with refuses(code):
        make()
