"""The command line: ``stickslip identify``, ``demo``, ``reproduce`` and ``data``."""

from stickslip.cli.entry import main

__all__ = ["main"]
