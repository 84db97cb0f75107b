"""Values are printed with the digits that mean something."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip.records import (
    PARAMETER_NAMES,
    parameter_label,
    rounded,
    rounded_interval,
    unit_text,
)


@pytest.mark.parametrize(
    ("value", "std", "text"),
    [
        (95.108877, 0.1085, "95.11"),
        (203.5034, 1.1460, "203.5"),
        (-3.1648, 0.0444, "-3.165"),
        (203503.4, 1146.0, "203500"),
        (-0.00004, 0.01, "0.000"),
        (0.1000049, 1e-7, "0.10000490"),
        (1.23456789, 0.0, "1.23457"),
        (1.23456789, float("nan"), "1.23457"),
    ],
)
def test_rounding_follows_the_uncertainty(value: float, std: float, text: str) -> None:
    assert rounded(value, std) == text


def test_an_interval_is_rounded_like_its_value() -> None:
    assert rounded_interval(-3.2518, -3.0778, 0.0444) == "-3.252 to -3.078"


@given(st.floats(-1e9, 1e9), st.floats(1e-9, 1e6))
def test_rounding_changes_a_value_by_less_than_a_tenth_of_its_uncertainty(
    value: float, std: float
) -> None:
    # Two digits are kept, so the last one is worth at most std/10 and rounding at most half of it;
    # the second term is the spacing of floats near the value.
    assert abs(float(rounded(value, std)) - value) <= 0.05 * std + 1e-15 * abs(value)


def test_every_parameter_has_a_distinct_label() -> None:
    labels = {parameter_label(name) for name in PARAMETER_NAMES}
    assert len(labels) == len(PARAMETER_NAMES)
    assert "Coulomb friction, forward" in labels


def test_units_are_printed_with_their_exponents_raised() -> None:
    assert unit_text("kg m^2") == "kg m²"
