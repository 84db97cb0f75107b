"""Estimators of friction from a log: one method a file, interchangeable."""

from stickslip.estimation.energy import EnergyEstimator
from stickslip.estimation.examine import examine
from stickslip.estimation.idim_least_squares import IdimLeastSquares
from stickslip.estimation.recursive_least_squares import RecursiveLeastSquares

__all__ = [
    "EnergyEstimator",
    "IdimLeastSquares",
    "RecursiveLeastSquares",
    "examine",
]
