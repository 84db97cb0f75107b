"""Positioning: the run of a scenario, what is recorded along it, and how it is judged."""
