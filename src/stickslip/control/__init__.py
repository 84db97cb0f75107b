"""Controllers, sample by sample: PD, notch, compensation of friction, and pulses."""

from stickslip.control.base import Phase, PositionController
from stickslip.control.feedback.controller import FeedbackController
from stickslip.control.feedback.dither import Dither
from stickslip.control.feedback.friction_compensation import FrictionCompensation
from stickslip.control.feedback.notch import Notch, NotchCoefficients
from stickslip.control.feedback.online_friction import (
    OnlineEstimator,
    OnlineFriction,
    RunningEstimator,
)
from stickslip.control.feedback.pd import PD
from stickslip.control.feedback.pid import PIDController
from stickslip.control.feedback.reference import Move, PointToPoint, Reference
from stickslip.control.feedback.reset_integral import ResetIntegral
from stickslip.control.landing import (
    AxisLandingController,
    AxisLandingState,
    Flight,
    LandingController,
    LandingState,
    Supervisor,
    SupervisorState,
    scaled_notch,
    scaled_pd,
)
from stickslip.control.pulses.amplitude_width import PulseAmplitudeWidthController
from stickslip.control.pulses.controller import PulseController
from stickslip.control.pulses.exact import ExactPulseController
from stickslip.control.pulses.width import PulseWidthController
from stickslip.control.rest_detection import RestDetection

__all__ = [
    "PD",
    "AxisLandingController",
    "AxisLandingState",
    "Dither",
    "ExactPulseController",
    "FeedbackController",
    "Flight",
    "FrictionCompensation",
    "LandingController",
    "LandingState",
    "Move",
    "Notch",
    "NotchCoefficients",
    "OnlineEstimator",
    "OnlineFriction",
    "PIDController",
    "Phase",
    "PointToPoint",
    "PositionController",
    "PulseAmplitudeWidthController",
    "PulseController",
    "PulseWidthController",
    "Reference",
    "ResetIntegral",
    "RestDetection",
    "RunningEstimator",
    "Supervisor",
    "SupervisorState",
    "scaled_notch",
    "scaled_pd",
]
