"""Landings: feedback near the target while friction is learned, then pulses that end at rest."""

from stickslip.control.landing.approach import scaled_notch, scaled_pd
from stickslip.control.landing.arm import LandingController
from stickslip.control.landing.axis import AxisLandingController
from stickslip.control.landing.state import (
    AxisLandingState,
    Flight,
    LandingState,
    SupervisorState,
)
from stickslip.control.landing.supervisor import Supervisor

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
