"""Contents and reading of a log."""

import json

import numpy as np
import pytest
from axis_logs import axis_log

from stickslip.logs import AxisSchema, LogSchema, read_axes, read_log, read_schema
from stickslip.records import AxisLog, InputError
from stickslip.tasks import inspect, write_schema
from stickslip.tasks.inspection import effort_lag

TIME = np.arange(4000) * 0.002
V = 1.5 * np.sin(2 * TIME) + np.sin(5 * TIME)
Q = -0.75 * np.cos(2 * TIME) - 0.2 * np.cos(5 * TIME)
U = 0.3 * (3 * np.cos(2 * TIME) + 5 * np.cos(5 * TIME)) + 0.5 * np.sign(V) + 0.2 * V


def write(path, columns):
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    path.write_text("\n".join([",".join(columns), *(",".join(map(repr, r)) for r in rows), ""]))
    return path


@pytest.fixture
def robot(tmp_path):
    clipped = np.clip(U, -1.2, 1.2)
    return write(tmp_path / "robot.csv", {
        "time [ms]": TIME * 1e3, "elbow_pos [deg]": np.rad2deg(Q), "elbow_torque [Nm]": U,
        "wrist_pos [deg]": np.rad2deg(Q), "wrist_torque [Nm]": clipped,
        "wrist_target [deg]": Q, "grip_pos [deg]": Q, "temperature [degC]": 20 + 0 * TIME,
    })  # fmt: skip


def test_columns_and_axes(robot):
    found = inspect(robot)
    assert found.trusted
    assert found.rates[""] == pytest.approx(500.0)
    columns = {each.name: each for each in found.columns}
    assert columns["elbow_pos"].unit == "deg"
    assert columns["elbow_pos"].meaning == "position of elbow"
    assert columns["elbow_pos"].high == pytest.approx(np.rad2deg(Q.max()))
    assert columns["temperature"].meaning == ""
    assert columns["temperature"].low == columns["temperature"].high == 20.0
    assert [each.name for each in found.axes] == ["elbow", "wrist"]
    elbow, wrist = found.axes
    assert elbow.columns["effort"] == "elbow_torque"
    assert elbow.clipped == 0.0
    share = np.mean((np.abs(U[1:]) >= 1.2) & (np.abs(U[:-1]) >= 1.2))
    assert wrist.clipped == pytest.approx(share, abs=2e-3)
    assert (elbow.samples, elbow.segments) == (4000, 1)
    assert json.loads(json.dumps(found.to_dict()))["axes"][1]["columns"]["position"] == "wrist_pos"


def test_a_square_wave_is_not_clipped(tmp_path):
    columns = {"time": TIME, "position": Q, "effort": np.where(U > 0.0, 10.0, -10.0)}
    (axis,) = inspect(write(tmp_path / "switched.csv", columns)).axes
    assert axis.clipped == 0.0


def test_what_is_missing_is_a_result(tmp_path):
    path = write(tmp_path / "log.csv", {"t": TIME, "angle": Q, "temperature": TIME})
    found = inspect(path)
    assert not found.trusted
    (axis,) = found.axes
    assert axis.problem.startswith("no column is obviously the effort")  # below the file's name


def test_a_written_schema_reads_the_same(robot, tmp_path):
    path = write_schema(robot, tmp_path / "robot.toml", LogSchema())
    assert list(read_schema(path).axes) == ["elbow", "wrist"]
    with_schema, without = read_axes(robot, path), read_axes(robot)
    for name, log in without.items():
        np.testing.assert_array_equal(with_schema[name].effort, log.effort)
        np.testing.assert_array_equal(with_schema[name].time, log.time)
        np.testing.assert_array_equal(with_schema[name].measured_position, log.measured_position)


@pytest.mark.parametrize(
    "names",
    [
        ("time", "q_0", "dq_0", "tau_0"),
        ("timestamp", "actual_q_0", "actual_qd_0", "actual_current_0"),
        ("__time", "elbow/position", "elbow/velocity", "elbow/torque"),
        ("t [ms]", "position_rev", "velocity_rev_s", "torque_Nm"),
    ],
)
def test_a_written_schema_has_what_names_imply(names, tmp_path):
    scale = 1e3 if "[ms]" in names[0] else 1.0
    log = write(tmp_path / "log.csv", dict(zip(names, (TIME * scale, Q, V, U), strict=True)))
    read, again = (
        next(iter(read_axes(log, each).values()))
        for each in (None, write_schema(log, tmp_path / "log.toml", LogSchema()))
    )
    assert (read.kind, read.effort_unit) == (again.kind, again.effort_unit)
    for channel in ("time", "effort", "measured_position"):
        np.testing.assert_array_equal(getattr(read, channel), getattr(again, channel))


def test_a_written_schema_of_one_axis_with_odd_names(tmp_path):
    columns = {"t [s]": TIME, 'motor "A" angle [deg]': np.rad2deg(Q), "torque [Nm]": U}
    log = write(tmp_path / "log.csv", {k.replace('"', ""): v for k, v in columns.items()})
    stated = LogSchema(units={"effort": "mNm"}, torque_constant=None, name="a = 'b'\\\"c\"")
    path = write_schema(log, tmp_path / "log.toml", stated)
    assert read_schema(path).name == stated.name
    assert read_log(log, path).effort[5] == pytest.approx(1e-3 * U[5])


@pytest.mark.parametrize("lag", [0, 3, 12])
def test_lag_of_the_effort(lag):
    generator = np.random.default_rng(4)
    # Held over a sample, an effort acts half a step later than its stamp
    now = np.interp(TIME + 0.001 + lag * 0.002, TIME, U)
    log = axis_log(
        TIME,
        now + generator.normal(scale=0.02, size=TIME.size),
        Q + generator.normal(scale=1e-5, size=TIME.size),
        name="a",
        kind="rotary",
    )
    found, error = effort_lag(log)
    assert found == pytest.approx(lag * 0.002, abs=max(3 * error, 0.0015))
    assert error < 0.003


def test_lag_beside_gravity():
    lag, gravity = 4 * 0.002, 5.0 * np.sin(Q)
    log = AxisLog(name="a", kind="rotary", time=TIME, measured_position=Q, model_effort=gravity,
                  effort=np.interp(TIME + 0.001 + lag, TIME, U + gravity))  # fmt: skip
    found, error = effort_lag(log)
    assert found == pytest.approx(lag, abs=3 * error)
    assert error < 0.001


def test_lag_of_a_real_drive(benchmark_data):
    """Its effort is logged some 4 to 6.5 ms after its motion, with uneven stamps."""
    log = read_log(benchmark_data("real_axes/moteus_14-29-55.csv"), axis="1")
    found, error = effort_lag(log)
    assert -0.0065 < found < -0.004
    assert error < 0.001


def test_flags_take_part(robot):
    found = inspect(robot, columns=AxisSchema(start_time=1.0, end_time=3.0))
    assert found.axes[0].duration == pytest.approx(2.0)


def test_one_axis(robot):
    found = inspect(robot, axis="wrist")
    assert [each.name for each in found.axes] == ["wrist"]
    with pytest.raises(InputError) as caught:
        inspect(robot, axis="knee")
    assert caught.value.code == "axis_not_found"


PENDULUM = """<robot name="pendulum"><link name="base"/>
  <joint name="elbow" type="revolute"><parent link="base"/><child link="rod"/>
    <axis xyz="0 1 0"/><limit lower="-6" upper="6" effort="9" velocity="9"/></joint>
  <link name="rod"><inertial><origin xyz="0 0 -0.4"/><mass value="1.5"/>
    <inertia ixx="1e-6" iyy="1e-6" izz="1e-6" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""


@pytest.fixture
def pendulum(tmp_path):
    """Return log and model of a pendulum whose effort is written in closed form."""
    acceleration = 3 * np.cos(2 * TIME) + 5 * np.cos(5 * TIME)
    effort = (0.3 + 1.5 * 0.4**2) * acceleration + 0.5 * np.sign(V) + 0.2 * V
    effort += 1.5 * 9.81 * 0.4 * np.sin(Q)
    path = write(tmp_path / "pendulum.csv", {"t [s]": TIME, "elbow_pos [rad]": Q,
                                             "elbow_torque [Nm]": effort})  # fmt: skip
    (tmp_path / "pendulum.urdf").write_text(PENDULUM)
    return path, tmp_path / "pendulum.urdf"


def test_check_of_a_robot_joint(pendulum):
    """Gravity of the links is no friction: with the model the values are those of the joint."""
    log, urdf = pendulum
    pytest.importorskip("mujoco", reason="the links need MuJoCo")
    (axis,), (alone,) = (inspect(log, urdf=each, limit=0.05).axes for each in (urdf, None))
    expected = {each.parameter: each for each in axis.expected}
    truth = {"inertia": 0.54, "coulomb_friction": 0.5, "viscous_friction": 0.2}
    for name, value in truth.items():
        assert expected[name].value == pytest.approx(value, abs=expected[name].half_width)
        assert expected[name].sufficient
    without = {each.parameter: each for each in alone.expected}
    assert not without["coulomb_friction"].sufficient
    assert any("mean posture" in each for each in axis.reasons)
    assert not any(each.startswith("check:") for each in axis.reasons)
    assert any(each.startswith("check:") for each in alone.reasons)


def test_a_model_of_another_robot(robot, pendulum):
    pytest.importorskip("mujoco", reason="the links need MuJoCo")
    found = {each.name: each for each in inspect(robot, urdf=pendulum[1]).axes}
    assert not found["elbow"].problem
    assert "wrist" in found["wrist"].problem
    (only,) = inspect(robot, urdf=pendulum[1], joints=["elbow"]).axes
    assert only.name == "elbow"


@pytest.mark.slow
def test_check(robot, tmp_path):
    found = inspect(robot, limit=0.05)
    elbow = {each.parameter: each for each in found.axes[0].expected}
    assert elbow["inertia"].sufficient
    assert not elbow["static_friction"].sufficient
    assert not found.trusted
