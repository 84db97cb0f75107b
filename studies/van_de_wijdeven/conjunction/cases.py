"""Cases of the controllers: sensors, and errors of guessed masses and springs."""

from dataclasses import dataclass, replace

import numpy as np

from stickslip.plants import FlexibleArm
from stickslip.records import quantity_field
from stickslip.simulation import Sensors
from studies.van_de_wijdeven.conjunction.random_arms import RandomArm

BOUND = 1e-5
"""Both masses are to stay within this part of the move of their target, without noise [-]."""
_NOISE_BOUND = 3.0
"""And with noise, within so many standard deviations of a measured position [-]."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """Under which conditions arms are to land."""

    name: str  #: In words.
    #: Standard deviations of one sample of either mass.
    position_noise: float = quantity_field("position", default=0.0)
    velocity_noise: float = quantity_field("velocity", default=0.0)
    #: By which part of the truth both masses and the spring are guessed wrong [-].
    parameter_error: float = 0.0

    def bound(self, move: float) -> float:
        """Return the distance of the target within which both masses are to stay [m]."""
        return max(BOUND * move, _NOISE_BOUND * self.position_noise)

    def sensors(self) -> Sensors:
        """Return the sensors."""
        return Sensors(position_noise=self.position_noise, velocity_noise=self.velocity_noise)

    def guessed(self, arm: RandomArm) -> FlexibleArm:
        """Return the arm with masses and spring as they are guessed; its friction is the truth.

        Each is too large or too small by the error, as the seed of the arm has it.
        """
        generator = np.random.default_rng((arm.seed, 1))  # not that of the noise
        wrong = 1.0 + self.parameter_error * generator.choice((-1.0, 1.0), 3)
        true = arm.arm
        return replace(
            true,
            mass_1=true.mass_1 * wrong[0],
            mass_2=true.mass_2 * wrong[1],
            stiffness=true.stiffness * wrong[2],
        )


def _wrong(error: float) -> Case:
    return Case(name=f"masses and spring wrong by {100 * error:g} %", parameter_error=error)


EXACT = Case(name="no noise")
NOISY = Case(name="noise of 1e-4 m and 1e-3 m/s", position_noise=1e-4, velocity_noise=1e-3)
WRONG = _wrong(0.02)
CASES = (EXACT, NOISY, WRONG, _wrong(0.05))
