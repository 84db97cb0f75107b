import dataclasses

import numpy as np
import pytest

from stickslip.friction import StribeckEffect, StribeckFriction
from stickslip.records import InputError

LAW = StribeckFriction(
    coulomb_friction_positive=1.0,
    coulomb_friction_negative=2.0,
    static_friction_positive=1.5,
    static_friction_negative=3.0,
    viscous_friction_positive=0.1,
    viscous_friction_negative=0.2,
    stribeck_velocity=0.5,
    offset=-0.3,
)


@pytest.mark.parametrize(
    ("shape", "left"), [("gaussian", np.exp(-4.0)), ("exponential", np.exp(-2))]
)
def test_friction_is_that_of_the_paper(shape, left):
    law = dataclasses.replace(LAW, shape=shape)
    forward, backward = 1.0 + 0.5 * left + 0.1, -2.0 - 1.0 * left - 0.2
    np.testing.assert_allclose(law.friction([-1.0, 0.0, 1.0]), [backward, 0.0, forward])


def test_motion_sets_in_at_the_static_friction_and_ends_up_viscous():
    assert LAW.friction([1e-12])[0] == pytest.approx(1.5)
    assert LAW.friction([-1e-12])[0] == pytest.approx(-3.0)
    assert LAW.friction([100.0])[0] == 1.0 + 0.1 * 100.0
    assert LAW.breakaway() == (1.5, 3.0)


def test_symmetric_law_has_one_value_for_both_directions():
    law = StribeckFriction.symmetric(
        coulomb_friction=1.0, static_friction=2.0, viscous_friction=0.5, stribeck_velocity=0.1,
        shape="exponential", offset=0.2,
    )  # fmt: skip
    assert law.mirrored() == dataclasses.replace(law, offset=-0.2)
    assert law.effect == StribeckEffect(velocity=0.1, shape="exponential")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"stribeck_velocity": 0.0}, "stribeck_velocity is 0 m/s or rad/s, it must be positive"),
        ({"stribeck_velocity": float("nan")}, "it must be finite"),
        ({"static_friction_positive": 0.5}, "below the Coulomb friction of that direction"),
        ({"viscous_friction_negative": -1.0}, "must not be negative"),
    ],
)
def test_refuses_unphysical_values(change, message):
    with pytest.raises(InputError, match=message):
        dataclasses.replace(LAW, **change)


@pytest.mark.usefixtures("without_shape_checks")
def test_refuses_an_unknown_shape():
    with pytest.raises(InputError, match="'lorentzian', there is no such"):
        dataclasses.replace(LAW, shape="lorentzian")
