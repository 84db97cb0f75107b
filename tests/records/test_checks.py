"""Checks of single quantities: what is no number is told in words too."""

from typing import Any

import numpy as np
import pytest

from stickslip.records import InputError, non_negative, positive


@pytest.mark.usefixtures("without_shape_checks")
@pytest.mark.parametrize("value", ["3 kg", "3", None, [1.0, 2.0]])
def test_what_is_no_number_is_refused(value: Any) -> None:
    for check in (positive, non_negative):
        with pytest.raises(InputError, match=r"mass is .*, it must be a number; .* in kg"):
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
    for value, limit in ((0.0, "positive"), (-1.0, "positive"), (np.inf, "finite")):
        with pytest.raises(InputError, match=f"mass is {value:g} kg, it must be {limit}"):
            positive("mass", value, "kg")
    with pytest.raises(InputError, match="noise is -1 m, it must not be negative"):
        non_negative("noise", -1.0, "m")
    with pytest.raises(InputError, match="noise is nan m"):
        non_negative("noise", float("nan"), "m")


def test_a_ratio_has_no_unit() -> None:
    with pytest.raises(InputError, match="exponent is -2, it must be positive"):
        positive("exponent", -2.0, "-")
