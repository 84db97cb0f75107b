"""Controllers, sample by sample: PD, notch, compensation of friction, and pulses."""

from stickslip.control.base import Phase, PositionController
from stickslip.control.feedback.controller import FeedbackController
from stickslip.control.feedback.friction_compensation import (
    FrictionCompensation,
    OnlineEstimator,
    OnlineFriction,
    RunningEstimator,
)
from stickslip.control.feedback.linear_parts import PD, Notch, NotchCoefficients
from stickslip.control.feedback.pid import Dither, PIDController, ResetIntegral
from stickslip.control.feedback.profile import ProfileController
from stickslip.control.feedback.reference import Move, PointToPoint, Reference
from stickslip.control.guards import GuardedController, GuardedState, Limits, SensorErrors
from stickslip.control.hardware.loop import (
    AxisIO,
    Clock,
    LoopEnding,
    LoopRun,
    LoopSettings,
    Playback,
    RealTimeClock,
    run,
)
from stickslip.control.hardware.recording import Recording
from stickslip.control.landing import (
    AxisLandingController,
    AxisLandingState,
    Flight,
    LandingController,
    LandingState,
    PlanAnswer,
    PlannedBeside,
    PlanRequest,
    Supervisor,
    SupervisorState,
    TrackedBeside,
    TrackedLandingController,
    scaled_notch,
    scaled_pd,
)
from stickslip.control.precise.controller import PreciseController
from stickslip.control.pulses.controller import PulseController
from stickslip.control.pulses.exact import ExactPulseController
from stickslip.control.pulses.published import (
    PulseAmplitudeWidthController,
    PulseWidthController,
)
from stickslip.control.rest_detection import RestDetection

__all__ = [
    "PD",
    "AxisIO",
    "AxisLandingController",
    "AxisLandingState",
    "Clock",
    "Dither",
    "ExactPulseController",
    "FeedbackController",
    "Flight",
    "FrictionCompensation",
    "GuardedController",
    "GuardedState",
    "LandingController",
    "LandingState",
    "Limits",
    "LoopEnding",
    "LoopRun",
    "LoopSettings",
    "Move",
    "Notch",
    "NotchCoefficients",
    "OnlineEstimator",
    "OnlineFriction",
    "PIDController",
    "Phase",
    "PlanAnswer",
    "PlanRequest",
    "PlannedBeside",
    "Playback",
    "PointToPoint",
    "PositionController",
    "PreciseController",
    "ProfileController",
    "PulseAmplitudeWidthController",
    "PulseController",
    "PulseWidthController",
    "RealTimeClock",
    "Recording",
    "Reference",
    "ResetIntegral",
    "RestDetection",
    "RunningEstimator",
    "SensorErrors",
    "Supervisor",
    "SupervisorState",
    "TrackedBeside",
    "TrackedLandingController",
    "run",
    "scaled_notch",
    "scaled_pd",
]
