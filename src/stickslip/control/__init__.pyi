from .base import Phase as Phase, PositionController as PositionController
from .feedback.controller import FeedbackController as FeedbackController
from .feedback.friction_compensation import (
    FrictionCompensation as FrictionCompensation,
    OnlineEstimator as OnlineEstimator,
    OnlineFriction as OnlineFriction,
    RunningEstimator as RunningEstimator,
)
from .feedback.linear_parts import Notch as Notch, NotchCoefficients as NotchCoefficients, PD as PD
from .feedback.pid import (
    Dither as Dither,
    PIDController as PIDController,
    ResetIntegral as ResetIntegral,
)
from .feedback.profile import ProfileController as ProfileController
from .feedback.reference import Move as Move, PointToPoint as PointToPoint, Reference as Reference
from .guards import (
    GuardedController as GuardedController,
    GuardedState as GuardedState,
    Limits as Limits,
    SensorErrors as SensorErrors,
)
from .hardware.loop import (
    AxisIO as AxisIO,
    Clock as Clock,
    LoopEnding as LoopEnding,
    LoopRun as LoopRun,
    LoopSettings as LoopSettings,
    Playback as Playback,
    RealTimeClock as RealTimeClock,
    run as run,
)
from .hardware.recording import Recording as Recording
from .landing.arm import (
    LandingController as LandingController,
    scaled_notch as scaled_notch,
    scaled_pd as scaled_pd,
)
from .landing.arm_plan import (
    Flight as Flight,
    LandingState as LandingState,
    PlanAnswer as PlanAnswer,
    PlanRequest as PlanRequest,
)
from .landing.axis import (
    AxisLandingController as AxisLandingController,
    AxisLandingState as AxisLandingState,
)
from .landing.beside import PlannedBeside as PlannedBeside, TrackedBeside as TrackedBeside
from .landing.supervisor import Supervisor as Supervisor, SupervisorState as SupervisorState
from .landing.tracked.controller import TrackedLandingController as TrackedLandingController
from .precise.controller import PreciseController as PreciseController
from .pulses.controller import PulseController as PulseController
from .pulses.exact import ExactPulseController as ExactPulseController
from .pulses.published import (
    PulseAmplitudeWidthController as PulseAmplitudeWidthController,
    PulseWidthController as PulseWidthController,
)
from .rest_detection import RestDetection as RestDetection
