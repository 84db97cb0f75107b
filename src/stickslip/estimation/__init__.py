"""Estimators of friction from a log: one method a file, interchangeable."""

from stickslip.estimation.energy import EnergyEstimator
from stickslip.estimation.examine import examine
from stickslip.estimation.idim_least_squares import IdimLeastSquares

__all__ = ["EnergyEstimator", "IdimLeastSquares", "examine"]
