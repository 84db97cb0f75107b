"""Controllers, sample by sample: PD, notch, compensation of friction, and what they follow."""

from stickslip.control.feedback import FeedbackController
from stickslip.control.friction_compensation import FrictionCompensation
from stickslip.control.notch import Notch, NotchCoefficients
from stickslip.control.online_friction import OnlineEstimator, OnlineFriction
from stickslip.control.pd import PD
from stickslip.control.reference import Move, PointToPoint, Reference

__all__ = [
    "PD",
    "FeedbackController",
    "FrictionCompensation",
    "Move",
    "Notch",
    "NotchCoefficients",
    "OnlineEstimator",
    "OnlineFriction",
    "PointToPoint",
    "Reference",
]
