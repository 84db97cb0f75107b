"""The joints of a robot with a URDF file, on the command line."""

import json

import pytest
import robot_arm
import seven_joints

CLOSE = 0.03  # of friction, as in tests/tasks/test_robot.py


@pytest.mark.slow
def test_command_line(run, tmp_path):
    log = seven_joints.write_csv(tmp_path / "arm.csv", robot_arm.record(10.0))
    model = tmp_path / "arm.urdf"
    model.write_text(robot_arm.urdf())
    # The kind is that of the joints of the model
    outcome = run("identify", log, "--urdf", model, "--joint", "joint_4",
                  "--json", tmp_path / "r.json")  # fmt: skip
    assert outcome.code == 0
    document = json.loads((tmp_path / "r.json").read_text())
    friction = document["parameters"]["coulomb_friction"]["value"]
    assert friction == pytest.approx(robot_arm.COULOMB[3], rel=CLOSE)
    assert "mean posture" in " ".join(outcome.out.split())
    checked = run("inspect", log, "--check", "--urdf", model, "--joint",
                  "joint_4", "--json", tmp_path / "check.json")  # fmt: skip
    (axis,) = json.loads((tmp_path / "check.json").read_text())["axes"]
    about = {each["parameter"]: each for each in axis["expected"]}
    assert about["coulomb_friction"]["sufficient"]
    assert about["coulomb_friction"]["value"] == pytest.approx(robot_arm.COULOMB[3], rel=CLOSE)
    assert checked.code == 1  # it never rests, so that static friction is not identifiable
    assert run("identify", log, "--joint", "joint_4").code == 2
    assert run("inspect", log, "--joint", "joint_4").code == 2
    assert run("identify", log, log, "--urdf", model).code == 2
    assert run("identify", log, "--kind", "rotary", "--urdf", model, "--joint", "x").code == 2
    outcome = run("identify", log, "--kind", "rotary", "--urdf", model, "--axis", "joint_7",
                  "--estimator", "energy")  # fmt: skip
    outcome.refused("use estimator auto")


@pytest.mark.parametrize("word", ["2.5", "a@b", "2@", "@3"])
def test_known_load_that_is_not_understood(run, tmp_path, word):
    run("identify", tmp_path / "none.csv", "--known-load", word).refused("--known-load 2.5@0.3")
