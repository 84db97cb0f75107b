"""Intervals of recursive estimates without white residuals or an exact model."""
