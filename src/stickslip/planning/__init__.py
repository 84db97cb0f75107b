"""Which pulse moves a mass how far, and which pulses bring a flexible arm to rest."""

from stickslip.planning.arm_motion import forward_motion
from stickslip.planning.pulse_law import PulseLaw
from stickslip.planning.pulse_series import NoPulseSeriesError, PulseSeries, SeriesLimit
from stickslip.planning.series_planner import PulseSeriesPlanner

__all__ = [
    "NoPulseSeriesError",
    "PulseLaw",
    "PulseSeries",
    "PulseSeriesPlanner",
    "SeriesLimit",
    "forward_motion",
]
