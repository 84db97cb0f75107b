"""stickslip identifies, simulates and beats dry friction in motion axes."""

__version__ = "0.1.0"
