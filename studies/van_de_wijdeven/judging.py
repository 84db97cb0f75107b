"""Claims as data: the quantities that decide a claim, with their limits, and the verdict."""

from collections.abc import Callable, Iterable, Mapping
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


@dataclass(frozen=True)
class Row(Generic[Evidence]):
    """A claim of the source: a name for it, what the source says where, and what decides it."""

    name: str
    place: str
    statement: str
    quantities: tuple[Quantity[Evidence], ...]
    why: str


def judged(row: Row[Evidence], evidence: Evidence) -> Claim:
    """Return a claim with its quantities as measured."""
    measures: list[Measure] = []
    for each in row.quantities:
        found = each.measure(evidence)
        cases: Iterable[tuple[str, float]] = (
            found.items() if isinstance(found, Mapping) else [(ONLY, found)]
        )
        measures += [
            Measure(
                case=case,
                quantity=each.name,
                unit=each.unit,
                value=float(value),
                low=each.low,
                high=each.high,
            )
            for case, value in cases
        ]
    return Claim(
        name=row.name,
        place=row.place,
        statement=row.statement,
        measures=tuple(measures),
        why=row.why,
    )
