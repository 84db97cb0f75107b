"""The record of a flexible arm judges by the mass that is farther, and says everything as JSON."""

import json
from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from stickslip.records import (
    ArmRun,
    ArmSeries,
    Ending,
    LandingPhase,
    Positioning,
    PositioningMove,
    PositioningRun,
)

TIME = np.linspace(0.0, 4.0, 5)


def series(**changes: object) -> ArmSeries:
    given: dict[str, object] = {
        "move": 1,
        "start_time": 1.0,
        "sampling_time": 0.5,
        "pulses": 2,
        "target": 1.0,
        "coulomb_friction": 0.15,
        "viscous_friction": 0.1,
        "effort": np.array([1.0, 1.0, -1.0, -1.0]),
        "position": np.array([0.0, 0.2, 0.6, 0.9, 1.0]),
        "load_position": np.array([0.0, 0.1, 0.5, 0.9, 1.001]),
        "start_swing": 0.02,
        "final_position": 0.98,
        "final_swing": 0.03,
    }
    return ArmSeries(**(given | changes))  # type: ignore[arg-type]


def arm() -> ArmRun:
    return ArmRun(
        target=np.array([1.0, 1.0, 1.0, 0.5, 0.5]),
        position=np.array([0.0, 0.5, 0.9, 0.9, 0.51]),
        load_position=np.array([0.0, 0.2, 1.2, 0.8, 0.49]),
        measured_position=np.array([0.1, 0.5, 0.9, 0.9, 0.5]),
        measured_load_position=np.array([0.0, 0.2, 1.2, 0.8, 0.5]),
        resting=np.array([True, False, False, True, True]),
        series=(series(),),
    )


def positioning(ending: Ending) -> Positioning:
    flexible = arm()
    move = PositioningMove(
        number=1,
        start_time=0.0,
        end_time=4.0,
        start=0.0,
        target=1.0,
        ending=ending,
        reason=None,
        final_error=-0.01,
        late_errors=(-0.3, 0.1),
        settling_time=None,
        peak_effort=1.0,
        pulses=(),
        swing=0.03,
    )
    run = PositioningRun(
        number=1,
        time=TIME,
        error=flexible.error,
        measured_error=flexible.measured_error,
        effort=np.ones(4),
        estimate_time=np.array([0.0, 2.0]),
        estimates={"coulomb_friction": np.array([0.0, 0.15])},
        moves=(move,),
        arm=flexible,
        phases=(
            LandingPhase(name="feedback", start_time=0.0, end_time=1.0, reason="the target is new"),
            LandingPhase(name="series", start_time=1.0, end_time=3.0, reason="a series was found"),
            LandingPhase(name="done", start_time=3.0, end_time=4.0, reason="it rests"),
        ),
        deviations={"coulomb_friction": np.array([0.2, 0.1])},
    )
    return Positioning(
        name="an arm",
        kind="linear",
        method="landing",
        controller="feedback, then series of pulses",
        tolerance=1e-3,
        scenario={"axis": {"stiffness": (1.0, "N/m")}},
        truth={"coulomb_friction": 0.15},
        believed={"load_mass": "the axis, taken as known"},
        runs=(run,),
        limits={},
        learned=None,
        file="arm.toml",
        sha256="ab" * 32,
        stickslip_version="1.2.3",
    )


def test_the_error_is_that_of_the_mass_that_is_farther() -> None:
    np.testing.assert_allclose(arm().error, [1.0, 0.8, -0.2, -0.4, -0.01])
    np.testing.assert_allclose(arm().measured_error, [1.0, 0.8, -0.2, -0.4, 0.0])


def test_a_series_tells_what_it_missed_by() -> None:
    each = series()
    assert each.duration == 2.0
    assert each.end_time == 3.0
    np.testing.assert_allclose(each.time, [1.0, 1.5, 2.0, 2.5, 3.0])
    assert each.planned_error == pytest.approx(-0.001)
    assert each.final_error == pytest.approx(0.02)
    assert each.final_load_error == pytest.approx(0.02 + 0.03)


def test_a_series_without_a_rest_after_it_has_no_outcome() -> None:
    each = series(final_position=None, final_swing=None)
    assert each.final_error is None
    assert each.final_load_error is None
    assert each.to_dict()["final_error"] is None


def test_everything_of_an_arm_is_in_the_json_form() -> None:
    document = positioning(Ending.REACHED).to_dict()
    text = json.dumps(document)
    assert json.loads(text) == document
    run = document["runs"][0]
    assert [each["name"] for each in run["phases"]] == ["feedback", "series", "done"]
    assert run["phases"][1]["reason"] == "a series was found"
    assert run["deviations"] == {"coulomb_friction": [0.2, 0.1]}
    flexible = run["arm"]
    assert flexible["series"][0]["samples"] == 4
    assert flexible["series"][0]["planned_effort"] == [1.0, 1.0, -1.0, -1.0]
    assert flexible["load_position"] == [0.0, 0.2, 1.2, 0.8, 0.49]
    assert document["runs"][0]["moves"][0]["swing"] == 0.03
    for key in ("swing", "arm", "arm.series.final_error"):
        assert key in document["legend"]


def test_the_ending_of_an_arm_is_told_in_its_own_words() -> None:
    assert positioning(Ending.REACHED).ending_text.startswith("Both masses")
    assert "landing" in positioning(Ending.STUCK).ending_text
    assert "Mass 1 rests" in positioning(Ending.SWINGING).ending_text


def test_an_arms_record_cannot_be_changed() -> None:
    (run,) = positioning(Ending.REACHED).runs
    with pytest.raises(FrozenInstanceError):
        run.phases = ()  # type: ignore[misc]
    with pytest.raises(TypeError):
        run.deviations["mass"] = np.zeros(2)  # type: ignore[index]
