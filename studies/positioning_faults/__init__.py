"""Positioning of axes and arms with faults, on a plant in fine steps of 20 µs."""
