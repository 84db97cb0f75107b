"""Landings: feedback near the target while friction is learned, then pulses that end at rest."""

from stickslip.control.landing.arm import (
    Flight,
    LandingController,
    LandingState,
    scaled_notch,
    scaled_pd,
)
from stickslip.control.landing.axis import AxisLandingController, AxisLandingState
from stickslip.control.landing.supervisor import Supervisor, SupervisorState

__all__ = [
    "AxisLandingController",
    "AxisLandingState",
    "Flight",
    "LandingController",
    "LandingState",
    "Supervisor",
    "SupervisorState",
    "scaled_notch",
    "scaled_pd",
]
