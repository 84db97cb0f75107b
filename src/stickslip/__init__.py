"""stickslip identifies, simulates and beats dry friction in motion axes.

The names below are loaded when they are first used, so that importing the package costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stickslip.control import (
        PD,
        ExactPulseController,
        FeedbackController,
        FrictionCompensation,
        Move,
        Notch,
        OnlineFriction,
        PointToPoint,
        PulseAmplitudeWidthController,
        PulseWidthController,
        RestDetection,
    )
    from stickslip.estimation import (
        EnergyEstimator,
        IdimLeastSquares,
        PublishedEnergyEstimator,
        StribeckEstimator,
        examine,
    )
    from stickslip.friction import (
        CoulombViscousFriction,
        DahlFriction,
        ElastoPlasticFriction,
        LuGreFriction,
        StribeckFriction,
    )
    from stickslip.jobs import identify
    from stickslip.logs import LogSchema, log_from_frame, read_log, write_csv
    from stickslip.plants import FlexibleArm, SingleMass
    from stickslip.records import (
        AxisLog,
        FrictionEstimate,
        Identification,
        InputError,
        LearntPulses,
        SensorSample,
        Status,
    )
    from stickslip.report import write_report
    from stickslip.simulation import Sensors, simulate, simulate_batch, simulate_closed_loop

__version__ = "0.1.0"

__all__ = [
    "PD",
    "AxisLog",
    "CoulombViscousFriction",
    "DahlFriction",
    "ElastoPlasticFriction",
    "EnergyEstimator",
    "ExactPulseController",
    "FeedbackController",
    "FlexibleArm",
    "FrictionCompensation",
    "FrictionEstimate",
    "Identification",
    "IdimLeastSquares",
    "InputError",
    "LearntPulses",
    "LogSchema",
    "LuGreFriction",
    "Move",
    "Notch",
    "OnlineFriction",
    "PointToPoint",
    "PublishedEnergyEstimator",
    "PulseAmplitudeWidthController",
    "PulseWidthController",
    "RestDetection",
    "SensorSample",
    "Sensors",
    "SingleMass",
    "Status",
    "StribeckEstimator",
    "StribeckFriction",
    "__version__",
    "examine",
    "identify",
    "log_from_frame",
    "read_log",
    "simulate",
    "simulate_batch",
    "simulate_closed_loop",
    "write_csv",
    "write_report",
]

_HOMES = {
    "control": (
        "PD",
        "ExactPulseController",
        "FeedbackController",
        "FrictionCompensation",
        "Move",
        "Notch",
        "OnlineFriction",
        "PointToPoint",
        "PulseAmplitudeWidthController",
        "PulseWidthController",
        "RestDetection",
    ),
    "estimation": (
        "EnergyEstimator",
        "IdimLeastSquares",
        "PublishedEnergyEstimator",
        "StribeckEstimator",
        "examine",
    ),
    "friction": (
        "CoulombViscousFriction",
        "DahlFriction",
        "ElastoPlasticFriction",
        "LuGreFriction",
        "StribeckFriction",
    ),
    "jobs": ("identify",),
    "logs": ("LogSchema", "log_from_frame", "read_log", "write_csv"),
    "plants": ("FlexibleArm", "SingleMass"),
    "records": (
        "AxisLog",
        "FrictionEstimate",
        "Identification",
        "InputError",
        "LearntPulses",
        "SensorSample",
        "Status",
    ),
    "report": ("write_report",),
    "simulation": ("Sensors", "simulate", "simulate_batch", "simulate_closed_loop"),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Load a public name from the package it lives in (PEP 562)."""
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOME_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
