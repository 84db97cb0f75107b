"""Adaptive observers and gradient estimators of friction."""
