"""Poles of tracking: their bounds, and the effort of simulated noise."""

from math import inf

import numpy as np
import pytest

from stickslip.control.landing.tracked.poles import feedback_poles
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm

T, LIMIT = 1e-3, 2.0
LAW = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)
ARM = FlexibleArm(mass_1=1.0, mass_2=0.5, stiffness=2.0, friction=LAW)
STIFF = FlexibleArm(mass_1=1.0, mass_2=0.5, stiffness=2e4, friction=LAW)


def poles(arm: FlexibleArm, noise: tuple[float, float], delay: float = 0.0) -> tuple[float, float]:
    return feedback_poles(arm, sampling_time=T, noise=noise, effort_limit=LIMIT, delay=delay)


def test_the_resonance_or_the_delay_bounds_it() -> None:
    assert poles(ARM, (0.0, 0.0)) == (pytest.approx(12.0 * np.sqrt(6.0)), inf)
    assert poles(STIFF, (0.0, 0.0), delay=3.5) == (pytest.approx(0.1 / T), inf)
    assert poles(STIFF, (0.0, 0.0))[0] == pytest.approx(5.0 / 1.5 * 0.1 / T)


@pytest.mark.parametrize("differences", [False, True])
def test_noise_takes_a_tenth_of_the_effort_at_most(differences: bool) -> None:
    generator, n = np.random.default_rng(3), 40000
    position = 1e-6 * generator.normal(size=n + 1)
    noise = (1e-6, np.sqrt(2.0) * 1e-6 / T) if differences else (0.0, 0.2)
    velocity = np.diff(position) / T if differences else 0.2 * generator.normal(size=n)
    if differences:  # of an encoder so coarse that the filter is needed
        position, velocity, noise = 2e3 * position, 2e3 * velocity, (2e-3, 2e3 * noise[1])
    pole, filtering = poles(STIFF, noise)
    share, filtered = 1.0 - np.exp(-filtering * T), np.zeros(n)
    for k in range(1, n):
        filtered[k] = filtered[k - 1] + share * (velocity[k] - filtered[k - 1])
    of_position = position[1:] if differences else np.zeros(n)
    # The bound takes the errors of position and velocity for independent
    effort = np.hypot(2.0 * pole * np.std(filtered), pole**2 * np.std(of_position)) * STIFF.mass_1
    assert 0.85 * 0.1 * LIMIT < effort < 1.05 * 0.1 * LIMIT
