import dataclasses

import numpy as np
import pytest

from stickslip.friction import (
    CoulombViscousFriction,
    DahlFriction,
    ElastoPlasticFriction,
    LuGreFriction,
    StribeckFriction,
)
from stickslip.records import InputError

STRIBECK = StribeckFriction.symmetric(
    coulomb_friction=1.0, static_friction=1.5, viscous_friction=0.4, stribeck_velocity=1e-3,
    offset=0.1,
)  # fmt: skip
UNEVEN = dataclasses.replace(STRIBECK, coulomb_friction_negative=0.8)
COULOMB = CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=0.4)
DAHL = DahlFriction(sliding=COULOMB, bristle_stiffness=1e5)
LUGRE = LuGreFriction(sliding=UNEVEN, bristle_stiffness=1e5, bristle_damping=316.0)
PLASTIC = ElastoPlasticFriction(
    sliding=UNEVEN, bristle_stiffness=1e5, bristle_damping=316.0, elastic_deflection=7e-6
)


@pytest.mark.parametrize("law", [DAHL, LUGRE, PLASTIC], ids=lambda law: type(law).__name__)
def test_steady_friction_is_that_of_sliding(law):
    velocity = np.linspace(-0.01, 0.01, 41)
    np.testing.assert_array_equal(law.friction(velocity), law.sliding.friction(velocity))
    assert law.breakaway() == law.sliding.breakaway()
    assert law.offset == law.sliding.offset


def test_passivity_of_lugre_is_that_of_barabanov_and_ortega():
    assert not LUGRE.passive  # the parameters of the paper: 0.4 * 1 < 316 * 0.5
    assert dataclasses.replace(LUGRE, bristle_damping=0.0).passive
    edge = dataclasses.replace(LUGRE, sliding=STRIBECK, bristle_damping=0.8)  # 0.4 * 1 = 0.8 * 0.5
    assert edge.passive
    assert not dataclasses.replace(edge, bristle_damping=0.81).passive
    assert not dataclasses.replace(edge, sliding=UNEVEN).passive


@pytest.mark.parametrize(
    ("law", "change", "message"),
    [
        (DAHL, {"bristle_stiffness": 0.0}, "bristle_stiffness is 0 N/m or N m/rad, it must be pos"),
        (DAHL, {"exponent": 0.5}, "the exponent is 0.5, it must be at least 1"),
        (DAHL, {"exponent": float("nan")}, "the exponent is nan"),
        (
            DAHL,
            {"sliding": dataclasses.replace(COULOMB, static_friction_negative=2.0)},
            "static_friction_negative is 2 N or N m, but the friction of Dahl has no peak",
        ),
        (
            DAHL,
            {
                "sliding": CoulombViscousFriction.symmetric(
                    coulomb_friction=0.0, viscous_friction=1.0
                )
            },
            "coulomb_friction_positive is 0 N or N m, it must be positive",
        ),
        (LUGRE, {"bristle_damping": -1.0}, "bristle_damping is -1 .* must not be negative"),
        (PLASTIC, {"elastic_deflection": 0.0}, "elastic_deflection is 0 m or rad, it must be pos"),
        (PLASTIC, {"elastic_deflection": 8e-6}, "it must be below 8e-06 m or rad"),
    ],
)
def test_refuses_unphysical_values(law, change, message):
    with pytest.raises(InputError, match=message):
        dataclasses.replace(law, **change)
