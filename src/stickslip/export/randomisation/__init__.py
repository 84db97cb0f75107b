"""Ranges of domain randomisation from confidence intervals."""
