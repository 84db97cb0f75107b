"""Faults of a drive or an axis that change what a log shows."""
