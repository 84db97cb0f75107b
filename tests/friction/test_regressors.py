import numpy as np
import pytest
from refusals import refuses
from scipy.integrate import quad

from stickslip.friction import (
    CoulombViscousFriction,
    FrictionTerms,
    StribeckEffect,
    StribeckFriction,
)

EFFECT = StribeckEffect(velocity=0.1)
LAW = StribeckFriction(
    coulomb_friction_positive=1.0,
    coulomb_friction_negative=2.0,
    static_friction_positive=1.5,
    static_friction_negative=3.0,
    viscous_friction_positive=0.1,
    viscous_friction_negative=0.2,
    stribeck_velocity=0.1,
)
VELOCITY = np.linspace(-0.4, 0.4, 20)
SIMPSON = 3e-5  # of Simpson's rule where the velocity changes by a tenth of the Stribeck velocity


def test_force_columns_times_parameters_is_the_law():
    terms = FrictionTerms.asked(per_direction=True, offset=None, stribeck=EFFECT)
    values = np.array([getattr(LAW, name) for name in terms.names])
    columns = terms.force_columns(VELOCITY, np.sign(VELOCITY))
    np.testing.assert_allclose(columns @ values, LAW.friction(VELOCITY), rtol=1e-14)


def test_force_columns_without_the_effect_are_those_of_coulomb_and_viscous_friction():
    terms = FrictionTerms.asked(per_direction=False, offset=None)
    law = CoulombViscousFriction.symmetric(coulomb_friction=1.2, viscous_friction=0.3)
    columns = terms.force_columns(VELOCITY, np.sign(VELOCITY))
    assert terms.names == ("viscous_friction", "coulomb_friction", "offset")
    friction = columns @ [0.3, 1.2, 0.7]
    np.testing.assert_allclose(friction, law.friction(VELOCITY) + 0.7, rtol=1e-14)


@pytest.mark.parametrize("shape", ["gaussian", "exponential"])
def test_energy_columns_are_the_integrals_of_the_force_over_the_way(shape):
    effect = StribeckEffect(velocity=0.1, shape=shape)
    terms = FrictionTerms.asked(per_direction=False, offset=True, stribeck=effect)
    v, T = np.linspace(0.01, 0.3, 30), 0.1
    before, after = v[:-1], v[1:]
    way = 0.5 * T * (before + after)
    squared = T * (before**2 + before * after + after**2) / 3
    found = terms.energy_columns(squared, way, way, np.ones(29), v)
    values = {"viscous_friction": 0.1, "coulomb_friction": 1.0, "static_friction": 1.6}
    law = StribeckFriction.symmetric(**values, stribeck_velocity=0.1, shape=shape)
    for k in range(29):
        slope = (after[k] - before[k]) / T

        def power(t: float, start: float = float(before[k]), rise: float = float(slope)) -> float:
            speed = start + rise * t
            return (law.friction([speed])[0] + 0.2) * speed

        lost = found[k] @ [*values.values(), 0.2]
        assert lost == pytest.approx(quad(power, 0.0, T)[0], rel=SIMPSON)


def test_mean_share_over_a_rest_is_whole():
    rest = np.zeros(3)
    np.testing.assert_array_equal(EFFECT.mean_left(rest, rest), 1.0)


def test_several_effects_have_steps_of_their_own():
    effects = (EFFECT, StribeckEffect(velocity=0.2))
    terms = FrictionTerms.asked(per_direction=False, offset=False, stribeck=effects)
    assert terms.names == ("viscous_friction", "coulomb_friction", "step_0", "step_1")
    columns = terms.force_columns(VELOCITY, np.sign(VELOCITY))
    np.testing.assert_array_equal(columns[:, 1], np.sign(VELOCITY))
    np.testing.assert_array_equal(columns[:, 3], np.sign(VELOCITY) * effects[1].left(VELOCITY))


def test_refuses_an_offset_with_friction_per_direction():
    with refuses("offset_and_directions"):
        FrictionTerms(per_direction=True, offset=True)
