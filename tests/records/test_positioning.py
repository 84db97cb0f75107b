"""The records of a positioning task judge by the truth, and say everything in their JSON form."""

import json
from collections.abc import Mapping
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from results import make, make_arm, make_landing, make_run

from stickslip.records import ArmRun, ArmSeries, Ending, Positioning, PositioningRun

SERIES = ArmSeries(
    move=1,
    start_time=1.0,
    sampling_time=0.5,
    pulses=2,
    target=1.0,
    coulomb_friction=0.15,
    viscous_friction=0.1,
    effort=np.array([1.0, 1.0, -1.0, -1.0]),
    position=np.array([0.0, 0.2, 0.6, 0.9, 1.0]),
    load_position=np.array([0.0, 0.1, 0.5, 0.9, 1.001]),
    start_swing=0.02,
    final_position=0.98,
    final_swing=0.03,
)
ARM = ArmRun(
    target=np.array([1.0, 1.0, 1.0, 0.5, 0.5]),
    position=np.array([0.0, 0.5, 0.9, 0.9, 0.51]),
    load_position=np.array([0.0, 0.2, 1.2, 0.8, 0.49]),
    measured_position=np.array([0.1, 0.5, 0.9, 0.9, 0.5]),
    measured_load_position=np.array([0.0, 0.2, 1.2, 0.8, 0.5]),
    resting=np.array([True, False, False, True, True]),
    series=(SERIES,),
)


def ended(*endings: Ending) -> PositioningRun:
    run = make_run(1, moves=len(endings))
    moves = zip(run.moves, endings, strict=True)
    return replace(run, moves=tuple(replace(move, ending=each) for move, each in moves))


def plain(value: object) -> bool:
    if isinstance(value, Mapping):
        return type(value) is dict and all(plain(each) for each in value.values())
    if isinstance(value, list):
        return all(plain(each) for each in value)
    return value is None or type(value) in {str, int, float, bool}


def has(document: object, path: str) -> bool:
    """Return whether a table, or a table within it, has these keys."""
    if isinstance(document, list):
        return any(has(each, path) for each in document)
    if not isinstance(document, dict):
        return False
    key, _, rest = path.partition(".")
    return (key in document and (not rest or has(document[key], rest))) or any(
        has(each, path) for each in document.values()
    )


@pytest.mark.parametrize(
    ("made", "absent"), [(make(make_run(1), make_run(2)), "arm."), (make_landing(), "pulses.")]
)
def test_everything_is_in_the_json_form_as_plain_types(made: Positioning, absent: str) -> None:
    document = made.to_dict()
    assert plain(document)
    assert json.loads(json.dumps(document)) == document
    legend = document.pop("legend")
    for path in legend:
        assert path.startswith(absent) or has(document, path), path


def test_the_json_form_of_a_task_and_of_its_runs() -> None:
    document = make(make_run(1), make_run(2, ending=Ending.STUCK)).to_dict()
    assert (document["schema"], document["ending"]) == (3, "stuck")
    assert document["units"]["coulomb_friction_positive"] == "N"
    assert document["scenario"]["axis"]["mass"] == {"value": 150.0, "unit": "kg"}
    assert document["limits"] == {"static_friction_positive": [None, 173.0]}
    assert document["learned"]["method"] == "exact"
    assert document["provenance"]["input_sha256"] == "ab" * 32
    first, second = document["runs"]
    assert len(first["time"]) == len(first["error"]) == len(first["effort"]) + 1
    assert first["moves"][0]["pulses"][0]["levels"] == [[300.0, 0.03], [-120.0, 0.01]]
    assert second["moves"][0]["settling_time"] is None
    assert replace(make(), learned=None).to_dict()["learned"] is None


def test_the_json_form_of_an_arm() -> None:
    (run,) = make_landing(replace(make_arm(), arm=ARM)).to_dict()["runs"]
    assert [each["name"] for each in run["phases"]] == ["feedback", "resting", "series", "done"]
    assert run["phases"][1]["reason"] == "because <1>"
    assert run["moves"][0]["swing"] == 2.346e-5
    assert run["arm"]["series"][0]["samples"] == 4
    assert run["arm"]["series"][0]["planned_effort"] == [1.0, 1.0, -1.0, -1.0]
    assert run["arm"]["load_position"] == [0.0, 0.2, 1.2, 0.8, 0.49]


def test_a_task_ends_as_the_first_move_of_its_last_run_that_does_not_reach() -> None:
    reached, hunting, stuck = Ending.REACHED, Ending.HUNTING, Ending.STUCK
    assert make(ended(hunting), ended(reached)).ending is reached
    assert make(ended(reached), ended(reached, stuck, hunting)).ending is stuck
    assert make(ended(reached), ended(reached, hunting)).last.number == 2
    assert len(make_run(1, moves=2).pulses) == 6  # of all moves


def test_the_ending_says_why_and_names_a_remedy() -> None:
    for ending in Ending:
        assert ending.word
        assert ending.text.endswith(".")
        assert ending.reached or "; " in ending.text
    stopped = make(make_run(1, ending=Ending.STOPPED))
    assert stopped.ending_text.startswith("The controller stopped, as nothing <helps>; widen")
    assert stopped.to_dict()["ending_text"] == stopped.ending_text
    assert make(make_run(1, ending=Ending.STUCK)).ending_text == Ending.STUCK.text
    # A controller is not its own remedy
    hunting = replace(make(make_run(1, ending=Ending.HUNTING)), method="pwc")
    assert "method exact" in hunting.ending_text
    exact = replace(hunting, method="exact").ending_text
    assert exact.endswith("does not settle; give better first guesses, or a longest_width.")


@pytest.mark.parametrize(
    ("ending", "words"),
    [
        (Ending.REACHED, "Both masses stay"),
        (Ending.STUCK, "(method landing)"),
        (Ending.SWINGING, "Mass 1 rests"),
    ],
)
def test_the_ending_of_an_arm_has_its_own_words(ending: Ending, words: str) -> None:
    run = make_arm()
    moves = tuple(replace(move, ending=ending) for move in run.moves)
    assert words in make_landing(replace(run, moves=moves)).ending_text


def test_offsets_count_where_directions_are_apart() -> None:
    offset = make()
    plain = replace(offset, scenario={"axis": {"mass": (150.0, "kg")}})
    alike = replace(make_run(1), estimates={"coulomb_friction": np.ones(7)})
    assert offset.counts_offset
    assert not plain.counts_offset
    assert not replace(offset, runs=(alike,)).counts_offset


def test_nothing_can_be_changed_afterwards() -> None:
    done = make(replace(make_run(1), deviations={"mass": np.ones(7)}))
    with pytest.raises(FrozenInstanceError):
        done.name = "another"  # type: ignore[misc]
    (run,) = done.runs
    for table in (
        done.truth,
        done.first_guess_sources,
        done.scenario["axis"],
        run.estimates,
        run.deviations,
    ):
        with pytest.raises(TypeError):
            table["mass"] = 1.0  # type: ignore[index]


def test_the_error_of_an_arm_is_that_of_the_mass_that_is_farther() -> None:
    np.testing.assert_allclose(ARM.error, [1.0, 0.8, -0.2, -0.4, -0.01])
    np.testing.assert_allclose(ARM.measured_error, [1.0, 0.8, -0.2, -0.4, 0.0])


def test_a_series_knows_its_times_and_its_errors() -> None:
    assert (SERIES.duration, SERIES.end_time) == (2.0, 3.0)
    np.testing.assert_allclose(SERIES.time, [1.0, 1.5, 2.0, 2.5, 3.0])
    assert SERIES.planned_error == pytest.approx(-0.001)
    assert SERIES.final_error == pytest.approx(0.02)
    assert SERIES.final_load_error == pytest.approx(0.02 + 0.03)
    restless = replace(SERIES, final_position=None, final_swing=None)
    assert restless.final_error is restless.final_load_error is None
    assert restless.to_dict()["final_error"] is None
