"""Both sides of breakaway and of a stop at the end of a sample, for a single mass."""

import numpy as np
import pytest

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.simulation import simulate

STATIC, OFFSET = 1.5, 0.25  # exact in binary


def _axis(static: float) -> SingleMass:
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=1.0, static_friction=static, viscous_friction=0.0, offset=OFFSET
    )
    return SingleMass(mass=1.0, friction=law)


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(("beyond", "moves"), [(0.0, False), (np.spacing(2.0), True)])
def test_an_effort_equal_to_static_friction_does_not_move_the_mass(direction, beyond, moves):
    effort = OFFSET + direction * (STATIC + beyond)
    motion = simulate(_axis(STATIC), [effort] * 3, sampling_time=1.0, initial_state=(0.0, 0.0))
    assert bool(np.any(motion.position != 0.0)) == moves
    assert np.all(direction * motion.position >= 0.0)


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(
    ("excess", "flagged"), [(-2e-10, False), (-5e-11, True), (5e-11, True), (2e-10, False)]
)
def test_a_stop_at_the_end_of_a_sample_is_flagged(direction, excess, flagged):
    """v(t) = v_0 - t: the mass stops at t = v_0, and 1e-10 of a sample is too close to call."""
    start = (0.0, direction * (1.0 + excess))
    run = {"sampling_time": 1.0, "initial_state": start}
    assert simulate(_axis(STATIC), [OFFSET] * 2, **run).any_grazing == flagged
    # Without static friction above Coulomb friction, rest and motion have the same outcome
    assert not simulate(_axis(1.0), [OFFSET] * 2, **run).any_grazing
