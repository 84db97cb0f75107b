"""Headers in the style of common tools: each opens with at most one flag, in SI units."""

import numpy as np
import pytest
from refusals import refuses

from stickslip.logs import LogSchema, read_axes, read_log
from stickslip.records import InputError

N = 200
TIME = np.arange(N) * 0.002  # s
TURN = 2 * np.pi


def motion(axis: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return position [rad], velocity [rad/s] and effort [N m] of an axis, all different."""
    w = 3.0 + axis
    return (
        0.5 * np.sin(w * TIME) + axis,
        0.5 * w * np.cos(w * TIME),
        0.3 * np.sign(np.cos(w * TIME)) + 0.1 * np.cos(w * TIME) + 0.01 * axis,
    )


@pytest.fixture
def file(tmp_path):
    def write(header, columns, *, delimiter=",", decimal=".", above=()):
        rows = [
            delimiter.join(
                str(int(v)) if isinstance(v, np.integer) else repr(float(v)).replace(".", decimal)
                for v in row
            )
            for row in zip(*columns, strict=True)
        ]
        path = tmp_path / "log.csv"
        path.write_text("\n".join([*above, delimiter.join(header), *rows, ""]))
        return path

    return write


def check(log, axis, *, effort=1.0, unit="N m", rtol=1e-9):
    position, velocity, torque = motion(axis)
    assert log.kind == "rotary"
    assert log.unit("effort") == unit
    np.testing.assert_allclose(log.time - log.time[0], TIME, atol=3e-7)
    np.testing.assert_allclose(log.measured_position, position, rtol=rtol, atol=1e-12)
    if log.measured_velocity is not None:
        np.testing.assert_allclose(log.measured_velocity, velocity, rtol=rtol, atol=1e-12)
    np.testing.assert_allclose(log.effort, effort * torque, rtol=rtol)


def test_plotjuggler(file):
    header = ["__time"]
    columns = [1.7e9 + TIME]
    for k, joint in enumerate(("shoulder", "elbow")):
        q, dq, tau = motion(k)
        header += [f"/joint_states/{joint}/{name}" for name in ("effort", "position", "velocity")]
        columns += [tau, q, dq]
    logs = read_axes(file(header, columns), LogSchema(kind="rotary"))
    assert list(logs) == ["shoulder", "elbow"]
    check(logs["shoulder"], 0)
    check(logs["elbow"], 1)
    assert "preset plotjuggler" in logs["elbow"].source.assumptions[0]


def test_two_joints_in_one_file(file):
    one, two = motion(0), motion(1)
    header = ["time", "shoulder_pos", "shoulder_torque", "elbow_pos", "elbow_torque"]
    path = file(header, [TIME, one[0], one[2], two[0], two[2]])
    logs = read_axes(path)
    assert list(logs) == ["shoulder", "elbow"]
    check(logs["shoulder"], 0)
    check(logs["elbow"], 1)
    check(read_log(path, axis="elbow"), 1)
    with refuses("axis_not_chosen", axes=["shoulder", "elbow"]):
        read_log(path)


def test_ros_stamps_in_nanoseconds(file):
    q, dq, tau = motion(0)
    stamps = 1_700_000_000_000_000_000 + np.rint(TIME * 1e9).astype(np.int64)
    header = ["%time", "field.header.seq", "field.header.stamp", "field.position0",
              "field.velocity0", "field.effort0"]  # fmt: skip
    path = file(header, [stamps + 700_000, np.arange(N), stamps, q, dq, tau])
    log = read_log(path, LogSchema(kind="rotary"))
    check(log, 0)
    assert any("field.header.stamp" in each for each in log.source.assumptions)


def test_bare_time_in_nanoseconds(file):
    q, dq, tau = motion(0)
    stamps = 1_700_000_000_000_000_000 + np.rint(TIME * 1e9).astype(np.int64)
    check(read_log(file(["timestamp", "angle", "vel", "torque"], [stamps, q, dq, tau])), 0)


@pytest.mark.parametrize("measured", [True, False])
def test_a_velocity_that_is_zero_throughout_is_not_used(file, measured):
    """A driver without velocities fills their column with zeros."""
    q, dq, tau = motion(0)
    columns = [TIME, q, dq if measured else np.zeros(N), tau]
    log = read_log(file(["time_s", "angle", "vel", "torque"], columns))
    assert (log.measured_velocity is not None) == measured
    assert log.source is not None
    found = [each for each in log.source.assumptions if each.startswith("velocity: 0 in all")]
    assert bool(found) != measured


def test_siemens(file):
    q, dq, tau = motion(0)
    header = ["Time [ms]", "r0062 Speed setpoint after filter [rpm]",
              "r0063 Speed actual value [rpm]", "r0080 Torque actual value [Nm]",
              "r2521[0] LR Position actual value [deg]"]  # fmt: skip
    columns = [TIME * 1e3, 0 * TIME, dq * 60 / TURN, tau, np.rad2deg(q)]
    log = read_log(file(header, columns, delimiter=";", decimal=","))
    check(log, 0)
    assert "preset siemens" in log.source.assumptions[0]


def test_siemens_without_the_preset(file):
    q, dq, tau = motion(0)
    header = ["Time [ms]", "r0063 Speed actual value [rpm]", "r0080 Torque actual value [Nm]",
              "r2521 Position actual value [deg]", "r0062 Speed setpoint [rpm]"]  # fmt: skip
    columns = [TIME * 1e3, dq * 60 / TURN, tau, np.rad2deg(q), dq]
    path = file(header, columns, delimiter=";", decimal=",")
    check(read_log(path, LogSchema(preset="none")), 0)


@pytest.mark.parametrize("preset", [None, "none", "kollmorgen"])
def test_kollmorgen(file, preset):
    q, dq, tau = motion(0)
    header = ["Time (ms)", "PL.FB (deg)", "VL.FB (rpm)", "IL.FB (A)", "PL.CMD (deg)", "IL.CMD (A)"]
    columns = [TIME * 1e3, np.rad2deg(q), dq * 60 / TURN, tau / 0.4, q, tau]
    path = file(header, columns)
    check(read_log(path, LogSchema(preset=preset)), 0, effort=1 / 0.4, unit="A")
    check(read_log(path, LogSchema(preset=preset, torque_constant=0.4)), 0)


def test_moteus(file):
    q, dq, tau = motion(0)
    header = ["time_s", "position_rev", "velocity_rev_s", "torque_Nm", "control_position_rev"]
    log = read_log(file(header, [TIME, q / TURN, dq / TURN, tau, 0 * q]))
    check(log, 0)
    np.testing.assert_allclose(log.measured_velocity, dq, atol=1e-8)


def test_moteus_telemetry(file):
    q, dq, tau = motion(0)
    header = ["timestamp", "mode", "position", "velocity", "torque", "q_current", "d_current"]
    path = file(header, [TIME, 0 * q + 10, q / TURN, dq / TURN, tau, 2 * tau, 0 * q])
    log = read_log(path)
    check(log, 0)
    assert "preset moteus" in log.source.assumptions[0]


def test_odrive(file):
    q, dq, tau = motion(0)
    header = ["time", "pos_estimate [turns]", "vel_estimate [turns/s]", "Iq_measured [A]",
              "Iq_setpoint [A]", "pos_setpoint [turns]"]  # fmt: skip
    path = file(header, [TIME, q / TURN, dq / TURN, tau / 0.05, tau, 0 * q])
    check(read_log(path), 0, effort=20.0, unit="A")
    check(read_log(path, LogSchema(torque_constant=0.05)), 0)


@pytest.mark.parametrize("names", ["pos vel eff", "joint_pos joint_vel joint_torq"])
def test_short_names(file, names):
    path = file(["time", *names.split()], [TIME, *motion(0)])
    check(read_log(path, LogSchema(kind="rotary")), 0)


def test_a_stated_unit_replaces_encoder_counts(file):
    position, velocity, effort = motion(0)
    counts = position * 65536 / TURN
    header = ["Time [sec]", "Position [cnt]", "Velocity [cnt/sec]", "Torque [N m]"]
    path = file(header, [TIME, counts, velocity * 65536 / TURN, effort])
    with refuses("encoder_counts", name="position", unit="cnt"):
        read_log(path)
    log = read_log(path, schema=LogSchema(units={"position": "1/65536 rev"}))
    assert log.measured_position == pytest.approx(position, rel=1e-14)
    assert log.kind == "rotary"


def test_names_of_acs_controllers(file):
    position, velocity, effort = motion(0)
    header = ["Time (ms)", "FPOS(0) (rad)", "FVEL(0) (rad/s)", "Torque(0) (N m)"]
    log = read_log(file(header, [1e3 * TIME, position, velocity, effort]))
    assert log.measured_position == pytest.approx(position)
    assert log.measured_velocity == pytest.approx(velocity)


def test_names_in_camel_case(file):
    q, _, tau = zip(*(motion(k) for k in range(2)), strict=True)
    header = ["time", "shoulderPosition", "elbowMotorPosition", "shoulderTorque", "fElbowTorque"]
    logs = read_axes(file(header, [TIME, *q, *tau]))
    assert list(logs) == ["shoulder", "elbow"]
    check(logs["shoulder"], 0)
    check(logs["elbow"], 1)


def test_numbered_joints(file):
    q, dq, tau = zip(*(motion(k) for k in range(3)), strict=True)
    header = ["t", *(f"{name}_{k}" for name in ("q", "dq", "tau") for k in range(3))]
    logs = read_axes(file(header, [TIME, *q, *dq, *tau]))
    assert list(logs) == ["0", "1", "2"]
    for k in range(3):
        check(logs[str(k)], k)


@pytest.mark.parametrize("index", ["_{}", "[{}]"])
def test_universal_robots(file, index):
    q, dq, tau = zip(*(motion(k) for k in range(6)), strict=True)
    names = ["target_q", "actual_q", "actual_qd", "actual_current", "target_moment"]
    header = ["timestamp", *(name + index.format(k) for name in names for k in range(6))]
    current = [each / 10.0 for each in tau]
    columns = [TIME + 3e4, *(0 * each for each in q), *q, *dq, *current, *tau]
    path = file(header, columns, delimiter=" ")
    logs = read_axes(path)
    assert list(logs) == [str(k) for k in range(6)]
    for k in range(6):
        check(logs[str(k)], k, effort=0.1, unit="A")
    check(read_log(path, LogSchema(torque_constant=10.0), axis=4), 4)


def test_units_row(file):
    q, dq, tau = motion(0)
    header = ["Time", "Axis 1.ActPos", "Axis 1.ActVelo", "Axis 1.ActTorque", "Axis 1.SetPos"]
    path = file(["ms", "deg", "deg/s", "Nm", "deg"],
                [TIME * 1e3, np.rad2deg(q), np.rad2deg(dq), tau, 0 * q],
                above=[",".join(header)])  # fmt: skip
    check(read_log(path), 0)


def test_column_pattern_of_a_user(file):
    q, _dq, tau = zip(*(motion(k) for k in range(2)), strict=True)
    header = ["clk_us", "a.w", "b.w", "a.i", "b.i"]
    path = file(header, [np.rint(TIME * 1e6).astype(np.int64), *q, *(2 * t for t in tau)])
    schema = LogSchema(kind="rotary", time="clk_us", position="{axis}.w", effort="0.5 * '{axis}.i'",
                       units={"position": "rad", "effort": "N m"})  # fmt: skip
    logs = read_axes(path, schema)
    assert list(logs) == ["a", "b"]
    check(logs["a"], 0)
    check(logs["b"], 1)
    with refuses("pattern_without_column"):
        read_axes(path, LogSchema(kind="rotary", position="{axis}.pos", effort="{axis}.i"))


def test_commanded_motion_is_not_measured(file):
    q, _dq, tau = motion(0)
    header = ["t", "target_position [rad]", "position_actual [rad]", "following error [rad]",
              "torque_cmd [Nm]", "torque_fbk [Nm]"]  # fmt: skip
    log = read_log(file(header, [TIME, 0 * q, q, q + 1, 0 * tau, tau]))
    check(log, 0)
    assert any("'torque_cmd'" in each and "more direct" in each for each in log.source.assumptions)


def test_units_tell_a_current_from_a_position(file):
    q, dq, tau = motion(0)
    header = ["time [s]", "a1 q-axis cmd [A]", "a1 position [rad]", "a1 velocity [rad/s]",
              "a1 torque [Nm]", "a1 q-axis [A]", "torque constant [Nm/A]"]  # fmt: skip
    check(read_log(file(header, [TIME, tau, q, dq, tau, 2 * tau, 0 * q + 1])), 0)
    header[4] = "a1 temp [C]"
    log = read_log(file(header, [TIME, tau, q, dq, tau, 2 * tau, 0 * q + 1]))
    check(log, 0, effort=2.0, unit="A")


def test_axes_that_do_not_match(file):
    q, _, tau = motion(0)
    with refuses("axis_incomplete", positions=["cart"]):
        read_log(file(["t", "cart_pos", "pole_torque"], [TIME, q, tau]), LogSchema(kind="rotary"))


def test_a_stated_position_chooses_its_axis(file):
    q, _, tau = zip(*(motion(k) for k in range(2)), strict=True)
    path = file(["t", "a_pos", "b_pos", "a_torque", "b_torque"], [TIME, *q, *tau])
    log = read_log(path, LogSchema(position="b_pos", units={"position": "rad"}))
    check(log, 1)


@pytest.mark.parametrize(
    ("factor", "offset", "known"),
    [
        (1.0, 0.0, True),
        (1.0, 1.7e9, True),
        (1e3, 0.0, True),  # a step of 2
        (1e3, 1.7e12, True),
        (1e6, 0.0, True),  # a step of 2000
        (1e6, 1.7e15, True),
        (1e9, 0.0, True),
        (1e7, 1.34e17, True),  # FILETIME
        (5e4, 0.0, False),  # a step of 100: 100 ms or 100 us
        (1e12, 0.0, False),
        (1.0 / 60.0, 0.0, False),  # minutes
        (1.0 / 3600.0, 0.0, False),  # hours
        (1.0 / 86400.0, 45000.0, False),  # days, as spreadsheets count them
    ],
)
def test_units_of_time_by_their_step(file, factor, offset, known):
    q, dq, tau = motion(0)
    stamps = TIME * factor + offset
    if factor > 1:
        stamps = np.rint(stamps).astype(np.int64)
    path = file(["t", "angle", "vel", "torque"], [stamps, q, dq, tau])
    if known:
        log = read_log(path)
        np.testing.assert_allclose(log.time - log.time[0], TIME, atol=3e-6)
        return
    with refuses("time_unit_unknown"):
        read_log(path)


def test_a_long_log_of_a_fast_drive_is_in_seconds(file):
    stamps = 25e-6 * np.arange(50_000)
    path = file(["t", "angle", "torque"], [stamps, np.sin(stamps), np.cos(stamps)])
    np.testing.assert_allclose(read_log(path).time, stamps, atol=1e-9)


@pytest.mark.parametrize(
    ("header", "quantity", "factor"),
    [
        ("pos (degrees)", "measured_position", np.pi / 180),
        ("pos (rotations)", "measured_position", TURN),
        ("pos (mrad)", "measured_position", 1e-3),
        ("pos in deg", "measured_position", np.pi / 180),
        ("pos (1/10 deg)", "measured_position", np.pi / 1800),
        ("actualPosDeg", "measured_position", np.pi / 180),
        ("vel (krpm)", "measured_velocity", 1e3 * TURN / 60),
        ("vel / U/min", "measured_velocity", TURN / 60),
        ("vel_rotations_per_second", "measured_velocity", TURN),
        ("torque (mN.m)", "effort", 1e-3),
        ("torque (Nmm)", "effort", 1e-3),
        ("torque (oz-in)", "effort", 0.028349523125 * 9.80665 * 0.0254),
        ("torque_nm", "effort", 1.0),
        ("current (milliamps)", "effort", 1e-3),
        ("torque_mN_m", "effort", 1e-3),
        ("torque_Ncm", "effort", 1e-2),
        ("torque_kgcm", "effort", 0.0980665),
        ("POS_DEG", "measured_position", np.pi / 180),
        ("angle_arcmin", "measured_position", np.pi / 10800),
    ],
)
def test_a_unit_is_converted_however_it_is_spelled(file, header, quantity, factor):
    q, dq, tau = motion(0)
    names = {"measured_position": "angle", "measured_velocity": "vel", "effort": "torque"}
    names[quantity] = header
    log = read_log(file(["time_s", *names.values()], [TIME, q, dq, tau]))
    values = {"measured_position": q, "measured_velocity": dq, "effort": tau}[quantity]
    np.testing.assert_allclose(getattr(log, quantity), factor * values, rtol=1e-9)


@pytest.mark.parametrize(
    "header",
    [
        "angle (wibble)", "angle / wibble", "angle, pu", "deg angle",
        "angle (deg x10)", "angle (0,1 deg)", "angle (10^-3 rad)", "angle (axis 2 deg)",
        "angle_in", "angle_steps",
    ],
)  # fmt: skip
def test_a_text_that_may_be_a_unit_is_not_passed_over(file, header):
    q, dq, tau = motion(0)
    path = file(["time_s", header, "vel", "torque"], [TIME, q, dq, tau])
    if "," in header:
        path.write_text(path.read_text().replace(header, f'"{header}"'))
    with refuses("unit_unread"):
        read_log(path)
    check(read_log(path, LogSchema(units={"position": "rad"})), 0)


@pytest.mark.parametrize("header", ["current (A/10)", "current (dA)", "torque (N/10)"])
def test_a_factor_of_an_effort_is_not_passed_over(file, header):
    q, dq, tau = motion(0)
    with refuses("unit_unread"):
        read_log(file(["time_s", "angle", "vel", header], [TIME, q, dq, tau]))


def test_a_factor_before_a_unit(file):
    q, dq, tau = motion(0)
    header = ["time_s", "angle [1e-3 rad]", "vel", "torque (0.1 Nm)"]
    check(read_log(file(header, [TIME, 1e3 * q, dq, 10.0 * tau])), 0)


def test_a_unit_alone_names_time_and_current(file):
    q, dq, tau = motion(0)
    check(read_log(file(["seconds", "angle", "vel", "motor_amps"], [TIME, q, dq, tau]),
                   LogSchema(torque_constant=1.0)), 0)  # fmt: skip


@pytest.mark.parametrize(("step", "count", "known"), [(0.1, 200, True), (0.11, 100, False),
                                                     (0.11, 99, True)])  # fmt: skip
def test_steps_of_a_tenth_are_seconds(file, step, count, known):
    q, _, tau = motion(0)
    path = file(["t", "angle", "torque"], [1e4 + step * np.arange(count), q[:count], tau[:count]])
    if known:
        assert read_log(path).sampling_time == pytest.approx(step)
    else:
        with pytest.raises(InputError):
            read_log(path)


def test_words_in_brackets_need_no_unit(file):
    q, dq, tau = motion(0)
    header = [
        "time_s",
        "angle (measured)",
        "angle (raw error)",
        "vel (estimated)",
        "torque (q-axis)",
    ]
    check(read_log(file(header, [TIME, q, 0 * q, dq, tau])), 0)


@pytest.mark.parametrize(
    "header",
    [
        ["Zeit in ms", "Winkel [°]", "Drehzahl / U/min", "Drehmoment [mNm]"],
        ["temps (ms)", "position (deg)", "vitesse (tr/min)", "couple (mN.m)"],
        ["tempo [ms]", "posizione [deg]", "velocita [1/min]", "coppia [mNm]"],
        ["tempo [ms]", "posizione [deg]", "velocità [1/min]", "coppia [mNm]"],
        ["tiempo (ms)", "posición (deg)", "velocidad (rpm)", "Torque (mNm)"],
        ["Zeit in ms", "Istposition in °", "Istdrehzahl in U/min", "Istmoment in mNm"],
    ],
)
def test_headers_in_other_languages(file, header):
    q, dq, tau = motion(0)
    columns = [TIME * 1e3, np.rad2deg(q), dq * 60 / TURN, tau * 1e3]
    check(read_log(file(header, columns, delimiter=";")), 0)


@pytest.mark.parametrize(
    "header",
    [["Zeit [s]", "Weg [m]", "Kraft [N]"], ["temps (s)", "déplacement (m)", "force (N)"]],
)
def test_linear_axes_in_other_languages(file, header):
    q, _, tau = motion(0)
    log = read_log(file(header, [TIME, q, tau], delimiter=";"))
    assert log.kind == "linear"
    np.testing.assert_allclose(log.measured_position, q)


def test_a_set_point_in_german_is_no_measurement(file):
    q, _, tau = motion(0)
    header = ["Zeit [s]", "Sollposition [°]", "Istposition [°]", "Drehmoment [Nm]"]
    log = read_log(file(header, [TIME, 0 * q + TIME, np.rad2deg(q), tau]))
    np.testing.assert_allclose(log.measured_position, q, rtol=0, atol=1e-12)


def test_accents_in_the_name_of_an_axis_stay(file):
    q, _, tau = motion(0)
    header = ["time_s", "épaule.angle", "épaule.torque", "coude.angle", "coude.torque"]
    assert set(read_axes(file(header, [TIME, q, tau, q, tau]))) == {"épaule", "coude"}


def test_the_name_of_an_axis_in_brackets(file):
    one, two = motion(0), motion(1)
    header = ["time_s", "angle (elbow)", "torque (elbow)", "angle (wrist)", "torque (wrist)"]
    logs = read_axes(file(header, [TIME, one[0], one[2], two[0], two[2]]))
    assert list(logs) == ["elbow", "wrist"]
    check(logs["elbow"], 0)
    check(logs["wrist"], 1)


def test_desired_values_of_a_robot_are_no_axes(file):
    one, two = motion(0), motion(1)
    header, columns = ["time"], [TIME]
    for k, (q, dq, tau) in enumerate((one, two)):
        names = ("q_d", "dq_d", "tau_J_d", "q", "dq", "tau_J")
        header += [f"{name}[{k}]" for name in names]
        columns += [0.9 * q, 0.9 * dq, 0.9 * tau, q, dq, tau]
    logs = read_axes(file(header, columns), LogSchema(kind="rotary"))
    assert list(logs) == ["0", "1"]
    check(logs["0"], 0)
    check(logs["1"], 1)


def test_an_axis_of_twincat_counts_once(file):
    q, dq, tau = motion(0)
    names = ("ActPos", "ActVelo", "ActTorque")
    header = ["time", *(f"GVL.Axis[1].NcToPlc.{name}" for name in names), "GVL.Axis[1].ActTorque"]
    path = file(header, [TIME, q, dq, tau, tau])
    logs = read_axes(path, LogSchema(kind="rotary"))
    assert list(logs) == ["GVL.Axis[1]"]
    check(logs["GVL.Axis[1]"], 0)


@pytest.mark.parametrize("step", [1, 0.5])
def test_a_long_log_with_steps_of_about_one_may_be_in_milliseconds(file, step):
    q, dq, tau = motion(0)
    path = file(["t", "angle", "vel", "torque"], [np.arange(N) * float(step), q, dq, tau])
    with refuses("time_unit_unknown", units=["s", "ms"]):
        read_log(path)
    assert read_log(path, LogSchema(units={"time": "ms"})).sampling_time == pytest.approx(
        1e-3 * step
    )
