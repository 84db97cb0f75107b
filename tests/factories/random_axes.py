"""Random rigid axes with uneven friction, and the wrong values a controller gets of them."""

from dataclasses import dataclass

import numpy as np
from laws import uneven

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass

# Nominal axis: 150 kg, 100 N Coulomb and 700 N s/m viscous friction
NOMINAL = (150.0, 100.0, 700.0)
ENCODER_STEP = 1e-6  # [m]
POSITION_NOISE = 1e-6  # standard deviation [m]
LEAST_STATIC, MOST_STATIC = 1.05, 1.5  # static over Coulomb friction, in each direction [-]
UNEVEN = 0.2  # largest deviation of one direction from the mean of both, and offset [-]


@dataclass(frozen=True, kw_only=True)
class RandomAxis:
    """The true axis, and the first guesses, start, limit and seed of a test with it."""

    plant: SingleMass
    guessed_mass: float
    guessed_friction: CoulombViscousFriction
    start_error: float
    effort_limit: float
    seed: int


def random_axes(generator: np.random.Generator, n: int) -> list[RandomAxis]:
    """Draw axes; the first of them do not depend on how many are drawn.

    Mass, Coulomb and viscous friction lie within a factor of 2 of the nominal axis, their
    logarithms uniform. Everything else is uniform: the static friction of a direction is 1.05 to
    1.5 times its Coulomb friction, a direction deviates by up to 20 % from the mean of both, the
    offset is up to 0.2 of the mean Coulomb friction. The mass is guessed within 5 %, each friction
    within 50 %, equal in both directions. The start is 0.5 to 20 mm off the target; the effort
    limit is three times the mean Coulomb friction.
    """
    return [_random_axis(generator) for _ in range(n)]


def _random_axis(generator: np.random.Generator) -> RandomAxis:
    mass, coulomb, viscous = (value * 2.0 ** generator.uniform(-1.0, 1.0) for value in NOMINAL)
    coulomb_uneven, viscous_uneven = generator.uniform(-UNEVEN, UNEVEN, 2)
    coulombs = coulomb * (1.0 + coulomb_uneven), coulomb * (1.0 - coulomb_uneven)
    while True:  # until the static friction of both directions is within its range
        static = coulomb * generator.uniform(LEAST_STATIC, MOST_STATIC)
        static_uneven = generator.uniform(-UNEVEN, UNEVEN)
        statics = static * (1.0 + static_uneven), static * (1.0 - static_uneven)
        ratios = [high / low for high, low in zip(statics, coulombs, strict=True)]
        if all(LEAST_STATIC <= ratio <= MOST_STATIC for ratio in ratios):
            break
    law = uneven(
        coulomb=coulombs,
        static=statics,
        viscous=(viscous * (1.0 + viscous_uneven), viscous * (1.0 - viscous_uneven)),
        offset=coulomb * generator.uniform(-UNEVEN, UNEVEN),
    )
    guessed_mass = mass * (1.0 + generator.uniform(-0.05, 0.05))
    guesses = [value * (1.0 + generator.uniform(-0.5, 0.5)) for value in (coulomb, static, viscous)]
    direction = 1.0 if generator.uniform() < 0.5 else -1.0
    return RandomAxis(
        plant=SingleMass(mass=mass, friction=law),
        guessed_mass=guessed_mass,
        guessed_friction=CoulombViscousFriction.symmetric(
            coulomb_friction=guesses[0],
            static_friction=max(guesses[0], guesses[1]),
            viscous_friction=guesses[2],
        ),
        start_error=direction * generator.uniform(0.5e-3, 20e-3),
        effort_limit=3.0 * coulomb,
        seed=int(generator.integers(2**63)),
    )
