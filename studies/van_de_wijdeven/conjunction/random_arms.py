"""Random flexible arms around the one of the reference points, and what is guessed of them."""

from dataclasses import dataclass

import numpy as np

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm
from stickslip.records import quantity_field

SAMPLING_TIME = 0.02
"""[s]: the fastest arm swings with 3 rad/s on a held mass 1 and 4.2 rad/s on a free one, at which
75 samples make a period."""

EFFORT_LIMIT = 1.0
"""[N]: 2.6 times what the most sticking of these arms takes to break away, so that each can be
moved; a move of 1 m takes the heaviest 6 to 12 s at least, as its spring and its friction are."""

_MASS = 1.0  # of either mass [kg]
_STIFFNESS = 1.0  # [N/m]
_COULOMB = 0.1  # [N]
_VISCOUS = 0.1  # [N s/m]
_FACTOR = 3.0
"""All of these lie between their middle over this and times this [-]."""
_STATIC = (1.0, 1.3)
"""Static over Coulomb friction [-]."""
_GUESS_ERROR = 0.5
"""Largest error of a guessed friction, over the truth [-]."""
_GUESSED = 0.5
"""Share of the arms of which a friction is guessed [-]."""
_MOVE = (0.7, 1.3)
"""Length of a move [m]."""
_MOVES = 2
"""Moves of each arm, one after the other."""


@dataclass(frozen=True, kw_only=True)
class RandomArm:
    """An arm at rest at 0, its target, and the guess of a controller."""

    arm: FlexibleArm  #: The truth.
    guessed_friction: CoulombViscousFriction | None  #: First guess of its friction, or None.
    targets: tuple[float, ...]  #: Where it shall land, one after the other [m].
    effort_limit: float = quantity_field("effort")  #: Largest magnitude of the effort [N].
    seed: int  #: Of the sensors' noise, and of what else is drawn for this arm.

    @property
    def ways(self) -> tuple[float, ...]:
        """Length of each move [m]."""
        return tuple(
            abs(target - start)
            for start, target in zip((0.0, *self.targets), self.targets, strict=False)
        )


def _around(generator: np.random.Generator, value: float) -> float:
    """Draw a value within a factor around another, its logarithm uniform."""
    return value * _FACTOR ** generator.uniform(-1.0, 1.0)


def _random_arm(generator: np.random.Generator) -> RandomArm:
    mass_1, mass_2, stiffness, coulomb, viscous = (
        _around(generator, value) for value in (_MASS, _MASS, _STIFFNESS, _COULOMB, _VISCOUS)
    )
    static = coulomb * generator.uniform(*_STATIC)
    wrong = 1.0 + generator.uniform(-_GUESS_ERROR, _GUESS_ERROR, 3)
    guess = CoulombViscousFriction.symmetric(
        coulomb_friction=coulomb * wrong[0],
        viscous_friction=viscous * wrong[1],
        static_friction=max(static * wrong[2], coulomb * wrong[0]),  # nobody guesses it to be less
    )
    guessed = generator.uniform() < _GUESSED
    ways = np.where(generator.uniform(size=_MOVES) < 0.5, -1.0, 1.0)
    places = np.cumsum(ways * generator.uniform(*_MOVE, _MOVES))
    return RandomArm(
        arm=FlexibleArm(
            mass_1=mass_1,
            mass_2=mass_2,
            stiffness=stiffness,
            friction=CoulombViscousFriction.symmetric(
                coulomb_friction=coulomb, viscous_friction=viscous, static_friction=static
            ),
        ),
        guessed_friction=guess if guessed else None,
        targets=tuple(places.tolist()),
        effort_limit=EFFORT_LIMIT,
        seed=int(generator.integers(2**63)),
    )


def random_arms(generator: np.random.Generator, n: int) -> list[RandomArm]:
    """Draw arms; the first of them do not depend on how many are drawn.

    Masses, spring, Coulomb and viscous friction are within a factor 3 of 1 kg, 1 kg, 1 N/m, 0.1 N
    and 0.1 N s/m (the logarithm is uniform), static friction is 1 to 1.3 times the Coulomb friction
    (uniform). Of half of the arms nothing is guessed of friction, of the others a Coulomb, a
    viscous and a static friction that are each wrong by up to 50 % (uniform). Two moves of 0.7 to
    1.3 m follow each other, either of them either way.
    """
    return [_random_arm(generator) for _ in range(n)]
