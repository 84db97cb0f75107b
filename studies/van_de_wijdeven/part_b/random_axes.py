"""Random axes around the one of the source's Table 1, and the values that a controller is given."""

from dataclasses import dataclass
from math import sqrt

import numpy as np

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import quantity_field
from studies.van_de_wijdeven.part_b.setting import COULOMB_FRICTION, MASS, VISCOUS_FRICTION

_FACTOR = 2.0
"""Mass, Coulomb and viscous friction lie between Table 1 over this and times this [-]."""
_STATIC = (1.05, 1.5)
"""Static over Coulomb friction, in each direction [-]."""
_ASYMMETRY = 0.2
"""Friction of either direction is within this part of the mean of both [-]."""
_OFFSET = 0.2
"""Offset, either sign, at most this times the Coulomb friction [-]."""
_EFFORT_LIMIT = 3.0
"""Over the Coulomb friction [-]."""
_MASS_ERROR = 0.05
_FRICTION_ERROR = 0.5
"""Largest error of a guessed friction, over the truth [-]."""
_START_ERROR = (0.5e-3, 20e-3)
"""Distance from the target at the start, either sign [m]."""

ENCODER_STEP = 1e-6
"""[m]."""
POSITION_NOISE = 1e-6
"""Standard deviation [m]."""
SAMPLE_NOISE = sqrt(POSITION_NOISE**2 + ENCODER_STEP**2 / 12.0)
"""Standard deviation of a measured position, its rounding included [m]."""


@dataclass(frozen=True, kw_only=True)
class RandomAxis:
    """An axis, and the guess of a controller."""

    plant: SingleMass  #: The truth.
    guessed_mass: float = quantity_field("mass")  #: [kg].
    #: First guesses: of Coulomb, static and viscous friction, the same in both directions; of the
    #: offset, nothing.
    guessed_friction: CoulombViscousFriction
    start_error: float = quantity_field("position")  #: Target less position at the start [m].
    effort_limit: float = quantity_field("effort")  #: Largest magnitude of the effort [N].
    seed: int  #: Of the sensors' noise.


def _around(generator: np.random.Generator, value: float) -> float:
    """Draw a value within a factor around another, its logarithm uniform."""
    return value * _FACTOR ** generator.uniform(-1.0, 1.0)


def _guess(generator: np.random.Generator, value: float, error: float) -> float:
    return value * (1.0 + generator.uniform(-error, error))


def _random_axis(generator: np.random.Generator) -> RandomAxis:
    mass, coulomb, viscous = (
        _around(generator, value) for value in (MASS, COULOMB_FRICTION, VISCOUS_FRICTION)
    )
    uneven_coulomb, uneven_viscous = generator.uniform(-_ASYMMETRY, _ASYMMETRY, 2)
    lowest, highest = _STATIC
    while True:  # until the static friction of each direction is in the range of that direction
        static = coulomb * generator.uniform(lowest, highest)
        uneven_static = generator.uniform(-_ASYMMETRY, _ASYMMETRY)
        positive = static * (1.0 + uneven_static) / (coulomb * (1.0 + uneven_coulomb))
        negative = static * (1.0 - uneven_static) / (coulomb * (1.0 - uneven_coulomb))
        if lowest <= positive <= highest and lowest <= negative <= highest:
            break
    law = CoulombViscousFriction(
        coulomb_friction_positive=coulomb * (1.0 + uneven_coulomb),
        coulomb_friction_negative=coulomb * (1.0 - uneven_coulomb),
        static_friction_positive=static * (1.0 + uneven_static),
        static_friction_negative=static * (1.0 - uneven_static),
        viscous_friction_positive=viscous * (1.0 + uneven_viscous),
        viscous_friction_negative=viscous * (1.0 - uneven_viscous),
        offset=coulomb * generator.uniform(-_OFFSET, _OFFSET),
    )
    guessed_mass = _guess(generator, mass, _MASS_ERROR)
    guessed_coulomb = _guess(generator, coulomb, _FRICTION_ERROR)
    guessed_static = _guess(generator, static, _FRICTION_ERROR)
    guessed = CoulombViscousFriction.symmetric(
        coulomb_friction=guessed_coulomb,
        viscous_friction=_guess(generator, viscous, _FRICTION_ERROR),
        static_friction=max(guessed_static, guessed_coulomb),  # nobody guesses it to be less
    )
    sign = 1.0 if generator.uniform() < 0.5 else -1.0
    return RandomAxis(
        plant=SingleMass(mass=mass, friction=law),
        guessed_mass=guessed_mass,
        guessed_friction=guessed,
        start_error=sign * generator.uniform(*_START_ERROR),
        effort_limit=_EFFORT_LIMIT * coulomb,
        seed=int(generator.integers(2**63)),
    )


def random_axes(generator: np.random.Generator, n: int) -> list[RandomAxis]:
    """Draw axes; the first of them do not depend on how many are drawn.

    Mass, Coulomb and viscous friction are within a factor 2 of Table 1 (the logarithm is uniform),
    static friction is 1.05 to 1.5 times the Coulomb friction of the same direction, the friction of
    either direction is within 20 % of the mean of both (Coulomb, static and viscous each by a part
    of its own), the offset within 0.2 of the mean Coulomb friction; the effort limit is 3 times
    that. The mass is guessed within 5 %, each friction within 50 % of its mean. The start is 0.5 to
    20 mm off the target. All these are uniform by default.
    """
    return [_random_axis(generator) for _ in range(n)]
