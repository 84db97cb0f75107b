"""Estimates as exports read them: verdicts, sides and units."""

import json

import numpy as np
import pytest
from exports import COULOMB, INERTIA, URDF, VISCOUS, document
from refusals import refuses

from stickslip.export import EstimateReading, Transmission, axes_of
from stickslip.records import AxesIdentification, FrictionEstimate


def read(estimate, **reading):
    return axes_of(estimate, EstimateReading(**reading))[""]


@pytest.fixture(scope="module")
def identification():
    """Return the identification of a simulated axis."""
    from stickslip import CoulombViscousFriction, Sensors, SingleMass, identify, simulate

    law = CoulombViscousFriction.symmetric(coulomb_friction=COULOMB, viscous_friction=VISCOUS)
    plant = SingleMass(mass=INERTIA, friction=law, kind="rotary")
    effort = 2.0 * np.sign(np.sin(np.arange(0.0, 6.0, 0.002) * 5.0))
    motion = simulate(plant, effort, sampling_time=0.002)
    log = Sensors(position_noise=1e-5).measure(motion, np.random.default_rng(1))
    return identify(log)


@pytest.fixture(scope="module")
def identified(identification):
    assert isinstance(identification.estimate, FrictionEstimate)
    return identification.estimate


def test_the_axes_of_a_robot_are_exported_and_those_without_an_estimate_named(identification):
    from stickslip.export import render

    robot = AxesIdentification(
        name="arm", axes={"elbow": identification}, unread={"slide": "the column is constant"}
    )
    result = render(robot, "urdf", into=URDF)
    assert not result.complete
    assert result.warnings == ("slide is not written: the column is constant",)
    one = render(identification, "urdf", into=URDF, joint="elbow")
    assert one.complete
    assert one.rendered.files == result.rendered.files
    elbow = EstimateReading(axis="elbow")
    assert render(robot, "urdf", into=URDF, reading=elbow).complete
    with refuses("unknown_axis", axis="slide", choices=("elbow",)):
        render(robot, "urdf", into=URDF, reading=EstimateReading(axis="slide"))


def test_an_estimate_its_document_and_its_file_give_the_same(identified, tmp_path):
    path = tmp_path / "axis.json"
    path.write_text(json.dumps(identified.to_dict()))
    by_record, by_document, by_file = map(read, (identified, identified.to_dict(), path))
    assert dict(by_record.values) == dict(by_document.values) == dict(by_file.values)
    assert by_record.values["coulomb_friction"] == pytest.approx(COULOMB, rel=0.01)
    assert np.array_equal(by_record.covariance, identified.covariance)
    assert by_file.source.file == "axis.json"


def test_a_given_inertia_is_taken_from_the_options():
    estimate = document(inertia="absent")
    estimate["provenance"]["options"]["inertia"] = 0.07
    found = read(estimate)
    assert found.inertia == 0.07
    assert "inertia" in found.given
    assert "inertia" not in found.std
    estimate["provenance"]["options"]["load_inertia"] = 0.1  # of a flexible arm
    assert read(estimate).inertia is None


def test_parameters_of_one_log_are_withheld():
    found = read(document() | {"parameters": document()["parameters"]})
    assert found.withheld == {}
    estimate = document()
    estimate["parameters"]["offset[morning]"] = {
        "value": 0.1,
        "std": 0.01,
        "ci95": [0.08, 0.12],
        "unit": "N m",
    }
    found = read(estimate)
    assert "offset[morning]" not in found.values
    assert "of_log" in found.withheld["offset[morning]"]


@pytest.mark.parametrize("status", ["poor_fit", "unphysical", "biased", "model_mismatch"])
def test_a_status_withholds_everything(status):
    found = read(document(status=status))
    assert dict(found.values) == {}
    assert all(status in reason for reason in found.withheld.values())
    forced = read(document(status=status), force=True)
    assert (
        set(forced.forced)
        == set(forced.values)
        == {
            "inertia",
            "viscous_friction",
            "coulomb_friction",
        }
    )


def test_force_invents_no_value():
    found = read(document(offset=None), force=True)
    assert "offset" not in found.values
    assert found.withheld["offset"] == "it moves one way only"


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"schema": 99}, "other_schema"),
        ({"kind": "round"}, "estimate_value"),
        ({"status": "fine"}, "estimate_value"),
        ({"parameters": []}, "not_an_estimate"),
        ({"parameters": {"mass_of_the_moon": {"value": 1.0}}}, "estimate_value"),
        ({"parameters": {"offset": {"value": "big", "unit": "N m"}}}, "estimate_value"),
        ({"parameters": {"offset": {"value": True, "unit": "N m"}}}, "estimate_value"),
        ({"parameters": {"offset": {"value": 1.0, "unit": "N"}}}, "estimate_unit"),
        ({"axes": {}}, "not_an_estimate"),
        ({"axes": {"a": 3}}, "not_an_estimate"),
    ],
)
def test_what_is_no_estimate_is_refused(change, code):
    with refuses(code):
        read(document() | change)


@pytest.mark.parametrize("name", ["schema", "kind", "status", "parameters"])
def test_a_missing_key_is_named(name):
    estimate = document()
    del estimate[name]
    with refuses("not_an_estimate", name=name):
        read(estimate)


@pytest.mark.parametrize("ratio", [7.0, -7.0])
def test_there_and_back_is_the_same(ratio):
    estimate = document(
        offset=0.1,
        coulomb_friction="absent",
        coulomb_friction_positive=0.6,
        coulomb_friction_negative=0.4,
        stribeck_velocity=0.05,
    )
    motor = read(estimate, transmission=Transmission(side="motor", gear_ratio=ratio))
    joint = motor.on("joint")
    assert joint.values["coulomb_friction_positive"] == pytest.approx(
        7.0 * (0.6 if ratio > 0 else 0.4)
    )
    assert joint.values["offset"] == pytest.approx(ratio * 0.1)
    assert joint.values["viscous_friction"] == pytest.approx(49.0 * VISCOUS)
    assert joint.values["stribeck_velocity"] == pytest.approx(0.05 / 7.0)
    assert joint.ci95["offset"] == pytest.approx(sorted((ratio * 0.098, ratio * 0.102)))
    back = joint.on("motor")
    assert dict(back.values) == pytest.approx(dict(motor.values))
    # Power is equal on both sides of the gear
    speed = 3.0
    friction = 0.6 + VISCOUS * speed
    other = joint.values["coulomb_friction_positive" if ratio > 0 else "coulomb_friction_negative"]
    slow = speed / 7.0
    assert (other + joint.values["viscous_friction"] * slow) * slow == pytest.approx(
        friction * speed
    )


def test_the_covariance_is_scaled_with_the_values():
    estimate = document()
    covariance = np.array(estimate["covariance"])
    covariance[1, 2] = covariance[2, 1] = 1e-6
    estimate["covariance"] = covariance.tolist()
    joint = read(estimate, transmission=Transmission(side="motor", gear_ratio=7.0)).on("joint")
    places = [joint.uncertain.index(n) for n in ("viscous_friction", "coulomb_friction")]
    assert joint.covariance[tuple(places)] == pytest.approx(49.0 * 7.0 * 1e-6)
    assert np.sqrt(np.diag(joint.covariance)) == pytest.approx(
        [joint.std[name] for name in joint.uncertain]
    )


@pytest.mark.parametrize("ratio", [0.0, float("inf"), float("nan")])
def test_a_ratio_that_is_none_is_refused(ratio):
    with refuses("gear_ratio_zero"):
        Transmission(gear_ratio=ratio)


def test_an_offset_within_its_uncertainty_is_not_mentioned():
    estimate = document(offset=0.01)
    cannot = {"offset": "is left out"}
    assert read(estimate).omissions("X", (), cannot) != ()
    estimate["parameters"]["offset"]["std"] = 0.02
    found = read(estimate).omissions("X", ("coulomb_friction", "viscous_friction"), cannot)
    assert found == ()
