"""Displacement of a mass by a pulse, and pulses that bring a flexible arm to rest."""

from stickslip.planning.arm_motion import NO_LOSSES, LoadLosses, forward_motion
from stickslip.planning.pulse_law import PulseLaw
from stickslip.planning.series import (
    NoPulseSeriesError,
    PulseSeries,
    PulseSeriesPlanner,
    SeriesLimit,
)

__all__ = [
    "NO_LOSSES",
    "LoadLosses",
    "NoPulseSeriesError",
    "PulseLaw",
    "PulseSeries",
    "PulseSeriesPlanner",
    "SeriesLimit",
    "forward_motion",
]
