"""Displacement of a mass by a pulse, and pulses that bring a flexible arm to rest."""

from stickslip.planning.arm_motion import forward_motion
from stickslip.planning.pulse_law import PulseLaw
from stickslip.planning.series import (
    NoPulseSeriesError,
    PulseSeries,
    PulseSeriesPlanner,
    SeriesLimit,
)

__all__ = [
    "NoPulseSeriesError",
    "PulseLaw",
    "PulseSeries",
    "PulseSeriesPlanner",
    "SeriesLimit",
    "forward_motion",
]
