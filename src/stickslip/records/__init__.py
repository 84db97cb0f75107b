"""What passes between the stages: logs, estimates, and the errors on the way."""

from stickslip.records.axis_log import GAP_RATIO, AxisLog, LogSource
from stickslip.records.checks import finite_vector, non_negative, positive
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
from stickslip.records.quantities import (
    QUANTITIES,
    AxisKind,
    Quantity,
    quantity_field,
    unit_of,
)
from stickslip.records.reproduction import (
    Claim,
    Curve,
    CurveRole,
    FiveRuns,
    Panel,
    ReproducedFigure,
    Reproduction,
    VariantScore,
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
    "Claim",
    "Curve",
    "CurveRole",
    "Diagnostics",
    "EnergyBalance",
    "EstimateEvolution",
    "EventBudgetError",
    "FiveRuns",
    "FrictionCurve",
    "FrictionEstimate",
    "Identification",
    "InputError",
    "LogSource",
    "MissingExtraError",
    "Panel",
    "ParameterEstimate",
    "Provenance",
    "Quantity",
    "ReproducedFigure",
    "Reproduction",
    "Residuals",
    "Resimulation",
    "SensorSample",
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
    "rounded",
    "rounded_interval",
    "share_text",
    "unit_of",
    "unit_text",
]
