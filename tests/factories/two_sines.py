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
    """Two sines of 0.32 and 0.8 Hz in closed form, for 20 s at 1 kHz."""

    time: Float[np.ndarray, " n"]

    @property
    def velocity(self) -> Float[np.ndarray, " n"]:
        return 0.1 * np.sin(2.0 * self.time) + 0.05 * np.sin(5.0 * self.time)

    @property
    def position(self) -> Float[np.ndarray, " n"]:
        return -0.05 * np.cos(2.0 * self.time) - 0.01 * np.cos(5.0 * self.time)

    @property
    def acceleration(self) -> Float[np.ndarray, " n"]:
        return 0.2 * np.cos(2.0 * self.time) + 0.25 * np.cos(5.0 * self.time)


Extra = Callable[[Motion], Float[np.ndarray, " n"]]


def plain_effort(motion: Motion) -> Float[np.ndarray, " n"]:
    friction = 1.5 * np.sign(motion.velocity) + 4.0 * motion.velocity
    return 3.0 * motion.acceleration + friction + 0.2


TRUTH = {"mass": 3.0, "viscous_friction": 4.0, "coulomb_friction": 1.5, "offset": 0.2}


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
