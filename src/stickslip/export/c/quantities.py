"""Quantities of an estimate that the exported friction law holds."""

QUANTITIES = (
    "coulomb_friction",
    "static_friction",
    "viscous_friction",
    "offset",
    "stribeck_velocity",
    "quadratic_friction",
    "two_thirds_friction",
    "low_speed_friction",
    "low_speed_velocity",
)
