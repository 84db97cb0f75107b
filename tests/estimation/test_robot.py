"""Efforts of a robot's links, against closed forms, and the joints of logs."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from axis_logs import axis_log
from refusals import refuses

from stickslip.estimation import SelectedModelEstimator
from stickslip.estimation.robot.efforts import joint_of_each, with_model_effort
from stickslip.estimation.robot.model import read_urdf
from stickslip.records import AxisLog, MissingExtraError

G = 9.81
MASS = (2.0, 0.7)  # kg
LENGTH = 0.4  # m, of the first link
CENTRE = (0.25, 0.3)  # m, of the masses from their joints
OWN = (0.02, 0.008)  # kg m^2, about the centres
LARGEST_MODEL_ERROR = 2e-3  # of the effort; stamps of arrival 5 ms off cause 1e-2


def link(name: str, mass: float, centre: float, inertia: float) -> str:
    return f"""<link name="{name}"><inertial><origin xyz="{centre} 0 0"/><mass value="{mass}"/>
    <inertia ixx="{inertia}" iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><sphere radius="5"/></geometry></collision></link>"""


def joint(name: str, above: str, below: str, place: str, kind: str = "revolute") -> str:
    return f"""<joint name="{name}" type="{kind}"><parent link="{above}"/><child link="{below}"/>
    <origin xyz="{place}"/><axis xyz="0 -1 0"/>
    <limit lower="-0.1" upper="0.1" effort="1" velocity="1"/>
    <dynamics damping="9" friction="9"/></joint>"""


def two_links() -> str:
    """Return two links in a vertical plane, with angles from the horizontal."""
    return (
        '<robot name="double pendulum"><link name="base"/>'
        + joint("shoulder", "base", "upper", "0 0 0")
        + link("upper", MASS[0], CENTRE[0], OWN[0])
        + joint("elbow", "upper", "lower", f"{LENGTH} 0 0")
        + link("lower", MASS[1], CENTRE[1], OWN[1])
        + joint("weld", "lower", "tip", "0.5 0 0", "fixed")
        + '<link name="tip"/></robot>'
    )


def written(folder, text: str):
    path = folder / "robot.urdf"
    path.write_text(text)
    return path


def closed_form(q, v, a):
    """Torques of two links in a plane (Spong, Robot Dynamics and Control, section 6.4)."""
    (m1, m2), (c1, c2), (i1, i2) = MASS, CENTRE, OWN
    cosine, sine = np.cos(q[:, 1]), np.sin(q[:, 1])
    m22 = m2 * c2**2 + i2
    m12 = m22 + m2 * LENGTH * c2 * cosine
    m11 = m1 * c1**2 + i1 + m2 * LENGTH**2 + m22 + 2 * m2 * LENGTH * c2 * cosine
    h = -m2 * LENGTH * c2 * sine
    tip = m2 * c2 * G * np.cos(q[:, 0] + q[:, 1])
    first = (m1 * c1 + m2 * LENGTH) * G * np.cos(q[:, 0]) + tip
    return np.column_stack(
        [
            m11 * a[:, 0] + m12 * a[:, 1] + h * (2 * v[:, 0] + v[:, 1]) * v[:, 1] + first,
            m12 * a[:, 0] + m22 * a[:, 1] - h * v[:, 0] ** 2 + tip,
        ]
    )


def test_two_links_in_a_plane(tmp_path):
    robot = read_urdf(written(tmp_path, two_links()))
    assert robot.joints == {"shoulder": "rotary", "elbow": "rotary"}
    q, v, a = np.random.default_rng(1).normal(size=(3, 50, 2))
    np.testing.assert_allclose(robot.effort(q, v, a), closed_form(q, v, a), atol=1e-6)
    still, turned = np.zeros_like(q), np.tile([1.0, 0.0], (50, 1))
    own = closed_form(q, still, turned) - closed_form(q, still, still)
    assert robot.mean_inertia(q)[0] == pytest.approx(own[:, 0].mean(), rel=1e-6)


TIME = 1e-3 * np.arange(12000.0)


def motion():
    """Return position, velocity and acceleration of both joints."""
    t = TIME
    rates, phases = np.array([[1.9, 5.1], [2.7, 4.3]]), np.array([[0.1, 1.0], [2.0, 0.4]])
    sizes = np.array([[0.6, 0.15], [0.5, 0.2]])
    angle = rates[None] * t[:, None, None] + phases
    q = (sizes * np.sin(angle)).sum(2)
    v = (sizes * rates * np.cos(angle)).sum(2)
    a = -(sizes * rates**2 * np.sin(angle)).sum(2)
    return q, v, a


def joint_logs(stamps=TIME, elbow: float = 1.0) -> dict[str, AxisLog]:
    """Return logs of both joints with friction 1.5 N m and 0.8 N m s/rad, without noise.

    The motion of the elbow is multiplied by ``elbow``; below 1 its encoder is coarse.
    """
    q, v, a = motion()
    for each in (q, v, a):
        each[:, 1] *= elbow
    effort = closed_form(q, v, a) + 0.3 * a + 1.5 * np.sign(v) + 0.8 * v
    if elbow < 1.0:
        q[:, 1] = 1e-4 * np.round(q[:, 1] / 1e-4)
    return {
        name: axis_log(stamps, effort[:, k], q[:, k], name=name, kind="rotary")
        for k, name in enumerate(("elbow_motor", "shoulder_motor")[::-1])
    }


def fitted(log: AxisLog):
    return SelectedModelEstimator(effort_kind="sampled", effort_delay=0.0).fit(log)


def test_friction_of_links_that_load_each_other(tmp_path):
    robot, logs = read_urdf(written(tmp_path, two_links())), joint_logs()
    joint_of = joint_of_each(list(logs), robot.joints, {})
    assert joint_of == {"shoulder_motor": "shoulder", "elbow_motor": "elbow"}
    for log in with_model_effort(logs, robot, joint_of).values():
        estimate = fitted(log)
        assert estimate.status.value == "ok"
        assert estimate.value("coulomb_friction") == pytest.approx(1.5, rel=0.01)
        assert estimate.value("viscous_friction") == pytest.approx(0.8, rel=0.01)
    moved = with_model_effort(logs, robot, joint_of)
    own = closed_form(np.zeros((1, 2)), np.zeros((1, 2)), np.array([[0.0, 1.0]]))
    inertia = own[0, 1] - closed_form(*np.zeros((3, 1, 2)))[0, 1]
    found = fitted(moved["elbow_motor"]).value("inertia")
    assert found == pytest.approx(0.3 + inertia, rel=0.01)


def grouped(size: int):
    """Return time stamps of records that arrive in groups [s]."""
    record = np.arange(TIME.size)
    last = np.minimum(record // size * size + size - 1, record[-1])
    return TIME[last] + 2e-6 * (record % size)


@pytest.mark.parametrize("elbow", [1.0, 1e-3], ids=["moving elbow", "resting elbow"])
def test_model_effort_of_stamps_of_arrival_is_that_of_even_times(tmp_path, elbow):
    robot = read_urdf(written(tmp_path, two_links()))
    logs = joint_logs(grouped(10), elbow)
    joint_of = joint_of_each(list(logs), robot.joints, {})
    found = with_model_effort(logs, robot, joint_of)
    q, v, a = motion()
    for each in (q, v, a):
        each[:, 1] *= elbow
    effort = closed_form(q, v, a)
    for k, name in enumerate(("shoulder_motor", "elbow_motor")):
        still, turned = np.zeros_like(q), np.zeros_like(q)
        turned[:, k] = 1.0
        own = (closed_form(q, still, turned) - closed_form(q, still, still))[:, k].mean()
        expected = effort[:, k] - own * a[:, k]
        error = np.std((found[name].model_effort - expected)[200:-200])
        assert error < LARGEST_MODEL_ERROR * np.std(effort[:, 0]), (name, error)


@pytest.mark.parametrize(
    ("factor", "status", "error"), [(1 / 1.1, "ok", 0.1), (0.5, "model_mismatch", 1.0)]
)
def test_wrong_masses_show(tmp_path, factor, status, error):
    robot, logs = read_urdf(written(tmp_path, two_links())), joint_logs()
    joint_of = joint_of_each(list(logs), robot.joints, {})
    made = with_model_effort(logs, robot, joint_of)["shoulder_motor"]
    light = AxisLog(
        name=made.name, kind=made.kind, time=made.time, effort=made.effort,
        measured_position=made.measured_position, model_effort=factor * made.model_effort,
    )  # fmt: skip
    estimate = fitted(light)
    assert estimate.status.value == status
    assert estimate.value("model_error") == pytest.approx(error, rel=0.05)
    assert estimate.value("coulomb_friction") == pytest.approx(1.5, rel=0.02)


def test_gravity_of_a_payload_in_a_short_swing_is_in_the_intervals(tmp_path):
    """It looks like a spring, whose origin is not that of the offset."""
    robot = read_urdf(written(tmp_path, two_links()))
    q, v, a = motion()
    for each in (q, v, a):
        each[:, 0] *= 0.25
    q[:, 0] += 1.3
    effort = closed_form(q, v, a) + 0.3 * a + 1.5 * np.sign(v) + 0.8 * v
    effort[:, 0] += 0.3 * (LENGTH * G * np.cos(q[:, 0]) + LENGTH**2 * a[:, 0])  # of 0.3 kg
    effort += 0.02 * np.random.default_rng(0).standard_normal(effort.shape)
    logs = {
        name: axis_log(TIME, effort[:, k], q[:, k], name=name, kind="rotary")
        for k, name in enumerate(robot.joints)
    }
    made = with_model_effort(logs, robot, {name: name for name in logs})["shoulder"]
    estimate = fitted(made)
    assert "spring" in estimate.selection.selected
    assert estimate.status.value == "ok"
    for name in ("offset", "spring_stiffness"):
        low, high = estimate.parameters[name].ci95
        assert low < 0.0 < high
    assert any("gravity that the model" in note for note in estimate.diagnostics.notes)
    # Gravity on a linear axis is constant
    linear = fitted(replace(made, kind="linear"))
    assert "spring" in linear.selection.selected
    assert not any("gravity that the model" in note for note in linear.diagnostics.notes)


@pytest.mark.parametrize(
    ("axes", "joints", "found"),
    [
        (["elbow", "wrist"], ["wrist_joint", "elbow_joint"], ["elbow_joint", "wrist_joint"]),
        (["q_0", "q_1"], ["a", "b"], ["a", "b"]),
        (["2", "10"], ["first", "second"], ["first", "second"]),
        (["J1", "J11"], ["j11", "j1"], ["j1", "j11"]),
        (["left", "right"], ["left_1", "left_2"], []),
        (["x"], ["a", "b"], []),
    ],
)
def test_names_of_joints(axes, joints, found):
    assert joint_of_each(axes, joints, {}) == dict(zip(axes, found, strict=False))


def test_stated_joints():
    assert joint_of_each(["x", "y"], ["a", "b"], {"x": "b"}) == {"x": "b"}
    with refuses("joint_not_in_model"):
        joint_of_each(["x"], ["a"], {"x": "c"})
    with refuses("axis_not_found"):
        joint_of_each(["x"], ["a"], {"y": "a"})
    with refuses("joint_stated_twice"):
        joint_of_each(["x", "y"], ["a", "b"], {"x": "a", "y": "a"})


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("<robot", "not_urdf"),
        ("<mujoco/>", "not_urdf"),
        ("\0", "not_urdf"),
        ('<robot name="r"><link name="a"/></robot>', "urdf_without_joints"),
        ('<robot name="r"><link name="a"/><link name="b"/>' + joint("j", "a", "b", "0 0 0")
         + "</robot>", "urdf_joint_without_mass"),
        ('<robot name="r"><link name="a"/>' + link("b", 1, 0, 1)
         + joint("j", "a", "b", "0 0 0", "floating") + "</robot>", "urdf_joint_kind"),
        ('<robot name="r"><link name="a"/>' + joint("j", "a", "b", "0 0 0") + "</robot>",
         "urdf_refused"),
    ],
)  # fmt: skip
def test_what_is_no_robot(tmp_path, text, code):
    with refuses(code):
        read_urdf(written(tmp_path, text))


def test_without_the_library(tmp_path, monkeypatch):
    path = written(tmp_path, two_links())
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with refuses("missing_extra", MissingExtraError, extra="robot"):
        read_urdf(path)


def test_no_such_file(tmp_path):
    with refuses("no_such_file"):
        read_urdf(tmp_path / "none.urdf")


def test_logs_that_a_model_does_not_fit(tmp_path):
    robot, logs = read_urdf(written(tmp_path, two_links())), joint_logs()
    log = logs["elbow_motor"]
    columns = {"time": log.time, "effort": log.effort, "measured_position": log.measured_position}
    with refuses("model_needs_torque", unit="A"):
        amperes = AxisLog(name="e", kind="rotary", effort_unit="A", **columns)
        with_model_effort({"e": amperes}, robot, {"e": "elbow"})
    with refuses("robot_joint_of_other_kind", own="rotary"):
        with_model_effort({"e": AxisLog(name="e", kind="linear", **columns)}, robot, {"e": "elbow"})
