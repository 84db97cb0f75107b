"""Estimators that run sample by sample."""
