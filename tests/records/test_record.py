"""Records as plain JSON types."""

import copy
import json
import math
import pickle
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import pytest
from jaxtyping import Float

from stickslip.records import (
    JointLog,
    JointLogs,
    LogDeviation,
    ModelSelection,
    Status,
    TermScore,
    share_text,
)
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


def of_fields(record: Record) -> dict[str, object]:
    return {field.name: getattr(record, field.name) for field in fields(record)}  # type: ignore[arg-type]


def test_records_without_a_form_of_their_own_have_all_fields() -> None:
    selection = ModelSelection(summary="plain", scores=(SCORE,), effort_delay=0.002)
    expected = {**of_fields(selection), "scores": [of_fields(SCORE)]}
    assert json.loads(json.dumps(selection.to_dict())) == expected
    joint = JointLogs(logs=(LOG,), p_value=None, error_rate=0.01, deviations=(DEVIATION,))
    assert json.loads(json.dumps(joint.to_dict())) == {
        **of_fields(joint),
        "logs": [of_fields(LOG)],
        "deviations": [of_fields(DEVIATION)],
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


@dataclass(frozen=True, kw_only=True)
class Leaf(Record):
    """A record whose contents have hashes."""

    numbers: tuple[float, float]
    name: str


def leaf(number: float = 1.0) -> Leaf:
    return Leaf(numbers=(number, 2.0), name="a")


def array(*values: float) -> np.ndarray:
    return np.array(values)


INNER = Inner(values={"a": (1.0, "m")}, array=array(1.0, math.nan), status=Status.OK)


@pytest.mark.parametrize(
    "change",
    [
        {"array": array(1.0, 2.0)},
        {"array": array(1.0)},
        {"values": {"a": (1.0, "s")}},
        {"values": {"a": (math.nan, "m")}},
        {"values": {"a": (None, "m")}},
        {"values": {"b": (1.0, "m")}},
        {"values": {}},
        {"status": Status.POOR_FIT},
    ],
    ids=str,
)
def test_records_are_equal_if_their_contents_are(change: dict[str, Any]) -> None:
    other = replace(INNER, **change)
    for record in (INNER, other, Outer(inner=INNER), Outer(inner=other)):
        assert copy.deepcopy(record) == record
        assert pickle.loads(pickle.dumps(record)) == record  # noqa: S301 - its own bytes
    assert other != INNER
    assert other != INNER
    assert Outer(inner=INNER) != Outer(inner=other)
    assert Outer(inner=INNER) != INNER
    assert INNER != "text"


def test_a_missing_number_is_equal_to_one_only() -> None:
    one, other = leaf(math.nan), leaf(float("nan"))
    assert one == other
    assert hash(one) == hash(other)
    assert len({one, other, leaf(), leaf()}) == 2
    assert one != leaf()
    assert leaf() != one


def test_a_record_with_an_array_has_no_hash() -> None:
    with pytest.raises(TypeError, match="unhashable"):
        hash(INNER)


@pytest.mark.parametrize(
    ("share", "text"), [(2.1, "210 %"), (5.34, "534 %"), (0.996, "100 %"), (0.0123, "1.2 %")]
)
def test_a_share_is_a_plain_number(share: float, text: str) -> None:
    assert share_text(share) == text
