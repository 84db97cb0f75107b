"""Regression of the inverse dynamics and of free decays."""
