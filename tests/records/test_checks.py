"""Checks of single quantities: a text in place of a number is refused too."""

from typing import Any

import numpy as np
import pytest
from refusals import refuses

from stickslip.records import non_negative, positive, whole


@pytest.mark.usefixtures("without_shape_checks")
@pytest.mark.parametrize("value", ["3 kg", "3", None, [1.0, 2.0], True])
def test_what_is_no_number_is_refused(value: Any) -> None:
    for check in (positive, non_negative):
        with refuses("not_a_number", name="mass"):
            check("mass", value, "kg")


@pytest.mark.usefixtures("without_shape_checks")
@pytest.mark.parametrize("value", [3, 3.0, np.float32(3.0), np.int64(3)])
def test_numbers_of_any_type_will_do(value: Any) -> None:
    found = positive("mass", value, "kg")
    assert type(found) is float
    assert found == 3.0
    assert non_negative("mass", value, "kg") == 3.0


def test_signs_and_what_is_not_finite() -> None:
    assert non_negative("noise", 0.0, "m") == 0.0
    for value, code in ((0.0, "not_positive"), (-1.0, "not_positive"), (np.inf, "not_finite")):
        with refuses(code, name="mass", value=value, unit="kg"):
            positive("mass", value, "kg")
    with refuses("negative", name="noise", value=-1.0):
        non_negative("noise", -1.0, "m")
    with refuses("not_finite", name="noise"):
        non_negative("noise", float("nan"), "m")


def test_a_ratio_has_no_unit() -> None:
    with refuses("not_positive", name="exponent", value=-2.0):
        positive("exponent", -2.0, "-")


@pytest.mark.usefixtures("without_shape_checks")
@pytest.mark.parametrize("value", [1, 1.0, True, "2", None])
def test_whole_numbers_and_their_least(value: Any) -> None:
    if type(value) is int:
        assert whole("delay", value, least=1) == whole("delay", np.int64(1), least=1) == 1
        with refuses("not_whole", name="delay", value=1, least=2):
            whole("delay", value, least=2)
        return
    with refuses("not_whole", name="delay", value=value):
        whole("delay", value)
