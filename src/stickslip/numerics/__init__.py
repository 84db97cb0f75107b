"""Numerical methods that know nothing of motion axes."""

from stickslip.numerics.kalman import cost, measure, predict, smooth, update, whiten

__all__ = ["cost", "measure", "predict", "smooth", "update", "whiten"]
