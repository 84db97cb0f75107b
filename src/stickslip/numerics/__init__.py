"""Numerical methods, independent of motion axes."""

from stickslip.numerics.kalman import LinearModel, cost, measure, predict, smooth, update, whiten

__all__ = ["LinearModel", "cost", "measure", "predict", "smooth", "update", "whiten"]
