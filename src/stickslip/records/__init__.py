"""What passes between the stages: logs, estimates, and the errors on the way."""

from stickslip.records.arm_positioning import ArmRun, ArmSeries, LandingPhase, LandingPhaseName
from stickslip.records.axis_log import GAP_RATIO, AxisLog, LogSource
from stickslip.records.checks import finite_vector, non_negative, positive
from stickslip.records.comparison import (
    ComparedEstimator,
    Contradiction,
    EstimatorComparison,
    EstimatorScore,
    EstimatorStudy,
    ParameterScore,
)
from stickslip.records.errors import (
    EventBudgetError,
    InputError,
    MissingExtraError,
    StickslipError,
)
from stickslip.records.estimate import (
    PARAMETER_NAMES,
    SCHEMA_VERSION,
    SIGNED_PARAMETERS,
    Diagnostics,
    FrictionEstimate,
    ParameterEstimate,
    Provenance,
    Status,
    Verdict,
)
from stickslip.records.excitation import Excitation, ExpectedParameter
from stickslip.records.identification import (
    EnergyBalance,
    EstimateEvolution,
    FrictionCurve,
    Identification,
    Residuals,
    Resimulation,
)
from stickslip.records.joint import JointLog, JointLogs, LogDeviation
from stickslip.records.plain import ScenarioTables
from stickslip.records.positioning import (
    Ending,
    Positioning,
    PositioningMove,
    PositioningRun,
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
    shared_name,
    unit_of,
)
from stickslip.records.read_only import ReadOnlyMapping
from stickslip.records.selection import EffortKind, ModelSelection, TermScore
from stickslip.records.sensor_sample import SensorSample
from stickslip.records.wording import (
    count_of,
    in_units_of,
    in_words,
    parameter_label,
    prefixed,
    prefixed_unit,
    unit_text,
)

__all__ = [
    "GAP_RATIO",
    "PARAMETER_NAMES",
    "QUANTITIES",
    "SCHEMA_VERSION",
    "SIGNED_PARAMETERS",
    "ArmRun",
    "ArmSeries",
    "AxisKind",
    "AxisLog",
    "ComparedEstimator",
    "Contradiction",
    "Diagnostics",
    "EffortKind",
    "Ending",
    "EnergyBalance",
    "EstimateEvolution",
    "EstimatorComparison",
    "EstimatorScore",
    "EstimatorStudy",
    "EventBudgetError",
    "Excitation",
    "ExpectedParameter",
    "FrictionCurve",
    "FrictionEstimate",
    "Identification",
    "InputError",
    "JointLog",
    "JointLogs",
    "LandingPhase",
    "LandingPhaseName",
    "LearntPulses",
    "LogDeviation",
    "LogSource",
    "MissingExtraError",
    "ModelSelection",
    "ParameterEstimate",
    "ParameterScore",
    "Positioning",
    "PositioningMove",
    "PositioningOutcome",
    "PositioningRun",
    "Provenance",
    "PulseMethod",
    "PulseRecord",
    "Quantity",
    "ReadOnlyMapping",
    "Residuals",
    "Resimulation",
    "ScenarioTables",
    "SensorSample",
    "Status",
    "StickslipError",
    "TermScore",
    "Verdict",
    "count_of",
    "finite_vector",
    "in_units_of",
    "in_words",
    "non_negative",
    "parameter_label",
    "positive",
    "prefixed",
    "prefixed_unit",
    "quantity_field",
    "quantity_name",
    "shared_name",
    "unit_of",
    "unit_text",
]
