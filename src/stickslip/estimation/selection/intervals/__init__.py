"""Errors of a fit beyond its sampling error, which widen the intervals."""
