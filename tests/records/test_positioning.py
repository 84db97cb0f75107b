"""The record of a positioning task says everything in its JSON form, in plain types."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from stickslip.records import (
    Ending,
    LearnedPulses,
    Positioning,
    PositioningMove,
    PositioningRun,
    PulseRecord,
)


def move(number: int, ending: Ending) -> PositioningMove:
    return PositioningMove(
        number=number,
        start_time=1.0 * (number - 1),
        end_time=1.0 * number,
        start=0.0,
        target=0.01,
        ending=ending,
        reason=None if ending.reached else "nothing helps",
        final_error=1e-6,
        late_errors=(-1e-6, 2e-6),
        settling_time=0.25 if ending.reached else None,
        peak_effort=300.0,
        pulses=(
            PulseRecord(
                time=0.0,
                levels=((300.0, 0.03), (-150.0, 0.01)),
                error=0.01,
                predicted_displacement=0.0101,
                achieved_displacement=0.00999,
                moved=True,
            ),
        ),
    )


def run(number: int, endings: Sequence[Ending] = (Ending.REACHED,)) -> PositioningRun:
    time = np.linspace(0.0, 1.0 * len(endings), 11)
    return PositioningRun(
        number=number,
        time=time,
        error=0.01 - 0.005 * time,
        measured_error=0.01 - 0.005 * time,
        effort=np.linspace(300.0, 0.0, 10),
        estimate_time=np.array([0.0, 0.3]),
        estimates={"pulse_gain": np.array([2.75, 2.0])},
        moves=tuple(move(k + 1, each) for k, each in enumerate(endings)),
    )


def positioning(*runs: PositioningRun) -> Positioning:
    return Positioning(
        name="a task",
        kind="linear",
        method="pwc",
        controller="adaptive pulse width control",
        tolerance=2e-5,
        scenario={"axis": {"mass": (150.0, "kg")}, "task": {"targets": ([0.01], "m")}},
        truth={"pulse_gain": 2.0},
        believed={"mass": "the scenario"},
        runs=runs or (run(1),),
        limits={"static_friction_positive": (None, 173.0)},
        learned=LearnedPulses(
            method="pwc",
            kind="linear",
            values={"pulse_gain": 2.0, "effort": 300.0},
            covariance=np.eye(1),
        ),
        notes=("a note",),
        file="task.toml",
        sha256="ab" * 32,
        stickslip_version="1.2.3",
    )


def plain(value: object) -> bool:
    if isinstance(value, Mapping):
        return type(value) is dict and all(plain(each) for each in value.values())
    if isinstance(value, list):
        return all(plain(each) for each in value)
    return value is None or type(value) in {str, int, float, bool}


def test_everything_is_in_the_json_form_as_plain_types() -> None:
    document = positioning(run(1), run(2, (Ending.HUNTING,))).to_dict()
    assert plain(document)
    assert json.loads(json.dumps(document)) == document
    assert document["schema"] == 2
    assert document["ending"] == "hunting"
    assert document["units"]["pulse_gain"] == "m/s^2"
    assert document["scenario"]["axis"]["mass"] == {"value": 150.0, "unit": "kg"}
    assert document["limits"] == {"static_friction_positive": [None, 173.0]}
    assert document["learned"]["method"] == "pwc"
    assert document["provenance"]["input_sha256"] == "ab" * 32
    first, second = document["runs"]
    assert len(first["time"]) == len(first["error"]) == len(first["effort"]) + 1
    assert first["estimates"] == {"pulse_gain": [2.75, 2.0]}
    assert first["moves"][0]["pulses"][0]["levels"] == [[300.0, 0.03], [-150.0, 0.01]]
    assert second["moves"][0]["settling_time"] is None
    assert second["moves"][0]["reason"] == "nothing helps"


def test_a_task_ends_as_the_first_move_of_its_last_run_that_does_not_reach() -> None:
    reached, hunting, stuck = Ending.REACHED, Ending.HUNTING, Ending.STUCK
    assert positioning(run(1, (hunting,)), run(2)).ending is reached
    assert positioning(run(1), run(2, (reached, stuck, hunting))).ending is stuck
    assert positioning(run(1), run(2, (reached, hunting))).last.number == 2


def test_a_controller_that_stopped_says_why() -> None:
    done = positioning(run(1, (Ending.STOPPED,)))
    assert done.ending_text.startswith("The controller stopped, as nothing helps; widen")
    assert done.to_dict()["ending_text"] == done.ending_text
    assert positioning(run(1, (Ending.STUCK,))).ending_text == Ending.STUCK.text


def test_a_controller_is_not_its_own_remedy() -> None:
    hunting = positioning(run(1, (Ending.HUNTING,)))
    assert "method exact" in hunting.ending_text
    exact = replace(hunting, method="exact").ending_text
    assert "method exact" not in exact
    assert exact.endswith("does not settle; give better first guesses, or a longest_width.")


def test_offsets_count_where_directions_are_apart() -> None:
    plain = positioning(run(1))
    offset = replace(plain, scenario={"axis": {"offset": (5.0, "N")}})
    apart = replace(run(1), estimates={"coulomb_friction_positive": np.array([1.0, 2.0])})
    assert not plain.counts_offset
    assert not offset.counts_offset
    assert replace(offset, runs=(apart,)).counts_offset
    assert not replace(plain, runs=(apart,)).counts_offset


def test_every_ending_names_what_happened_and_a_remedy() -> None:
    for ending in Ending:
        assert ending.word
        assert ending.text.endswith(".")
        assert ending.reached or "; " in ending.text


def test_nothing_can_be_changed_afterwards() -> None:
    done = positioning()
    with pytest.raises(FrozenInstanceError):
        done.name = "another"  # type: ignore[misc]
    for table in (done.truth, done.believed, done.scenario["axis"], done.runs[0].estimates):
        with pytest.raises(TypeError):
            table["mass"] = 1.0  # type: ignore[index]


def test_without_anything_learned_there_is_null() -> None:
    assert replace(positioning(), learned=None).to_dict()["learned"] is None


def test_pulses_of_a_run_are_those_of_all_its_moves() -> None:
    assert len(run(1, (Ending.REACHED, Ending.REACHED)).pulses) == 2
