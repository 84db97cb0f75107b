"""The joints of a robot with a URDF file, on the command line."""

import json

import pytest
import robot_arm
import seven_joints

pytestmark = pytest.mark.slow

CLOSE = 0.03  # of friction, as in tests/tasks/test_robot.py


def test_command_line(run, tmp_path):
    log = seven_joints.write_csv(tmp_path / "arm.csv", robot_arm.record(10.0))
    model = tmp_path / "arm.urdf"
    model.write_text(robot_arm.urdf())
    outcome = run("identify", log, "--kind", "rotary", "--urdf", model, "--joint", "joint_4",
                  "--json", tmp_path / "r.json")  # fmt: skip
    assert outcome.code == 0
    document = json.loads((tmp_path / "r.json").read_text())
    friction = document["parameters"]["coulomb_friction"]["value"]
    assert friction == pytest.approx(robot_arm.COULOMB[3], rel=CLOSE)
    assert "mean posture" in " ".join(outcome.out.split())
    assert run("identify", log, "--joint", "joint_4").code == 2
    assert run("identify", log, log, "--urdf", model).code == 2
    assert run("identify", log, "--kind", "rotary", "--urdf", model, "--joint", "x").code == 2
    outcome = run("identify", log, "--kind", "rotary", "--urdf", model, "--axis", "joint_7",
                  "--estimator", "energy")  # fmt: skip
    assert outcome.code == 2
    assert "use estimator auto" in outcome.line()
