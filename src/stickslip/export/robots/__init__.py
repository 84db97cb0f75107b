"""Friction in robot descriptions, edited as text: URDF, SDF, MJCF and USD."""
