"""How the second mass of an arm swings while the first rests."""

from dataclasses import dataclass
from math import cos, hypot, sin, sqrt

import numpy as np
from jaxtyping import Float

from stickslip.plants import FlexibleArm
from stickslip.records import quantity_field

__all__ = ["Swing"]

_TINY = 1e-12  # of the frequency: a weight for sensors without noise


@dataclass(frozen=True, kw_only=True)
class Swing:
    """Where mass 1 rests, and how mass 2 swings about that place.

    Attributes
    ----------
    position
        Of mass 1.
    offset, velocity
        Of mass 2 now: its position less that of mass 1, and its velocity.
    frequency
        Of its swing, sqrt(k/m2) [rad/s].
    """

    position: float = quantity_field("position")
    offset: float = quantity_field("position")
    velocity: float = quantity_field("velocity")
    frequency: float

    @classmethod
    def seen(
        cls,
        samples: Float[np.ndarray, "n 3"],
        *,
        arm: FlexibleArm,
        sampling_time: float,
        position_noise: float,
        velocity_noise: float,
    ) -> "Swing":
        """Fit a swing of the arm's frequency to samples, by weighted least squares.

        While mass 1 rests at x1, x2 = x1 + a cos(w t) + b sin(w t), with t = 0 at the last sample
        (van de Wijdeven 2002 A Eq. 2.3 with x1' = 0).

        Parameters
        ----------
        samples
            Position, load position and load velocity [m or rad, m or rad, m/s or rad/s]; the last
            one is now.
        arm
            With masses and spring as they are believed to be.
        sampling_time
            [s].
        position_noise, velocity_noise
            Standard deviations of a sample [m or rad, m/s or rad/s]; 0 for none.
        """
        w = sqrt(arm.stiffness / arm.mass_2)
        phase = w * sampling_time * np.arange(1 - len(samples), 1)
        x1 = float(samples[:, 0].mean())
        cosine, sine = np.cos(phase), np.sin(phase)
        rows = np.concatenate(
            (np.column_stack((cosine, sine)), w * np.column_stack((-sine, cosine)))
        )
        values = np.concatenate((samples[:, 1] - x1, samples[:, 2]))
        # Only the ratio of the weights counts; without noise all are alike, as lengths
        known = position_noise > 0.0 or velocity_noise > 0.0
        of_position = max(position_noise, _TINY * velocity_noise / w) if known else 1.0
        of_velocity = max(velocity_noise, _TINY * position_noise * w) if known else w
        weight = np.repeat((1.0 / of_position, 1.0 / of_velocity), len(samples))
        a, b = np.linalg.lstsq(rows * weight[:, None], values * weight, rcond=None)[0]
        return cls(position=x1, offset=float(a), velocity=float(w * b), frequency=w)

    @property
    def amplitude(self) -> float:
        """Of the swing [m or rad]."""
        return hypot(self.offset, self.velocity / self.frequency)

    def state(self, later: float = 0.0) -> tuple[float, float, float, float]:
        """Return the arm's state some time from now, if mass 1 goes on to rest.

        Parameters
        ----------
        later
            [s].
        """
        w, turn = self.frequency, self.frequency * later
        offset = self.offset * cos(turn) + self.velocity / w * sin(turn)
        velocity = self.velocity * cos(turn) - self.offset * w * sin(turn)
        return self.position, 0.0, self.position + offset, velocity
