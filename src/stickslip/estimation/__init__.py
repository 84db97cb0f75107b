"""Estimators of friction from a log: one method a file, interchangeable."""

from stickslip.estimation.coupled_joints import CoupledJoints
from stickslip.estimation.decaying_extremes import DecayingExtremes
from stickslip.estimation.energy import EnergyEstimator
from stickslip.estimation.examine import examine
from stickslip.estimation.extended_kalman import ExtendedKalmanFilter
from stickslip.estimation.free_decay import FreeDecayEstimator
from stickslip.estimation.friedland_park import FriedlandParkObserver
from stickslip.estimation.gradient_estimator import GradientEstimator
from stickslip.estimation.idim_instrumental import IdimInstrumentalVariables
from stickslip.estimation.idim_least_squares import IdimLeastSquares
from stickslip.estimation.law_selection import (
    FittedLaw,
    ForceRipple,
    FrictionForm,
    LawCandidate,
    LawScore,
    LawSelection,
    LinearFit,
    RowSettings,
    find_moves,
    force_ripple,
    law_candidates,
    select_friction_law,
)
from stickslip.estimation.least_squares_observer import LeastSquaresObserver
from stickslip.estimation.liao_chien import LiaoChienObserver
from stickslip.estimation.maximum_likelihood import (
    CramerRaoBound,
    DesignedInput,
    InputLimits,
    LikelihoodMaximum,
    MaximumLikelihoodEstimator,
    cramer_rao_bound,
    design_input,
)
from stickslip.estimation.noise_compensation import (
    SensorNoise,
    absolute_bias,
    absolute_bias_polynomial,
    absolute_density,
    absolute_mean,
    absolute_mean_polynomial,
    double_absolute_mean,
    double_absolute_mean_polynomial,
    kinetic_energy_bias,
    potential_energy_bias,
    sensor_noise_of,
    viscous_regressor_bias,
)
from stickslip.estimation.recursive_least_squares import RecursiveLeastSquares
from stickslip.estimation.report_estimator import ReportEstimator
from stickslip.estimation.resimulation import replay, unexplained_effort
from stickslip.estimation.stribeck_estimator import StribeckEstimator
from stickslip.estimation.yazdizadeh_khorasani import YazdizadehKhorasaniObserver

__all__ = [
    "CoupledJoints",
    "CramerRaoBound",
    "DecayingExtremes",
    "DesignedInput",
    "EnergyEstimator",
    "ExtendedKalmanFilter",
    "FittedLaw",
    "ForceRipple",
    "FreeDecayEstimator",
    "FrictionForm",
    "FriedlandParkObserver",
    "GradientEstimator",
    "IdimInstrumentalVariables",
    "IdimLeastSquares",
    "InputLimits",
    "LawCandidate",
    "LawScore",
    "LawSelection",
    "LeastSquaresObserver",
    "LiaoChienObserver",
    "LikelihoodMaximum",
    "LinearFit",
    "MaximumLikelihoodEstimator",
    "RecursiveLeastSquares",
    "ReportEstimator",
    "RowSettings",
    "SensorNoise",
    "StribeckEstimator",
    "YazdizadehKhorasaniObserver",
    "absolute_bias",
    "absolute_bias_polynomial",
    "absolute_density",
    "absolute_mean",
    "absolute_mean_polynomial",
    "cramer_rao_bound",
    "design_input",
    "double_absolute_mean",
    "double_absolute_mean_polynomial",
    "examine",
    "find_moves",
    "force_ripple",
    "kinetic_energy_bias",
    "law_candidates",
    "potential_energy_bias",
    "replay",
    "select_friction_law",
    "sensor_noise_of",
    "unexplained_effort",
    "viscous_regressor_bias",
]
