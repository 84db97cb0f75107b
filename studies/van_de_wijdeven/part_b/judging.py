"""What claims of part B are put together with: verdicts by reading, and numbers in words."""

from collections.abc import Callable, Iterable, Mapping

from stickslip.presentation.words import prefixed
from studies.van_de_wijdeven.part_b.cases import KEYS, READINGS
from studies.van_de_wijdeven.part_b.evidence import Evidence
from studies.van_de_wijdeven.part_b.runs import Series
from studies.van_de_wijdeven.records import Claim, Reading

__all__ = [
    "BOUND_WORDS",
    "Found",
    "Numbers",
    "by_reading",
    "in_both_readings",
    "judged",
    "lengths",
    "percent",
    "ratios",
]

BOUND_WORDS = {"unbounded": "no bound", "bounded": "with the bound"}
"""How the cases of t_p,max are called, by what their numbers begin with."""

_NOTHING = 1e-9  # a length below every displacement here [m]

Found = tuple[bool, str]
"""Whether a criterion is met, and what was measured."""

Numbers = Mapping[str, float | int]
"""Values by name [as the end of the name tells]."""


def judged(
    *,
    place: str,
    statement: str,
    criterion: str,
    found: Found,
    why: str,
    numbers: Numbers,
) -> Claim:
    """Return a claim that can be read in one way only."""
    agrees, measured = found
    return Claim(
        place=place,
        statement=statement,
        criterion=criterion,
        measured=measured,
        agrees=agrees,
        why=why,
        numbers={name: float(value) for name, value in numbers.items()},
    )


def by_reading(
    *,
    place: str,
    statement: str,
    criterion: str,
    found: Mapping[str, Found],
    why: str,
    numbers: Numbers,
) -> Claim:
    """Return a claim that was judged in each reading, or in each of several cases."""
    readings = tuple(
        Reading(name=name, agrees=agrees, measured=measured)
        for name, (agrees, measured) in found.items()
    )
    return Claim(
        place=place,
        statement=statement,
        criterion=criterion,
        measured="; ".join(f"{each.name}: {each.measured}" for each in readings),
        agrees=all(each.agrees for each in readings),
        why=why,
        numbers={name: float(value) for name, value in numbers.items()},
        readings=readings,
    )


def in_both_readings(
    evidence: Evidence,
    controller: str,
    judge: Callable[[Series, Series], tuple[bool, str, Numbers]],
) -> tuple[dict[str, Found], dict[str, float | int]]:
    """Judge a controller in both of its readings.

    Parameters
    ----------
    evidence
        Where its runs are.
    controller
        Which one.
    judge
        Takes the runs without a bound and those with it; returns whether the criterion is met,
        what was measured, and the numbers of that.

    Returns
    -------
    What was found by reading, and all numbers.
    """
    found: dict[str, Found] = {}
    numbers: dict[str, float | int] = {}
    for reading in READINGS[controller]:
        agrees, measured, own = judge(*evidence.by_bound(controller, reading))
        found[reading] = (agrees, measured)
        numbers |= {f"{KEYS[reading]}_{name}": value for name, value in own.items()}
    return found, numbers


def lengths(values: Iterable[float]) -> str:
    """Return lengths [m] in words."""
    return ", ".join(
        "less than 1 nm" if abs(value) < _NOTHING else prefixed(value, "m").replace("-", "−")
        for value in values
    )


def percent(share: float) -> str:
    """Return a share in words, with three digits."""
    return f"{100.0 * share:.3g} %".replace("-", "−")


def ratios(values: Iterable[float], digits: int = 3) -> str:
    """Return ratios in words."""
    return ", ".join(f"{value:.{digits}g}".replace("-", "−") for value in values)
