"""The fitted swing of mass 2 against closed forms and another fit."""

from math import hypot, sqrt

import numpy as np
import pytest
from scipy.optimize import curve_fit

from stickslip.control.landing.arm_belief import Swing
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm

T, PLACE, COSINE, SINE = 0.02, 0.7, 0.03, -0.04
ARM = FlexibleArm(
    mass_1=1.3,
    mass_2=2.0,
    stiffness=3.0,
    friction=CoulombViscousFriction.symmetric(coulomb_friction=0.1, viscous_friction=0.1),
)
FREQUENCY = sqrt(3.0 / 2.0)
EXACT = 1e-12  # m; a well posed fit of a few hundred numbers near 1
SAME = 1e-6  # m; of an iterative fit that stops by itself
NOISE = (1e-4, 1e-3)  # m, m/s
SURELY = 4.5  # standard deviations; of 300 numbers one in a thousand trials is beyond


def samples(count: int) -> np.ndarray:
    """Return what ideal sensors show until now, mass 2 swinging about a resting mass 1."""
    turn = FREQUENCY * T * np.arange(1 - count, 1)
    offset = COSINE * np.cos(turn) + SINE * np.sin(turn)
    velocity = FREQUENCY * (SINE * np.cos(turn) - COSINE * np.sin(turn))
    return np.column_stack((np.full(count, PLACE), PLACE + offset, velocity))


def seen(rows: np.ndarray, position_noise: float = 0.0, velocity_noise: float = 0.0) -> Swing:
    return Swing.seen(
        rows,
        arm=ARM,
        sampling_time=T,
        position_noise=position_noise,
        velocity_noise=velocity_noise,
    )


@pytest.mark.parametrize("noise", [(0.0, 0.0), NOISE, (1e-4, 0.0), (0.0, 1e-3)])
@pytest.mark.parametrize("count", [2, 30, 150])
def test_a_swing_without_noise_is_found_as_it_is(count: int, noise: tuple[float, float]) -> None:
    swing = seen(samples(count), *noise)
    assert swing.position == pytest.approx(PLACE, abs=EXACT)
    assert swing.offset == pytest.approx(COSINE, abs=EXACT)
    assert swing.velocity == pytest.approx(FREQUENCY * SINE, abs=EXACT)
    assert swing.amplitude == pytest.approx(hypot(COSINE, SINE), abs=EXACT)


def test_the_state_later_is_that_of_a_free_swing() -> None:
    later = 0.9
    turn = FREQUENCY * later
    x1, v1, x2, v2 = seen(samples(50)).state(later)
    assert (x1, v1) == (pytest.approx(PLACE, abs=EXACT), 0.0)
    assert x2 - x1 == pytest.approx(COSINE * np.cos(turn) + SINE * np.sin(turn), abs=EXACT)
    assert v2 == pytest.approx(FREQUENCY * (SINE * np.cos(turn) - COSINE * np.sin(turn)), abs=EXACT)


def test_noisy_samples_are_weighted_as_another_fit_does() -> None:
    count, (position, velocity) = 157, NOISE
    generator = np.random.default_rng(4)
    rows = samples(count) + generator.normal(size=(count, 3)) * (position, position, velocity)
    x1 = rows[:, 0].mean()

    def model(t: np.ndarray, a: float, b: float) -> np.ndarray:
        angle = FREQUENCY * t[:count]
        return np.concatenate(
            (
                a * np.cos(angle) + b * np.sin(angle),
                FREQUENCY * (b * np.cos(angle) - a * np.sin(angle)),
            )
        )

    t = np.tile(T * np.arange(1 - count, 1), 2)
    (a, b), covariance = curve_fit(
        model,
        t,
        np.concatenate((rows[:, 1] - x1, rows[:, 2])),
        p0=(0.0, 0.0),
        sigma=np.repeat(NOISE, count),
        absolute_sigma=True,
    )
    swing = seen(rows, *NOISE)
    assert swing.offset == pytest.approx(a, abs=SAME)
    assert swing.velocity == pytest.approx(FREQUENCY * b, abs=SAME)
    # The mean place of mass 1 is off as well, and carries into the offset
    spread = sqrt(covariance[0, 0] + position**2 / count)
    assert abs(swing.offset - COSINE) < SURELY * spread
