"""The estimate's JSON form and its refusal of half results."""

import json

import numpy as np
from estimates import doubtful_estimate
from refusals import refuses

from stickslip.records import (
    PARAMETER_NAMES,
    QUANTITIES,
    ParameterEstimate,
    Status,
    parameter_label,
    unit_of,
)


def test_json_form_has_the_promised_keys_and_survives_a_round_trip() -> None:
    data = json.loads(json.dumps(doubtful_estimate().to_dict(), allow_nan=False))
    assert data["schema"] == 1
    assert data["parameters"]["mass"] == {
        "value": 2.0,
        "std": 0.5,
        "ci95": [1.0, 3.0],
        "unit": "kg",
    }
    assert data["parameters"]["offset"]["value"] is None
    assert data["status"] == "not_identifiable"
    assert {"diagnostics", "provenance"} <= set(data)


def test_a_parameter_the_log_cannot_identify_has_no_value_to_hand_out() -> None:
    with refuses("not_identified", name="offset", identified=["mass"]):
        doubtful_estimate().value("offset")


def test_a_value_can_be_without_an_interval() -> None:
    observed = ParameterEstimate(name="mass", value=1.0, std=None, ci95=None, unit="kg")
    assert observed.identified
    assert np.isnan(observed.quantile)


def test_half_an_uncertainty_is_refused() -> None:
    with refuses("half_an_uncertainty"):
        ParameterEstimate(name="mass", value=1.0, std=0.1, ci95=None, unit="kg")
    with refuses("half_an_uncertainty"):
        ParameterEstimate(name="mass", value=None, std=0.1, ci95=(0.8, 1.2), unit="kg")
    with refuses("not_a_choice", value="weight"):
        ParameterEstimate(name="weight", value=None, std=None, ci95=None, unit="kg")


def test_every_parameter_has_a_unit_and_every_status_a_remedy() -> None:
    for name in PARAMETER_NAMES:
        assert unit_of(name, "linear")
        assert unit_of(name, "rotary")
    assert unit_of("viscous_friction", "linear") == QUANTITIES["viscous_friction"].linear
    for status in Status:
        assert status.text.endswith(".")
        assert status.trusted == (status is Status.OK)


def test_every_status_has_its_own_word_and_every_parameter_its_own_label() -> None:
    words = [status.word for status in Status]
    assert len(set(words)) == len(words)
    assert all(word and not word.endswith(".") for word in words)
    labels = {parameter_label(name) for name in PARAMETER_NAMES}
    assert len(labels) == len(PARAMETER_NAMES)
