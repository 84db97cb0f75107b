"""The command line: ``stickslip identify``, ``stickslip demo``, ``stickslip data``."""

from stickslip.cli.entry import main

__all__ = ["main"]
