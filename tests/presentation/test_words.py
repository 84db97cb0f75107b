"""Values are shown with the digits that mean something, and with their verdict."""

from dataclasses import replace

import numpy as np
import pytest
from estimates import doubtful_estimate
from hypothesis import given
from hypothesis import strategies as st

from stickslip.presentation.words import (
    Judgement,
    judged,
    missing_parameters,
    reasons_of_status,
    rounded,
    value_texts,
    value_with_half,
)
from stickslip.records import ParameterEstimate, Status


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


@given(st.floats(-1e9, 1e9), st.floats(1e-9, 1e6))
def test_rounding_changes_a_value_by_less_than_a_tenth_of_its_uncertainty(
    value: float, std: float
) -> None:
    # Two digits are kept, so the last one is worth at most std/10 and rounding at most half of it;
    # the second term is the spacing of floats near the value.
    assert abs(float(rounded(value, std)) - value) <= 0.05 * std + 1e-15 * abs(value)


def test_every_parameter_is_judged_with_its_reason() -> None:
    estimate = doubtful_estimate()
    assert judged(estimate, "mass").judgement is Judgement.IDENTIFIED
    missing = judged(estimate, "offset")
    assert (missing.judgement, missing.reason) == (Judgement.NOT_IDENTIFIED, "it does not move")
    assert missing_parameters(estimate) == ["Offset: it does not move"]
    assert missing_parameters(replace(estimate, diagnostics=replace(
        estimate.diagnostics, verdicts=()))) == []  # fmt: skip


@pytest.mark.parametrize("status", Status)
def test_the_first_note_is_the_reason_for_a_mismatch(status: Status) -> None:
    doubtful = doubtful_estimate()
    notes = ("the viscous_friction changes; identify the parts", "another note")
    noted = replace(doubtful, diagnostics=replace(doubtful.diagnostics, notes=notes), status=status)
    missing = missing_parameters(doubtful)
    mismatch = status is Status.MODEL_MISMATCH
    expected = ["the viscous friction changes; identify the parts"] if mismatch else missing
    assert reasons_of_status(noted) == expected
    assert reasons_of_status(replace(doubtful, status=status)) == missing


@pytest.mark.parametrize("status", Status)
def test_a_value_is_used_only_where_the_status_allows_it(status: Status) -> None:
    word = judged(replace(doubtful_estimate(), status=status), "mass").judgement
    assert word is (Judgement.IDENTIFIED if status.usable else Judgement.UNUSABLE)


@pytest.mark.parametrize(("name", "value"), [("mass", -2.0), ("mass", 0.0), ("offset", -2.0)])
def test_only_what_cannot_be_negative_is_unphysical(name: str, value: float) -> None:
    parameter = ParameterEstimate(name=name, value=value, std=None, ci95=None, unit="N")
    estimate = replace(
        doubtful_estimate(), status=Status.UNPHYSICAL, parameters={name: parameter},
        covariance=np.zeros((1, 1)),
    )  # fmt: skip
    wrong = judged(estimate, name).judgement is Judgement.UNPHYSICAL
    assert wrong == (name == "mass")


def test_an_interval_is_rounded_like_its_value() -> None:
    friction = ParameterEstimate(
        name="offset", value=-3.1648, std=0.0444, ci95=(-3.2518, -3.0778), unit="N"
    )
    assert value_texts(friction) == ("-3.165", "-3.252 to -3.078")


def test_values_are_shown_with_the_digits_that_count() -> None:
    mass = doubtful_estimate().parameters["mass"]
    assert value_texts(mass) == ("2.00", "1.00 to 3.00")
    assert value_texts(replace(mass, std=None, ci95=None)) == ("2", "none")
    assert value_texts(replace(mass, value=None, std=None, ci95=None)) == ("–", "–")


@pytest.mark.parametrize(
    ("interval", "text"), [((2.0, 4.0), "3.0 ± 1"), ((-0.5, 4.0), "3.00 (-0.50 to 4.00)")]
)
def test_an_interval_about_another_middle_has_both_ends(
    interval: tuple[float, float], text: str
) -> None:
    parameter = ParameterEstimate(name="offset", value=3.0, std=0.5, ci95=interval, unit="N")
    assert value_with_half(parameter).replace("\N{MINUS SIGN}", "-") == text
