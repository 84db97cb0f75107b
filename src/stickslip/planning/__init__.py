"""Which pulse moves a mass how far, and which pulses bring a flexible arm to rest."""

from stickslip.planning.pulse_law import PulseLaw
from stickslip.planning.series.arm_motion import forward_motion
from stickslip.planning.series.planner import PulseSeriesPlanner
from stickslip.planning.series.pulse_series import NoPulseSeriesError, PulseSeries, SeriesLimit

__all__ = [
    "NoPulseSeriesError",
    "PulseLaw",
    "PulseSeries",
    "PulseSeriesPlanner",
    "SeriesLimit",
    "forward_motion",
]
