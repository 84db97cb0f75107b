"""The energy-based estimator as published (van de Wijdeven 2002)."""
