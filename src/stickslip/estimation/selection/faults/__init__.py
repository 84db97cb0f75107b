"""Tests for faults of a drive or an axis: saturation, and a sudden change."""
