"""Columns of a log: their meaning by name, the axes they make, presets, clocks and rates."""
