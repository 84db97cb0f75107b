"""What passes between the stages: logs, estimates, and the errors on the way."""

from stickslip.records.axis_log import GAP_RATIO, AxisLog, LogSource
from stickslip.records.checks import finite_vector, non_negative, positive
from stickslip.records.energy_reproduction import EnergyReproduction, FiveRuns, VariantScore
from stickslip.records.errors import (
    EventBudgetError,
    InputError,
    MissingExtraError,
    StickslipError,
)
from stickslip.records.estimate import (
    PARAMETER_NAMES,
    SCHEMA_VERSION,
    Diagnostics,
    FrictionEstimate,
    ParameterEstimate,
    Provenance,
    Status,
    Verdict,
)
from stickslip.records.identification import (
    EnergyBalance,
    EstimateEvolution,
    FrictionCurve,
    Identification,
    Residuals,
    Resimulation,
)
from stickslip.records.pulse_reproduction import (
    CarriedRuns,
    ControllerScore,
    PrintedNumber,
    PulseReproduction,
)
from stickslip.records.pulses import (
    LearntPulses,
    PositioningOutcome,
    PulseMethod,
    PulseRecord,
)
from stickslip.records.quantities import (
    QUANTITIES,
    AxisKind,
    Quantity,
    quantity_field,
    quantity_name,
    unit_of,
)
from stickslip.records.reproduction import (
    Claim,
    Curve,
    CurveRole,
    Panel,
    ReproducedFigure,
    Reproduction,
    Sketch,
)
from stickslip.records.sensor_sample import SensorSample
from stickslip.records.wording import (
    count_of,
    in_words,
    parameter_label,
    rounded,
    rounded_interval,
    share_text,
    unit_text,
)

__all__ = [
    "GAP_RATIO",
    "PARAMETER_NAMES",
    "QUANTITIES",
    "SCHEMA_VERSION",
    "AxisKind",
    "AxisLog",
    "CarriedRuns",
    "Claim",
    "ControllerScore",
    "Curve",
    "CurveRole",
    "Diagnostics",
    "EnergyBalance",
    "EnergyReproduction",
    "EstimateEvolution",
    "EventBudgetError",
    "FiveRuns",
    "FrictionCurve",
    "FrictionEstimate",
    "Identification",
    "InputError",
    "LearntPulses",
    "LogSource",
    "MissingExtraError",
    "Panel",
    "ParameterEstimate",
    "PositioningOutcome",
    "PrintedNumber",
    "Provenance",
    "PulseMethod",
    "PulseRecord",
    "PulseReproduction",
    "Quantity",
    "ReproducedFigure",
    "Reproduction",
    "Residuals",
    "Resimulation",
    "SensorSample",
    "Sketch",
    "Status",
    "StickslipError",
    "VariantScore",
    "Verdict",
    "count_of",
    "finite_vector",
    "in_words",
    "non_negative",
    "parameter_label",
    "positive",
    "quantity_field",
    "quantity_name",
    "rounded",
    "rounded_interval",
    "share_text",
    "unit_of",
    "unit_text",
]
