"""The command line ``stickslip``: identify, compare, excite, position, demo and data."""

from stickslip.cli.entry import main

__all__ = ["main"]
