"""Controllers, sample by sample: PD, notch, compensation of friction, and pulses."""

from stickslip.control.dither import Dither
from stickslip.control.exact_pulse import ExactPulseController
from stickslip.control.feedback import FeedbackController
from stickslip.control.friction_compensation import FrictionCompensation
from stickslip.control.landing import (
    AxisLandingController,
    AxisLandingState,
    Flight,
    LandingController,
    LandingState,
    Phase,
    Supervisor,
    SupervisorState,
    scaled_notch,
    scaled_pd,
)
from stickslip.control.notch import Notch, NotchCoefficients
from stickslip.control.online_friction import (
    OnlineEstimator,
    OnlineFriction,
    RunningEstimator,
)
from stickslip.control.pd import PD
from stickslip.control.pid import PIDController
from stickslip.control.pulse_amplitude_width import PulseAmplitudeWidthController
from stickslip.control.pulse_controller import PulseController
from stickslip.control.pulse_width import PulseWidthController
from stickslip.control.reference import Move, PointToPoint, Reference
from stickslip.control.reset_integral import ResetIntegral
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
