"""Records of the reproduction: figures, claims, numbers and scores."""

from studies.van_de_wijdeven.records.conjunction import (
    ConjunctionReproduction,
    FrictionErrorEffect,
    ReferenceSeries,
    SuccessiveSeries,
)
from studies.van_de_wijdeven.records.energy import EnergyReproduction, FiveRuns, VariantScore
from studies.van_de_wijdeven.records.landing_score import LandingScore, Spread
from studies.van_de_wijdeven.records.pulses import (
    CarriedRuns,
    ControllerScore,
    PrintedNumber,
    PulseReproduction,
    ResolutionScore,
)
from studies.van_de_wijdeven.records.reproduction import (
    Claim,
    Curve,
    CurveRole,
    Measure,
    Panel,
    ReproducedFigure,
    Reproduction,
    Sketch,
)

__all__ = [
    "CarriedRuns",
    "Claim",
    "ConjunctionReproduction",
    "ControllerScore",
    "Curve",
    "CurveRole",
    "EnergyReproduction",
    "FiveRuns",
    "FrictionErrorEffect",
    "LandingScore",
    "Measure",
    "Panel",
    "PrintedNumber",
    "PulseReproduction",
    "ReferenceSeries",
    "ReproducedFigure",
    "Reproduction",
    "ResolutionScore",
    "Sketch",
    "Spread",
    "SuccessiveSeries",
    "VariantScore",
]
