"""Least-squares rows, their solution, intervals and verdicts."""
