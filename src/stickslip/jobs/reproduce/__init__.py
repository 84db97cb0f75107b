"""The report's figures, tables and claims, made anew.

A package for each part computes and judges it; `parallel` does independent pieces of work at once,
`writing` draws and writes what was computed.
"""

from stickslip.jobs.reproduce.conjunction import reproduce_conjunction
from stickslip.jobs.reproduce.part_a import reproduce_part_a
from stickslip.jobs.reproduce.part_b import reproduce_part_b
from stickslip.jobs.reproduce.writing import Reproduced

__all__ = ["Reproduced", "reproduce_conjunction", "reproduce_part_a", "reproduce_part_b"]
