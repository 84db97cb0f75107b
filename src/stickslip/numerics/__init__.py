"""Numerical methods that know nothing of motion axes."""

from stickslip.numerics.kalman import predict, smooth, update, whiten

__all__ = ["predict", "smooth", "update", "whiten"]
