"""Landings: feedback near the target while friction is learned, then pulses that end at rest."""

from stickslip.control.landing.arm import LandingController, scaled_notch, scaled_pd
from stickslip.control.landing.arm_plan import Flight, LandingState, PlanAnswer, PlanRequest
from stickslip.control.landing.axis import AxisLandingController, AxisLandingState
from stickslip.control.landing.beside import PlannedBeside, TrackedBeside
from stickslip.control.landing.supervisor import Supervisor, SupervisorState
from stickslip.control.landing.tracked.controller import TrackedLandingController
from stickslip.control.landing.tracked.state import TrackedState

__all__ = [
    "AxisLandingController",
    "AxisLandingState",
    "Flight",
    "LandingController",
    "LandingState",
    "PlanAnswer",
    "PlanRequest",
    "PlannedBeside",
    "Supervisor",
    "SupervisorState",
    "TrackedBeside",
    "TrackedLandingController",
    "TrackedState",
    "scaled_notch",
    "scaled_pd",
]
