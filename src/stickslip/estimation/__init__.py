"""Estimators of friction from a log: one method a file, interchangeable."""

from stickslip.estimation.idim_least_squares import IdimLeastSquares

__all__ = ["IdimLeastSquares"]
