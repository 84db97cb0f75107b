import dataclasses

import pytest

from stickslip.friction import CoulombViscousFriction
from stickslip.records import InputError

LAW = CoulombViscousFriction(
    coulomb_friction_positive=1.0,
    coulomb_friction_negative=2.0,
    static_friction_positive=1.5,
    static_friction_negative=2.5,
    viscous_friction_positive=0.1,
    viscous_friction_negative=0.2,
    offset=-0.3,
)


def test_friction_opposes_motion_per_direction():
    assert LAW.friction([-2.0, 0.0, 2.0]).tolist() == [-2.4, 0.0, 1.2]
    assert LAW.breakaway() == (1.5, 2.5)


def test_symmetric_law_takes_the_coulomb_friction_for_the_static_one():
    law = CoulombViscousFriction.symmetric(coulomb_friction=3.0, viscous_friction=0.5)
    assert law.breakaway() == (3.0, 3.0)
    assert law == law.mirrored()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"coulomb_friction_positive": -1.0}, "coulomb_friction_positive is -1 N or N m, it"),
        (
            {"viscous_friction_negative": -0.1},
            "viscous_friction_negative is -0.1 N s/m or N m s/rad, it",
        ),
        (
            {"static_friction_positive": 0.5},
            "below the Coulomb friction of that direction, 1 N or N m",
        ),
        ({"offset": float("nan")}, "offset is nan N or N m, it must be finite"),
        ({"coulomb_friction_negative": float("inf")}, "must be finite"),
    ],
)
def test_refuses_unphysical_values(change, message):
    with pytest.raises(InputError, match=message):
        dataclasses.replace(LAW, **change)
