"""What the sensors of an axis show at one instant."""

from typing import NamedTuple

__all__ = ["SensorSample"]


class SensorSample(NamedTuple):
    """What a controller sees at a sample instant: sensor values, in SI units; never the truth.

    A channel without a sensor is NaN.
    """

    time: float
    measured_position: float
    measured_velocity: float
    measured_load_position: float
    measured_load_velocity: float
