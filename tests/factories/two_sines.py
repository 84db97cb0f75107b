"""Logs of a smooth motion in closed form, whose effort has further terms and white noise."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from axis_logs import axis_log
from jaxtyping import Float

from stickslip.records import AxisLog

TIME = np.arange(0.0, 20.0, 1e-3)
MIDDLE = TIME + 0.5e-3  # the effort of a sample is held until the next


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Two sines in closed form, of 0.32 and 0.8 Hz unless other rates are given."""

    time: Float[np.ndarray, " n"]  # [s]
    rates: tuple[float, float] = (2.0, 5.0)  # [rad/s]
    sizes: tuple[float, float] = (0.1, 0.05)  # of the velocity [m/s]
    phases: tuple[float, float] = (0.0, 0.0)  # [rad]

    def _angles(self) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
        (slow, fast), (first, second) = self.rates, self.phases
        return slow * self.time + first, fast * self.time + second

    @property
    def velocity(self) -> Float[np.ndarray, " n"]:
        (large, small), (slow, fast) = self.sizes, self._angles()
        return large * np.sin(slow) + small * np.sin(fast)

    @property
    def position(self) -> Float[np.ndarray, " n"]:
        large, small = (size / rate for size, rate in zip(self.sizes, self.rates, strict=True))
        slow, fast = self._angles()
        return -large * np.cos(slow) - small * np.cos(fast)

    @property
    def acceleration(self) -> Float[np.ndarray, " n"]:
        large, small = (size * rate for size, rate in zip(self.sizes, self.rates, strict=True))
        slow, fast = self._angles()
        return large * np.cos(slow) + small * np.cos(fast)

    def effort(
        self, *, mass: float = 3.0, viscous: float = 4.0, coulomb: float = 1.5, offset: float = 0.0
    ) -> Float[np.ndarray, " n"]:
        """Return the effort that moves a mass with friction like this [N]."""
        velocity = self.velocity
        friction = coulomb * np.sign(velocity) + viscous * velocity
        return mass * self.acceleration + friction + offset


Extra = Callable[[Motion], Float[np.ndarray, " n"]]

TRUTH = {"mass": 3.0, "viscous_friction": 4.0, "coulomb_friction": 1.5, "offset": 0.2}


def plain_effort(motion: Motion) -> Float[np.ndarray, " n"]:
    """Return the effort of `TRUTH`."""
    return motion.effort(offset=0.2)


def ramp(motion: Motion) -> Float[np.ndarray, " n"]:
    return motion.time - 10.0


EXTRAS: dict[str, Extra] = {
    "spring": lambda m: 20.0 * m.position,
    "direction": lambda m: 0.6 * np.abs(m.velocity),
    "quadratic": lambda m: 30.0 * m.velocity * np.abs(m.velocity),
    "friction drift": lambda m: -0.01 * (1.5 * np.sign(m.velocity) + 4.0 * m.velocity) * ramp(m),
    "viscous drift": lambda m: -0.2 * m.velocity * ramp(m),
    "offset drift": lambda m: 0.01 * ramp(m),
    "gain drift": lambda m: plain_effort(m) * (1.0 / (1.0 + 0.01 * ramp(m)) - 1.0),
    "dead band": lambda m: 0.3 * np.sign(plain_effort(m)),
    "stribeck": lambda m: 0.8 * np.sign(m.velocity) * np.exp(-((m.velocity / 0.02) ** 2)),
    "low speed": lambda m: -0.6 * np.sign(m.velocity) * np.exp(-((m.velocity / 0.02) ** 2)),
    "ripple": lambda m: 0.2 * np.sin(2.0 * np.pi * m.position / 0.015),
}
"""Further efforts, by the term that each is."""


def log_of(
    extra: Extra = lambda motion: np.zeros(motion.time.size),
    *,
    delay: float = 0.0,
    noise: float = 0.02,
    seed: int = 1,
) -> AxisLog:
    """Return a log whose effort has white noise; it acts ``delay`` later than it is logged."""
    acts = Motion(time=MIDDLE + delay)
    rng = np.random.default_rng(seed)
    return axis_log(
        TIME,
        plain_effort(acts) + extra(acts) + noise * rng.standard_normal(TIME.size),
        Motion(time=TIME).position,
        name="stage",
    )
