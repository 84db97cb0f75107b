"""Identification as a Python user calls it, on logs in memory and in files."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from axis_logs import axis_log
from refusals import refuses
from two_sines import Motion

import stickslip
from stickslip.estimation import ESTIMATORS, DetailedEstimator, EnergyEstimator, EstimationTask
from stickslip.records import AxisLog
from stickslip.tasks import Demonstration, demonstrate, identify, json_text, write_json

MASS, COULOMB, VISCOUS = 3.0, 1.5, 4.0
CLOSE = 0.03  # relative; the velocity is differentiated from positions


@pytest.fixture
def log() -> AxisLog:
    motion = Motion(time=np.arange(4000) * 0.002)
    effort = motion.effort(mass=MASS, viscous=VISCOUS, coulomb=COULOMB)
    return axis_log(motion.time, effort, motion.position)


def test_a_log_in_memory_and_its_file_give_the_same_estimate(log: AxisLog, tmp_path: Path) -> None:
    path = tmp_path / "stage.csv"
    stickslip.write_csv(log, path)
    from_memory = identify(log).estimate
    from_file = identify(path).estimate
    assert from_memory.value("coulomb_friction") == pytest.approx(COULOMB, rel=CLOSE)
    for name in from_memory.parameters:
        assert from_file.value(name) == pytest.approx(from_memory.value(name), rel=1e-9)
    assert from_file.provenance.files == ("stage.csv",)


def test_a_mass_may_be_given_by_either_name(log: AxisLog) -> None:
    options = {"load_mass": 1.0, "stiffness": 1.0}
    first = identify(log, mass=1.0, **options).estimate
    second = identify(log, inertia=1.0, load_inertia=1.0, stiffness=1.0).estimate
    assert {n: p.value for n, p in first.parameters.items()} == {
        n: p.value for n, p in second.parameters.items()
    }
    with refuses("both_given"):
        identify(log, mass=1.0, inertia=1.0)


@pytest.mark.usefixtures("without_shape_checks")
def test_values_of_another_type_are_refused(log: AxisLog) -> None:
    wrong: Any = b"plain.csv"
    with refuses("not_a_path", found="bytes"):
        identify(wrong)
    with refuses("not_a_number", name="mass", value=True):
        identify(log, mass=True)
    for name in ("per_direction", "offset", "stribeck", "select"):
        options: dict[str, Any] = {name: "no"}
        with refuses("wrong_type", name=name, found="str"):
            identify(log, **options)


def test_a_term_may_be_given_as_one_word(log: AxisLog) -> None:
    found = identify(log, include="spring").estimate
    assert found.provenance.options["include"] == ["spring"]


def test_truth_is_shown_and_not_used(log: AxisLog) -> None:
    wrong = {"coulomb_friction": 99.0}
    found = identify(log, truth=wrong)
    assert found.truth == wrong
    assert found.estimate.to_dict() == identify(log).estimate.to_dict()


@pytest.mark.parametrize("known", ["load_inertia", "stiffness"])
def test_a_rigid_method_refuses_what_belongs_to_an_arm(known: str, log: AxisLog) -> None:
    with refuses("estimator_of_rigid_axes"):
        identify(log, estimator="idim-ls", **{known: 1.0})  # pyright: ignore[reportArgumentType]


def test_json_has_no_infinite_or_undefined_numbers(tmp_path: Path) -> None:
    document = {"a": [float("nan"), 1.5], "b": {"c": (float("-inf"), 2)}, "d": "Ω"}
    path = write_json(document, tmp_path / "a.json")
    assert json.loads(path.read_text()) == {"a": [None, 1.5], "b": {"c": [None, 2]}, "d": "Ω"}
    assert path.read_text() == json_text(document)


@pytest.fixture(scope="module")
def demonstration(tmp_path_factory: pytest.TempPathFactory) -> Demonstration:
    return demonstrate(tmp_path_factory.mktemp("demo"))


def test_the_demonstration_covers_the_truth(demonstration: Demonstration) -> None:
    truth = demonstration.identification.truth
    assert truth is not None
    estimate = demonstration.identification.estimate
    assert estimate.status.trusted
    # Noise of this size leaves 1.7 % and 3.0 % (one standard deviation) to the best of the known
    # level estimators; three of them.
    assert estimate.value("coulomb_friction") == pytest.approx(0.15, rel=0.052)
    assert estimate.value("viscous_friction") == pytest.approx(0.1, rel=0.09)
    assert "surrogate" in demonstration.setting


def test_a_demonstration_leaves_all_its_files_or_none(tmp_path: Path) -> None:
    (tmp_path / "surrogate_arm.csv").mkdir()
    with refuses("output_failed", what="the demonstration"):
        demonstrate(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["surrogate_arm.csv"]


def test_the_demonstration_draws_every_figure(demonstration: Demonstration) -> None:
    found = demonstration.identification
    for figure in ("curve", "energy", "evolution", "residuals", "resimulation"):
        assert getattr(found, figure) is not None, figure
    assert np.any(found.energy.potential), "the arm's spring stores energy"


def test_the_demonstrations_log_holds_no_truth(demonstration: Demonstration) -> None:
    log = stickslip.read_log(demonstration.log_file)
    again = identify(log, inertia=1.0, load_inertia=1.0, stiffness=1.0)
    assert again.truth is None
    assert again.estimate.value("coulomb_friction") == pytest.approx(
        demonstration.identification.estimate.value("coulomb_friction"), rel=1e-12
    )


def test_every_public_name_of_the_package_loads() -> None:
    for name in stickslip.__all__:
        assert getattr(stickslip, name) is not None
    assert set(stickslip.__all__) <= set(dir(stickslip))
    with pytest.raises(AttributeError, match="nothing"):
        _ = stickslip.nothing  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("asked", "code"),
    [
        ({}, "estimator_needs_inertia"),
        (
            {"inertia": MASS, "offset": True},
            "setting_unused",
        ),
        ({"inertia": MASS, "stribeck": True}, "setting_unused"),
        ({"inertia": MASS, "per_direction": True}, "estimator_of_equal_friction"),
    ],
)
def test_published_energy_rejects_what_it_does_not_estimate(
    asked: dict[str, Any], code: str, log: AxisLog
) -> None:
    with refuses(code):
        identify(log, estimator="published-energy", **asked)


def test_an_estimator_object_is_used_as_it_is(log: AxisLog) -> None:
    estimator = EnergyEstimator(inertia=MASS, offset=False)
    found = identify(log, estimator=estimator)
    assert found.estimate.to_dict() == estimator.fit(log).to_dict()


@pytest.mark.parametrize(
    ("name", "value"), [("inertia", MASS), ("per_direction", True), ("cutoff", 50.0)]
)
def test_settings_beside_an_estimator_object_are_rejected(
    name: str, value: Any, log: AxisLog
) -> None:
    with refuses("setting_beside_estimator"):
        identify(log, estimator=EnergyEstimator(), **{name: value})


@pytest.mark.usefixtures("without_shape_checks")
def test_an_object_that_is_no_estimator_is_rejected(log: AxisLog) -> None:
    with refuses("no_estimator_object", found="int"):
        identify(log, estimator=3)  # type: ignore[arg-type]


def test_an_unknown_estimator_is_rejected_with_the_names(log: AxisLog) -> None:
    with refuses("unknown_estimator", estimator="kalman"):
        identify(log, estimator="kalman")


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow] if name == "stribeck-energy" else [])
        for name in ESTIMATORS
    ],
)
def test_every_registered_estimator_identifies_by_name(name: str, log: AxisLog) -> None:
    if name == "free-decay":
        with refuses("no_swing"):
            identify(log, estimator=name, inertia=MASS)
        return
    found = identify(log, estimator=name, inertia=MASS)
    assert found.estimate.estimator == name
    assert found.log is log
    estimator = ESTIMATORS[name].make(EstimationTask(inertia=MASS), "linear")
    assert (found.evolution is not None) == isinstance(estimator, DetailedEstimator)


@pytest.mark.parametrize(
    ("plain", "with_step"),
    [
        pytest.param("energy", "stribeck-energy", marks=pytest.mark.slow),
        ("idim-ls", "stribeck-idim-ls"),
    ],
)
def test_the_stribeck_flag_stands_for_the_estimator_with_a_step(
    plain: str, with_step: str, log: AxisLog
) -> None:
    flagged = identify(log, estimator=plain, stribeck=True, inertia=MASS)
    named = identify(log, estimator=with_step, inertia=MASS)
    assert flagged.estimate.estimator == with_step
    assert flagged.estimate.to_dict() == named.estimate.to_dict()
