import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip.control import PD, FrictionCompensation, OnlineFriction
from stickslip.control.feedback.friction_compensation import compensating_effort, physical
from stickslip.control.feedback.linear_parts import pd_effort
from stickslip.estimation import EnergyEstimator
from stickslip.friction import CoulombViscousFriction
from stickslip.records import InputError

VALUE = st.floats(-1e6, 1e6)
SIZE = st.floats(0.0, 1e6)
LAW = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)


def never_learns(state, u, x, v, x2, v2):
    return True


@given(f_pos=SIZE, f_neg=SIZE, c_pos=SIZE, c_neg=SIZE, v=VALUE)
def test_what_is_compensated_is_the_friction_of_the_law(f_pos, f_neg, c_pos, c_neg, v):
    law = CoulombViscousFriction(
        coulomb_friction_positive=f_pos,
        coulomb_friction_negative=f_neg,
        static_friction_positive=f_pos,
        static_friction_negative=f_neg,
        viscous_friction_positive=c_pos,
        viscous_friction_negative=c_neg,
    )
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
    ("make", "message"),
    [
        (lambda: PD(position_gain=0.0, velocity_gain=1.0), "position_gain is 0 N/m or N m/rad"),
        (lambda: PD(position_gain=1.0, velocity_gain=-1.0), "velocity_gain is -1 N s/m"),
        (
            lambda: FrictionCompensation(friction=LAW, velocity="true"),
            "velocity is 'true', there is no such one; use one of 'reference', 'measured'",
        ),
        (
            lambda: FrictionCompensation(friction=LAW, dead_band=-0.1),
            r"dead_band is -0\.1 m/s or rad/s",
        ),
        (
            lambda: OnlineFriction(
                kernel=never_learns,
                first_state=np.zeros(4),
                sampling_time=0.01,
                values_at=slice(0, 3),
                needs_load=False,
            ),
            "names 3 of the 4 values in the estimator's state, it must name 2",
        ),
        (
            lambda: OnlineFriction(
                kernel=never_learns,
                first_state=np.array([0.0, np.nan]),
                sampling_time=0.01,
                values_at=slice(0, 2),
                needs_load=False,
            ),
            "first_state is nan",
        ),
        (
            lambda: OnlineFriction(
                kernel=None,
                first_state=np.zeros(2),
                sampling_time=0.01,
                values_at=slice(0, 2),
                needs_load=False,
            ),
            "the kernel is a NoneType, it cannot be called",
        ),
        (
            lambda: OnlineFriction(
                kernel=never_learns,
                first_state=np.zeros(2),
                sampling_time=0.0,
                values_at=slice(0, 2),
                needs_load=False,
            ),
            "sampling_time is 0 s, it must be positive",
        ),
        (
            lambda: FrictionCompensation(friction=EnergyEstimator(inertia=1.0)),
            r"friction must be a CoulombViscousFriction or an OnlineFriction, it is a "
            r"EnergyEstimator; give the law, or OnlineFriction\.of\(estimator",
        ),
    ],
)
@pytest.mark.usefixtures("without_shape_checks")
def test_refuses_what_cannot_be_used(make, message):
    with pytest.raises(InputError, match=message):
        make()
