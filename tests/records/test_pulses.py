import json

import numpy as np
import pytest

from stickslip.records import InputError, LearnedPulses, PositioningOutcome, PulseRecord

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
    ("key", "value", "where", "says"),
    [
        ("schema", 2, "schema", "reads schema 1"),
        ("method", "pid", "method", "pwc, papwc, exact"),
        ("kind", "angular", "kind", "linear, rotary"),
        ("values", [1.0], "values", "a list"),
        ("values", {"gain_1": 3.0}, "values.gain_1", "a float"),
        ("values", {"gain_1": {"value": 3.0}}, "values.gain_1", "'unit' is missing"),
        ("values", {"gain_1": {"value": 3.0, "unit": "m"}}, "values.gain_1", r"rad/\(N m s\)\^2"),
        ("values", {"luck": {"value": 3.0, "unit": "m"}}, "values", "'luck'"),
        (
            "values",
            {"gain_1": {"value": None, "unit": "rad/(N m s)^2"}},
            "values.gain_1",
            "must be a finite number",
        ),
        ("covariance", "large", "covariance", "not a matrix"),
        ("covariance", [[1.0, 2.0]], "covariance", r"\(1, 2\)"),
        ("covariance", [[float("nan")]], "covariance", "not finite"),
        ("colour", "red", "", "'colour' is unknown"),
    ],
)
def test_a_file_with_something_wrong_is_refused_and_the_place_is_named(
    key, value, where, says, without_shape_checks
):
    with pytest.raises(InputError, match=says) as error:
        LearnedPulses.from_dict({**saved(), key: value})
    assert error.value.where == where
    assert error.value.remedy


@pytest.mark.parametrize("key", ["schema", "method", "kind", "values", "covariance"])
def test_a_missing_key_is_named(key):
    rest = {name: value for name, value in saved().items() if name != key}
    with pytest.raises(InputError, match=f"'{key}' is missing"):
        LearnedPulses.from_dict(rest)


def test_a_file_of_something_else_is_refused(without_shape_checks):
    with pytest.raises(InputError, match="a list"):
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
