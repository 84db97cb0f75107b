"""``stickslip export``: files, what is printed, and exit codes."""

import json

import pytest
from exports import MJCF, URDF, document


@pytest.fixture
def estimate(tmp_path):
    def write(**changes):
        path = tmp_path / "elbow.json"
        path.write_text(json.dumps(document(**changes)))
        return path

    return write


@pytest.fixture
def robot(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(URDF)
    return path


def test_a_file_is_edited_and_what_is_left_out_is_printed(run, estimate, robot, tmp_path):
    out = tmp_path / "out.urdf"
    arguments = ("--into", robot, "--joint", "elbow", "--out", out)
    done = run("export", "urdf", estimate(offset=0.3), *arguments)
    assert done.code == 0
    assert "Offset (0.3 N m) is left out" in done.out
    assert "Offset (0.3 N m) is left out" in out.read_text()
    assert 'damping="0.2"' in out.read_text()
    assert robot.read_text() == URDF
    # Into the file itself
    again = run("export", "urdf", estimate(), "--into", robot, "--joint", "elbow", "--out", robot)
    assert again.code == 0
    assert 'damping="0.2"' in robot.read_text()


def test_every_target_is_listed(run):
    from stickslip.export import targets

    done = run("export", "--list")
    assert done.code == 0
    for name, title in targets().items():
        assert any(
            line.startswith(name + " ") and line.endswith(title) for line in done.out.splitlines()
        )


def test_a_withheld_parameter_gives_exit_code_1(run, estimate, tmp_path):
    out = tmp_path / "out.py"
    path = estimate(status="not_identifiable", viscous_friction=None)
    done = run("export", "genesis", path, "--joint", "elbow", "--out", out)
    assert done.code == 1
    assert "viscous friction is not written: it moves one way only" in done.err
    assert '"damping"' not in out.read_text()


def test_force_gives_exit_code_1_and_a_warning(run, estimate, tmp_path):
    out = tmp_path / "out.py"
    run("export", "genesis", estimate(status="poor_fit"), "--out", out).refused("--force")
    assert not out.exists()
    forced = run("export", "genesis", estimate(status="poor_fit"), "--out", out, "--force")
    assert forced.code == 1
    assert "by force" in forced.err
    assert "WARNING" in out.read_text()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("urdf", "--into", "{robot}", "--joint", "elbov"), "'elbow'"),
        (("urdf", "--into", "{robot}", "--joint", "slide"), "revolute"),
        (("urdf", "--into", "{robot}", "--joint", "elbow", "--points", "3"), "--points"),
        (("urdf", "--joint", "elbow"), "--into"),
        (("urdf", "--into", "{folder}/none.urdf", "--joint", "elbow"), "none.urdf"),
        (("urdf", "--into", "{folder}", "--joint", "elbow"), "the file cannot be read"),
        (("urdv", "--joint", "elbow"), "'urdf'"),
        (("ax8000",), "--gear-ratio"),
        (("ax8000", "--gear-ratio", "0"), "--gear-ratio is 0"),
        (("table",), "--top-speed"),
        (("table", "--top-speed", "-1"), "--top-speed"),
        (("genesis", "--axis", "knee"), "--axis is 'knee'"),
        (("mjcf", "--into", "{robot}", "--joint", "elbow"), "the file is URDF"),
    ],
)
def test_bad_input_is_one_line_with_a_remedy(run, estimate, robot, tmp_path, arguments, says):
    places = {"robot": str(robot), "folder": str(tmp_path)}
    target, *others = (each.format(**places) for each in arguments)
    out = tmp_path / "out"
    run("export", target, estimate(), *others, "--out", out).refused(says)
    assert not out.exists()


def test_existing_values_are_shown_beside_the_new_ones(run, estimate, tmp_path):
    robot = tmp_path / "arm.xml"
    robot.write_text(MJCF.replace('name="elbow"', 'name="elbow" damping="3"'))
    arguments = ("--into", robot, "--joint", "elbow", "--out", robot)
    run("export", "mjcf", estimate(), *arguments).refused("damping 3 -> 0.2", "--overwrite")
    assert 'damping="3"' in robot.read_text()
    assert run("export", "mjcf", estimate(), *arguments, "--overwrite").code == 0
    assert 'damping="0.2"' in robot.read_text()


def test_missing_arguments_are_named(run, estimate):
    for arguments, says in (((), "a target"), (("urdf",), "an estimate")):
        run("export", *arguments).refused(says)
    run("export", "urdf", estimate()).refused("--out")


def test_a_whole_robot_maps_axes_onto_joints(run, robot, tmp_path):
    estimate, out = tmp_path / "robot.json", tmp_path / "out.urdf"
    axes = {"elbow": document(), "slide": document("linear", viscous_friction=3.5)}
    estimate.write_text(json.dumps({"axes": axes}))
    done = run("export", "urdf", estimate, "--into", robot, "--out", out)
    assert done.code == 0
    assert 'damping="0.2"' in out.read_text()
    assert 'damping="3.5"' in out.read_text()
    axes["knee"] = document()
    estimate.write_text(json.dumps({"axes": axes}))
    run("export", "urdf", estimate, "--into", robot, "--out", out).refused("knee")
    one = run("export", "urdf", estimate, "--axis", "slide", "--into", robot, "--out", out)
    assert one.code == 0
    assert 'damping="0.2"' not in out.read_text()
    named = run("export", "urdf", estimate, "--joint", "elbow", "--into", robot, "--out", out)
    named.refused("--axis")
