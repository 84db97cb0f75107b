"""Printed numbers beside ours, and claims that can be read in several ways."""

import pytest

from studies.van_de_wijdeven.records import Claim, PrintedNumber, Reading


def number(text: str, value: float) -> PrintedNumber:
    return PrintedNumber(
        place="3.1", quantity="width", printed=text, value=value, unit="s", how="Eq. 3"
    )


@pytest.mark.parametrize(
    ("text", "value", "same"),
    [
        ("0.092", 0.09157, True),
        ("0.070", 0.07071, False),
        ("0.07", 0.07071, True),
        ("1.375", 1.3749999999999998, True),
        ("1.9e-4", 0.0001857, True),
        ("1.9e-4", 0.0001957, False),
        ("2.5e-3", 0.00256, False),
        ("0.6", 0.5963, True),
        ("0.60", 0.5963, True),
        ("0.600", 0.5963, False),
        ("300", 299.6, True),
    ],
)
def test_digits_are_those_that_are_printed(text: str, value: float, *, same: bool) -> None:
    assert number(text, value).same_digits is same


def test_the_difference_is_over_ours() -> None:
    assert number("2.5e-3", 2e-3).difference == pytest.approx(0.25)
    assert number("0.5", 1.0).difference == pytest.approx(-0.5)


@pytest.mark.parametrize(
    ("agrees", "verdicts", "partly"),
    [(True, (), False), (False, (), False), (False, (False, True), True), (False, (False,), False)],
)
def test_a_claim_can_hold_in_part(
    *, agrees: bool, verdicts: tuple[bool, ...], partly: bool
) -> None:
    claim = Claim(
        place="4",
        statement="It does.",
        criterion="it does",
        measured="it",
        agrees=agrees,
        why="So.",
        readings=tuple(Reading(name="one", agrees=each, measured="seen") for each in verdicts),
    )
    assert claim.agrees_partly is partly
