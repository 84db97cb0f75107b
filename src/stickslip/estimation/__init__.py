"""Estimators of friction from a log: one method a file, interchangeable."""

from stickslip.estimation.energy import EnergyEstimator
from stickslip.estimation.examine import examine
from stickslip.estimation.idim_least_squares import IdimLeastSquares
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

__all__ = [
    "EnergyEstimator",
    "IdimLeastSquares",
    "RecursiveLeastSquares",
    "ReportEstimator",
    "SensorNoise",
    "absolute_bias",
    "absolute_bias_polynomial",
    "absolute_density",
    "absolute_mean",
    "absolute_mean_polynomial",
    "double_absolute_mean",
    "double_absolute_mean_polynomial",
    "examine",
    "kinetic_energy_bias",
    "potential_energy_bias",
    "sensor_noise_of",
    "viscous_regressor_bias",
]
