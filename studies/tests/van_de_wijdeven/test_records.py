"""Printed numbers beside ours, and claims that can be read in several ways."""

import numpy as np
import pytest

from studies.van_de_wijdeven.records import Claim, Measure, PrintedNumber


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


def measure(case: str, value: float, low: float = -np.inf, high: float = np.inf) -> Measure:
    return Measure(case=case, quantity="width", unit="s", value=value, low=low, high=high)


def claim(*measures: Measure) -> Claim:
    return Claim(name="it", place="4", statement="It does.", measures=measures, why="So.")


@pytest.mark.parametrize(
    ("value", "low", "high", "agrees"),
    [
        (1.0, 1.0, 2.0, True),
        (2.0, 1.0, 2.0, True),
        (0.999, 1.0, 2.0, False),
        (2.001, 1.0, 2.0, False),
        (-1e9, -np.inf, 2.0, True),
        (np.nan, 1.0, np.inf, False),
        (np.nan, -np.inf, np.inf, True),
    ],
)
def test_a_measure_agrees_within_its_limits(
    value: float, low: float, high: float, *, agrees: bool
) -> None:
    assert measure("", value, low, high).agrees is agrees


@pytest.mark.parametrize(
    ("values", "verdict"),
    [
        ({"": 1.0}, "agrees"),
        ({"": 3.0}, "differs"),
        ({"one": 1.0, "other": 3.0}, "partly"),
        ({"one": 3.0, "other": 3.0}, "differs"),
        ({"one": 1.0, "other": 1.0}, "agrees"),
    ],
)
def test_a_claim_can_hold_in_part(values: dict[str, float], verdict: str) -> None:
    measures = [measure(case, value, high=2.0) for case, value in values.items()]
    found = claim(*measures, measure("", 7.0))
    assert found.verdict == verdict
    assert found.agrees_partly is (verdict == "partly")
    assert found.verdicts == {case: value <= 2.0 for case, value in values.items()}


def test_limits_in_words() -> None:
    limits = {measure("", 1.0, *each).limits for each in ((0.5, 2.0), (0.5,), (-np.inf, 2.0))}
    assert limits == {"500 ms to 2.00 s", "at least 500 ms", "at most 2.00 s"}
    assert measure("", 1.0).limits == ""
    assert measure("", np.nan).value_text == "none"
