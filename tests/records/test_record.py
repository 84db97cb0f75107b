"""Records as plain JSON types."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
import pytest
from jaxtyping import Float

from stickslip.records import JointLog, JointLogs, LogDeviation, ModelSelection, Status, TermScore
from stickslip.records.record import Record, Valued

SCORE = TermScore(
    term="spring", text="a spring", selected=True, p_value=0.01, gain=0.2, gain_std=0.1, share=0.3
)
DEVIATION = LogDeviation(
    log="noon",
    parameter="mass",
    difference=0.1,
    std=0.01,
    relative=0.05,
    p_value=1e-4,
    material=True,
)
LOG = JointLog(name="noon", samples=10, duration=1.0, sampling_time=0.1, residual=0.02)


def test_a_selection_has_all_fields_of_its_terms() -> None:
    found = ModelSelection(summary="plain", scores=(SCORE,), effort_delay=0.002).to_dict()
    assert json.loads(json.dumps(found)) == {
        "summary": "plain",
        "scores": [{field.name: getattr(SCORE, field.name) for field in fields(TermScore)}],
        "effort_delay": 0.002,
        "reference_time": 0.0,
        "reference_position": 0.0,
        "effort_kind": "held",
    }


def test_logs_of_a_joint_fit_have_all_fields_and_whether_they_are_consistent() -> None:
    found = JointLogs(logs=(LOG,), p_value=None, error_rate=0.01, deviations=(DEVIATION,)).to_dict()
    assert json.loads(json.dumps(found)) == {
        "logs": [{field.name: getattr(LOG, field.name) for field in fields(JointLog)}],
        "p_value": None,
        "error_rate": 0.01,
        "deviations": [
            {field.name: getattr(DEVIATION, field.name) for field in fields(LogDeviation)}
        ],
        "consistent": False,
    }


@dataclass(frozen=True, kw_only=True)
class Inner(Record):
    """A record with all fields in its JSON form."""

    values: Mapping[str, tuple[float, str]]
    array: Float[np.ndarray, " n"]
    status: Status


@dataclass(frozen=True, kw_only=True)
class Outer(Record):
    """A record whose JSON form has other names, another order and a table of its own."""

    json_form = ("first=inner.array second", {"table": ("missing=nothing.name third=inner",)})

    inner: Inner
    nothing: None = None

    @property
    def second(self) -> Valued:
        return Valued(1.0, "m")


def test_the_json_form_follows_names_paths_and_tables() -> None:
    inner = Inner(values={"a": (1.0, "m")}, array=np.array([1.0, 2.0]), status=Status.OK)
    document = Outer(inner=inner).to_dict()
    assert list(document) == ["first", "second", "table"]
    assert document == {
        "first": [1.0, 2.0],
        "second": {"value": 1.0, "unit": "m"},
        "table": {
            "missing": None,
            "third": {"values": {"a": [1.0, "m"]}, "array": [1.0, 2.0], "status": "ok"},
        },
    }


def test_mappings_of_a_record_are_copies_that_cannot_be_changed() -> None:
    values = {"a": (1.0, "m")}
    inner = Inner(values=values, array=np.zeros(1), status=Status.OK)
    values.clear()
    assert dict(inner.values) == {"a": (1.0, "m")}
    with pytest.raises(TypeError):
        inner.values["b"] = (2.0, "m")  # type: ignore[index]
