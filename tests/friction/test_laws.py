"""Values of each friction law and rejected parameters, beside the contract of all."""

import dataclasses

import numpy as np
import pytest
from refusals import refuses

from stickslip.friction import (
    CoulombViscousFriction,
    DahlFriction,
    ElastoPlasticFriction,
    LuGreFriction,
    StribeckEffect,
    StribeckFriction,
)

SIDES = {
    "coulomb_friction_positive": 1.0,
    "coulomb_friction_negative": 2.0,
    "static_friction_positive": 1.5,
    "static_friction_negative": 3.0,
    "viscous_friction_positive": 0.1,
    "viscous_friction_negative": 0.2,
    "offset": -0.3,
}
UNEVEN = CoulombViscousFriction(**SIDES)
UNEVEN_STRIBECK = StribeckFriction(**SIDES, stribeck_velocity=0.5)
STRIBECK = StribeckFriction.symmetric(
    coulomb_friction=1.0, static_friction=1.5, viscous_friction=0.4, stribeck_velocity=1e-3,
    offset=0.1,
)  # fmt: skip
WEAKER = dataclasses.replace(STRIBECK, coulomb_friction_negative=0.8)
COULOMB = CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=0.4)
DAHL = DahlFriction(sliding=COULOMB, bristle_stiffness=1e5)
LUGRE = LuGreFriction(sliding=WEAKER, bristle_stiffness=1e5, bristle_damping=316.0)
PLASTIC = ElastoPlasticFriction(
    sliding=WEAKER, bristle_stiffness=1e5, bristle_damping=316.0, elastic_deflection=7e-6
)


def test_coulomb_and_viscous_friction_per_direction():
    assert UNEVEN.friction([-2.0, 0.0, 2.0]).tolist() == [-2.4, 0.0, 1.2]
    assert UNEVEN.breakaway() == (1.5, 3.0)


@pytest.mark.parametrize(
    ("shape", "left"), [("gaussian", np.exp(-4.0)), ("exponential", np.exp(-2))]
)
def test_stribeck_friction_is_that_of_the_paper(shape, left):
    law = dataclasses.replace(UNEVEN_STRIBECK, shape=shape)
    forward, backward = 1.0 + 0.5 * left + 0.1, -2.0 - 1.0 * left - 0.2
    np.testing.assert_allclose(law.friction([-1.0, 0.0, 1.0]), [backward, 0.0, forward])


def test_stribeck_friction_begins_at_the_static_friction_and_ends_viscous():
    begin, end = UNEVEN_STRIBECK.friction([-1e-12, 1e-12]), UNEVEN_STRIBECK.friction([100.0])
    np.testing.assert_allclose(begin, [-3.0, 1.5], rtol=1e-6)
    assert end.tolist() == [1.0 + 0.1 * 100.0]
    assert UNEVEN_STRIBECK.breakaway() == (1.5, 3.0)


def test_symmetric_laws_have_one_value_for_both_directions():
    law = StribeckFriction.symmetric(
        coulomb_friction=1.0, static_friction=2.0, viscous_friction=0.5, stribeck_velocity=0.1,
        shape="exponential", offset=0.2,
    )  # fmt: skip
    assert law.mirrored() == dataclasses.replace(law, offset=-0.2)
    assert law.effect == StribeckEffect(velocity=0.1, shape="exponential")
    assert law.breakaway() == (2.0, 2.0)
    assert COULOMB.mirrored() == COULOMB
    assert COULOMB.breakaway() == (1.0, 1.0)  # the Coulomb friction, if no other is given


@pytest.mark.parametrize("law", [DAHL, LUGRE, PLASTIC], ids=lambda law: type(law).__name__)
def test_steady_friction_of_bristles_is_that_of_sliding(law):
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
    assert not dataclasses.replace(edge, sliding=WEAKER).passive


@pytest.mark.parametrize(
    ("law", "change", "code"),
    [
        (UNEVEN, {"coulomb_friction_positive": -1.0}, "negative"),
        (UNEVEN, {"viscous_friction_negative": -0.1}, "negative"),
        (UNEVEN, {"static_friction_positive": 0.5}, "static_below_coulomb"),
        (UNEVEN, {"offset": np.nan}, "not_finite"),
        (UNEVEN, {"coulomb_friction_negative": np.inf}, "not_finite"),
        (STRIBECK, {"stribeck_velocity": 0.0}, "not_positive"),
        (STRIBECK, {"stribeck_velocity": np.nan}, "not_finite"),
        (STRIBECK, {"static_friction_positive": 0.5}, "static_below_coulomb"),
        (DAHL, {"bristle_stiffness": 0.0}, "not_positive"),
        (DAHL, {"exponent": 0.5}, "out_of_range"),
        (DAHL, {"exponent": np.nan}, "out_of_range"),
        (
            DAHL,
            {"sliding": dataclasses.replace(COULOMB, static_friction_negative=2.0)},
            "dahl_with_peak",
        ),
        (
            DAHL,
            {"sliding": dataclasses.replace(COULOMB, coulomb_friction_positive=0.0)},
            "no_coulomb_under_bristles",
        ),
        (LUGRE, {"bristle_damping": -1.0}, "negative"),
        (PLASTIC, {"elastic_deflection": 0.0}, "not_positive"),
        (PLASTIC, {"elastic_deflection": 8e-6}, "bristles_bend_less"),
    ],
)
def test_rejects_unphysical_values(law, change, code):
    with refuses(code):
        dataclasses.replace(law, **change)


@pytest.mark.usefixtures("without_shape_checks")
def test_rejects_an_unknown_shape():
    with refuses("not_a_choice", value="lorentzian"):
        dataclasses.replace(STRIBECK, shape="lorentzian")
