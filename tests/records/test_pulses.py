import json

import numpy as np
import pytest
from refusals import refuses

from stickslip.records import LearnedPulses, PositioningOutcome, PulseRecord

COVARIANCE = np.array([[2.0, 0.5], [0.5, 1.0]])
LEARNED = LearnedPulses(
    method="papwc",
    kind="rotary",
    values={"gain_1": 3e-5, "gain_2": 3e-3},
    covariance=COVARIANCE,
)


def saved():
    return json.loads(json.dumps(LEARNED.to_dict()))


def test_what_was_learned_survives_a_file_to_the_last_bit():
    again = LearnedPulses.from_dict(saved())
    assert (again.method, again.kind, dict(again.values)) == (
        "papwc",
        "rotary",
        dict(LEARNED.values),
    )
    assert np.array_equal(again.covariance, COVARIANCE)


def test_units_are_written_with_the_values():
    assert saved()["values"]["gain_1"] == {"value": 3e-5, "unit": "rad/(N m s)^2"}


def test_what_was_learned_cannot_be_changed():
    covariance = COVARIANCE.copy()
    learned = LearnedPulses(method="pwc", kind="linear", values={}, covariance=covariance)
    covariance[0, 0] = 7.0
    assert learned.covariance[0, 0] == 2.0
    with pytest.raises(ValueError, match="read-only"):
        learned.covariance[0, 0] = 7.0
    with pytest.raises(TypeError):
        learned.values["gain_1"] = 1.0  # type: ignore[index]


@pytest.mark.parametrize(
    ("key", "value", "where", "code"),
    [
        ("schema", 2, "schema", "other_schema"),
        ("method", "pid", "method", "not_a_choice"),
        ("kind", "angular", "kind", "not_a_choice"),
        ("values", [1.0], "values", "not_as_saved"),
        ("values", {"gain_1": 3.0}, "values.gain_1", "not_as_saved"),
        ("values", {"gain_1": {"value": 3.0}}, "values.gain_1", "key_missing"),
        ("values", {"gain_1": {"value": 3.0, "unit": "m"}}, "values.gain_1", "other_unit"),
        ("values", {"luck": {"value": 3.0, "unit": "m"}}, "values", "not_learned"),
        (
            "values",
            {"gain_1": {"value": None, "unit": "rad/(N m s)^2"}},
            "values.gain_1",
            "not_a_number",
        ),
        ("covariance", "large", "covariance", "covariance_no_numbers"),
        ("covariance", [[1.0, 2.0]], "covariance", "covariance_not_square"),
        ("covariance", [[float("nan")]], "covariance", "covariance_not_finite"),
        ("colour", "red", "", "unknown_key"),
    ],
)
def test_a_file_with_something_wrong_is_refused_and_the_place_is_named(
    key, value, where, code, without_shape_checks
):
    with refuses(code, where=where):
        LearnedPulses.from_dict({**saved(), key: value})


@pytest.mark.parametrize("key", ["schema", "method", "kind", "values", "covariance"])
def test_a_missing_key_is_named(key):
    rest = {name: value for name, value in saved().items() if name != key}
    with refuses("key_missing", key=key):
        LearnedPulses.from_dict(rest)


def test_a_file_of_something_else_is_refused(without_shape_checks):
    with refuses("not_as_saved", found="list"):
        LearnedPulses.from_dict([1.0, 2.0])  # type: ignore[arg-type]


def test_every_outcome_says_what_it_means():
    texts = {outcome.text for outcome in PositioningOutcome}
    assert len(texts) == len(PositioningOutcome)
    assert all(text.endswith(".") for text in texts)


def test_a_pulse_lasts_as_long_as_its_levels():
    pulse = PulseRecord(
        time=0.0,
        levels=((300.0, 0.02), (-200.0, 0.01)),
        error=0.01,
        predicted_displacement=0.01,
        achieved_displacement=0.009,
        moved=True,
    )
    assert pulse.duration == pytest.approx(0.03)
