"""All axes of a log in one call: a bag of seven MuJoCo joints, and the parts that need no fit."""

import json

import numpy as np
import pytest
import robot_arm
import seven_joints
from message_files import write_robot

from stickslip.logs import AxisSchema, LogSchema
from stickslip.presentation import write_report
from stickslip.records import InputError
from stickslip.tasks import axes_validated, identify_axes
from stickslip.tasks.axes import axes_at, kind_of_joints

pytestmark = pytest.mark.slow
FLAG = LogSchema(kind="rotary")


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("robot") / "robot.mcap"
    return write_robot(path, seven_joints.JOINTS, seven_joints.record())


@pytest.fixture(scope="module")
def found(file):
    done = []
    result = identify_axes(file, schema=FLAG, progress=lambda *each: done.append(each))
    assert sorted(each[0] for each in done) == sorted(seven_joints.JOINTS)
    assert [each[1:] for each in done] == [(k, 7) for k in range(1, 8)]
    return result


def test_every_joint_is_inside_its_interval(found):
    assert list(found.axes) == list(seven_joints.JOINTS)
    assert found.trusted
    truth = {
        "inertia": seven_joints.INERTIA,
        "coulomb_friction": seven_joints.COULOMB,
        "viscous_friction": seven_joints.VISCOUS,
    }
    for k, name in enumerate(seven_joints.JOINTS):
        for parameter, values in truth.items():
            estimate = found.axes[name].estimate.parameters[parameter]
            low, high = estimate.ci95
            assert low <= values[k] <= high, (name, parameter)
            assert high - low < 0.05 * values[k], (name, parameter)


def test_a_process_finds_what_this_one_does(found, file):
    from stickslip.tasks import identify

    alone = identify(file, schema=FLAG, axis="elbow").estimate
    assert alone.to_dict()["parameters"] == found.axes["elbow"].estimate.to_dict()["parameters"]


def test_json_and_page(found, tmp_path):
    document = json.loads(json.dumps(found.to_dict()))
    assert list(document["axes"]) == list(seven_joints.JOINTS)
    assert document["axes"]["wrist"]["parameters"]["inertia"]["unit"] == "kg m^2"
    text = write_report(found, tmp_path / "robot.html").read_text()
    for name in seven_joints.JOINTS:
        assert f"<h2>Axis {name}</h2>" in text
    anchors = [part.split('"')[0] for part in text.split('class="plot" id="')[1:]]
    assert len(anchors) == len(set(anchors)) >= 7


def test_validation_on_another_log(found, tmp_path):
    other = seven_joints.write_csv(tmp_path / "other.csv", seven_joints.record(6.0, seed=2))
    checked = axes_validated(found, axes_at(other, FLAG), "other.csv")
    errors = [each.validation.error for each in checked.axes.values()]
    assert max(errors) < 0.03
    assert checked.to_dict()["axes"]["base"]["validation"]["log"] == "other.csv"
    logs = axes_at(other, FLAG)
    shifted = {
        **logs,
        "wrist": InputError("axis_not_found", axis="wrist", axes=[]),
    }
    reasons = axes_validated(found, shifted, "other.csv").axes["wrist"].validation
    assert reasons.error is None
    assert "there is no axis 'wrist'" in reasons.reason


def test_part_of_the_log(file):
    columns = AxisSchema(kind="rotary", start_time=2.0, end_time=5.0)
    log = axes_at(file, None, columns)["base"]
    np.testing.assert_allclose([log.time[0], log.time[-1]], [2.0, 5.0], atol=1e-6)
    assert any("of 11.998 s" in each for each in log.source.assumptions)
    with pytest.raises(InputError) as caught:
        axes_at(file, None, AxisSchema(kind="rotary", start_time=50.0))
    assert caught.value.code == "range_empty"


@pytest.mark.parametrize(
    ("joints", "kind"),
    [
        ((), None),
        (("joint_7",), "linear"),
        (("joint_1", "j2=joint_2"), "rotary"),
        (("joint_1", "joint_7"), None),
    ],
)
def test_the_kind_of_joints_is_none_if_kinds_differ(joints, kind, tmp_path):
    model = tmp_path / "arm.urdf"
    last = '<joint name="joint_7" type="'
    model.write_text(robot_arm.urdf().replace(f"{last}revolute", f"{last}prismatic"))
    assert kind_of_joints(model, joints) == kind
