"""The figures, tables and claims of van de Wijdeven (2002), simulated and judged.

Energy-based estimation of friction is part A, pulse width control part B. A package for each part
computes and judges it; `records` holds the results, `page` draws them, `writing` writes the files.
"""

from studies.van_de_wijdeven.conjunction import reproduce_conjunction
from studies.van_de_wijdeven.part_a import reproduce_part_a
from studies.van_de_wijdeven.part_b import reproduce_part_b
from studies.van_de_wijdeven.writing import Reproduced

__all__ = ["Reproduced", "reproduce_conjunction", "reproduce_part_a", "reproduce_part_b"]
