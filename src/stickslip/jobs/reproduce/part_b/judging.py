"""What claims of part B are put together with: verdicts by reading, and numbers in words."""

from collections.abc import Iterable, Mapping

from stickslip.records import Claim, prefixed

__all__ = ["Found", "by_reading", "judged", "lengths", "percent", "ratios"]

Found = tuple[bool, str]
"""Whether a criterion is met, and what was measured."""


def judged(
    *,
    place: str,
    statement: str,
    criterion: str,
    found: Found,
    why: str,
    numbers: Mapping[str, float],
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
        numbers=numbers,
    )


def by_reading(
    *,
    place: str,
    statement: str,
    criterion: str,
    found: Mapping[str, Found],
    why: str,
    numbers: Mapping[str, float],
) -> Claim:
    """Return a claim that was judged in each reading.

    Readings are told apart only where their verdicts differ.
    """
    verdicts = {reading: agrees for reading, (agrees, _) in found.items()}
    return Claim(
        place=place,
        statement=statement,
        criterion=criterion,
        measured="; ".join(f"{reading}: {measured}" for reading, (_, measured) in found.items()),
        agrees=all(verdicts.values()),
        why=why,
        numbers=numbers,
        readings=verdicts if len(set(verdicts.values())) > 1 else {},
    )


def lengths(values: Iterable[float]) -> str:
    """Return lengths [m] in words."""
    return ", ".join(prefixed(value, "m").replace("-", "−") for value in values)


def percent(share: float) -> str:
    """Return a share in words, with three digits."""
    return f"{100.0 * share:.3g} %".replace("-", "−")


def ratios(values: Iterable[float], digits: int = 3) -> str:
    """Return ratios in words."""
    return ", ".join(f"{value:.{digits}g}".replace("-", "−") for value in values)
