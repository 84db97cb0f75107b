"""The report's figures, tables and claims, made anew."""

from stickslip.jobs.reproduce.part_a import Reproduced, reproduce_part_a

__all__ = ["Reproduced", "reproduce_part_a"]
