"""Estimators of friction from a log: one method a file, interchangeable."""

from stickslip.estimation.energy.estimator import EnergyEstimator
from stickslip.estimation.energy.published.estimator import ReportEstimator
from stickslip.estimation.energy.published.noise_compensation import (
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
from stickslip.estimation.examine import examine
from stickslip.estimation.likelihood import (
    CramerRaoBound,
    DesignedInput,
    InputLimits,
    LikelihoodMaximum,
    MaximumLikelihoodEstimator,
    cramer_rao_bound,
    design_input,
)
from stickslip.estimation.online.extended_kalman import ExtendedKalmanFilter
from stickslip.estimation.online.observers.friedland_park import FriedlandParkObserver
from stickslip.estimation.online.observers.gradient_estimator import GradientEstimator
from stickslip.estimation.online.observers.least_squares_observer import LeastSquaresObserver
from stickslip.estimation.online.observers.liao_chien import LiaoChienObserver
from stickslip.estimation.online.observers.yazdizadeh_khorasani import YazdizadehKhorasaniObserver
from stickslip.estimation.online.recursive_least_squares import RecursiveLeastSquares
from stickslip.estimation.regression.coupled_joints import CoupledJoints
from stickslip.estimation.regression.decaying_extremes import DecayingExtremes
from stickslip.estimation.regression.free_decay import FreeDecayEstimator
from stickslip.estimation.regression.idim_instrumental import IdimInstrumentalVariables
from stickslip.estimation.regression.idim_least_squares import IdimLeastSquares
from stickslip.estimation.regression.law_selection import (
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
from stickslip.estimation.regression.resimulation import replay, unexplained_effort
from stickslip.estimation.regression.stribeck_estimator import StribeckEstimator

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
