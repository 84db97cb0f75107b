"""Compiled kernels of the exact simulation: plants, their sensitivities, and sensors."""
