"""Claims as data: the quantities that decide a claim, with their limits, and the verdict."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf
from typing import Generic, TypeVar

from studies.van_de_wijdeven.records import Claim, Measure

Evidence = TypeVar("Evidence")

ONLY = ""
"""Name of the case of a claim that has no others."""


@dataclass(frozen=True)
class Quantity(Generic[Evidence]):
    """A quantity that decides a claim, or that goes with it where it has no limits."""

    name: str
    unit: str
    measure: Callable[[Evidence], Mapping[str, float] | float]
    """Returns the value [unit] from the evidence, or those of several cases by name."""
    low: float = -inf
    high: float = inf


class Row(Generic[Evidence]):
    """A claim of the source: its name, where it says what, the reason, and what decides it."""

    def __init__(
        self, name: str, place: str, statement: str, why: str, *quantities: Quantity[Evidence]
    ) -> None:
        self.name, self.place, self.statement, self.why = name, place, statement, why
        self.quantities = quantities


def judged(row: Row[Evidence], evidence: Evidence) -> Claim:
    """Return a claim with its quantities as measured."""
    measures: list[Measure] = []
    for each in row.quantities:
        found = each.measure(evidence)
        cases = found if isinstance(found, Mapping) else {ONLY: found}
        measures += [
            Measure(
                case=case,
                quantity=each.name,
                unit=each.unit,
                value=float(value),
                low=each.low,
                high=each.high,
            )
            for case, value in cases.items()
        ]
    return Claim(
        name=row.name,
        place=row.place,
        statement=row.statement,
        measures=tuple(measures),
        why=row.why,
    )
