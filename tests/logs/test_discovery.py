"""Columns, units and kinds that are not stated: found where obvious, and always reported."""

import numpy as np
import pytest
from refusals import refuses

from stickslip.logs import LogSchema, read_log

ROWS = ["0,1,2,3,4,5", "1,2,3,4,5,6", "2,4,5,6,7,9"]


@pytest.fixture
def read(tmp_path):
    def from_header(header, schema=None, axis=None):
        path = tmp_path / "stage.csv"
        width = len(header)
        rows = [",".join(row.split(",")[:width]) for row in ROWS]
        path.write_text("\n".join([",".join(header), *rows, ""]))
        return read_log(path, schema, axis)

    return from_header


def column(log, name):
    values = getattr(log, name)
    return None if values is None else values.tolist()


@pytest.mark.parametrize(
    "header",
    [
        ["t [s]", "x [m]", "v [m/s]", "F [N]"],
        ["Time (s)", "Position (m)", "Velocity (m/s)", "Force (N)"],
        ["timestamp", "actual_position [m]", "ActualVelocity", "motor force"],
        ["TIME", "pos [m]", "speed", "commanded_effort [N]"],
        ["t", "measured position [m]", "dq", "effort"],
    ],
)
def test_obvious_names(header, read):
    log = read(header)
    assert log.kind == "linear"
    assert column(log, "time") == [0.0, 1.0, 2.0]
    assert column(log, "measured_position") == [1.0, 2.0, 4.0]
    assert column(log, "measured_velocity") == [2.0, 3.0, 5.0]
    assert column(log, "effort") == [3.0, 4.0, 6.0]


def test_both_masses_of_an_arm(read):
    log = read(["t", "position [m]", "load_position [m]", "load velocity", "velocity", "force"])
    assert column(log, "measured_position") == [1.0, 2.0, 4.0]
    assert column(log, "measured_load_position") == [2.0, 3.0, 5.0]
    assert column(log, "measured_load_velocity") == [3.0, 4.0, 6.0]
    assert column(log, "measured_velocity") == [4.0, 5.0, 7.0]


def test_references_are_not_measurements(read):
    log = read(["t", "reference position [m]", "position [m]", "target_pos", "force"])
    assert column(log, "measured_position") == [2.0, 3.0, 5.0]


def test_every_assumption_is_reported(read):
    log = read(["time", "angle [deg]", "torque"])
    assert log.source.assumptions == (
        "time is read from column 'time'; no unit is given, so it is taken in s",
        "position is read from column 'angle'; its unit deg is stated in the file",
        "effort is read from column 'torque'; no unit is given, so it is taken in N m",
        "the axis is taken as rotary because position is in deg",
    )


def test_nothing_is_reported_without_assumptions(read):
    schema = LogSchema(kind="linear", time="a", position="b", effort="2 * c",
                       units={"time": "s", "position": "mm", "effort": "N"})  # fmt: skip
    log = read(["a", "b", "c"], schema)
    assert log.source.assumptions == ()
    assert log.name == "stage"


def test_milliseconds_only_if_the_header_says_so(read):
    assert column(read(["t", "x [m]", "f"]), "time") == [0.0, 1.0, 2.0]
    assert column(read(["time_ms", "x [m]", "f"]), "time") == [0.0, 1e-3, 2e-3]
    assert column(read(["t [ms]", "x [m]", "f"]), "time") == [0.0, 1e-3, 2e-3]


@pytest.mark.parametrize(
    ("header", "what"),
    [
        (["t", "time", "x [m]", "f"], "'t' and 'time' could each be the time"),
        (["t", "x [m]", "q", "f"], "'x' and 'q' could each be the position"),
        (["t", "x", "x", "f"], "'x #1' and 'x #2' could each be the position"),
        (["t", "x [m]", "x [mm]", "f"], "'x [m]' and 'x [mm]' could each be the position"),
        (["t", "x [m]", "v", "speed", "f"], "'v' and 'speed' could each be the velocity"),
        (["t", "x [m]", "force", "torque", "tau"], "'force', 'torque' and 'tau' could each be"),
    ],
)
def test_competing_columns_are_listed(header, what, read):
    with refuses("columns_compete") as caught:
        read(header)
    assert what in str(caught.value)


@pytest.mark.parametrize(
    ("header", "kind"),
    [
        (["t", "x [mm]", "f"], "linear"),
        (["t", "q [deg]", "f"], "rotary"),
        (["t", "q", "speed [rpm]", "f"], "rotary"),
        (["t", "q", "f [N]"], "linear"),
        (["t", "q", "tau [mNm]"], "rotary"),
    ],
)
def test_the_kind_follows_the_units(header, kind, read):
    log = read(header)
    assert log.kind == kind
    assert f"the axis is taken as {kind} because " in log.source.assumptions[-1]


def test_units_that_contradict_each_other(read):
    with refuses("kinds_contradict"):
        read(["t", "x [mm]", "f [N m]"])


@pytest.mark.parametrize(
    ("header", "kind", "reason"),
    [
        (["t", "x", "force"], "linear", "effort is called 'force'"),
        (["t", "q", "motor torque"], "rotary", "effort is called 'motor torque'"),
        (["t", "angle", "effort"], "rotary", "position is called 'angle'"),
    ],
)
def test_names_said_of_one_kind_only(header, kind, reason, read):
    log = read(header)
    assert log.kind == kind
    assert log.source.assumptions[-1] == f"the axis is taken as {kind} because {reason}"


@pytest.mark.parametrize(
    ("header", "schema", "what"),
    [
        (["t", "x [mm]", "torque"], None, "position is in mm and effort is called 'torque'"),
        (["t", "angle", "force"], None, "position is called 'angle' and effort is called 'force'"),
        (["t", "x", "tau"], LogSchema(kind="linear"), "stated to be linear and effort is called"),
    ],
)
def test_a_torque_is_not_taken_for_a_force(header, schema, what, read):
    with refuses("kinds_contradict") as caught:
        read(header, schema)
    assert what in str(caught.value)


def test_a_name_gives_way_to_what_is_stated(read):
    header = ["t", "x", "torque"]
    log = read(header, LogSchema(kind="linear", position="x", effort="torque"))
    assert log.source.assumptions[-1] == "effort: no unit is given, so it is taken in N"
    assert read(header, LogSchema(kind="linear", units={"effort": "N"})).kind == "linear"


def test_a_force_comes_before_a_current(read):
    assert column(read(["t", "x", "current [A]", "force"]), "effort") == [3.0, 4.0, 6.0]


def test_no_units_no_kind(read):
    with refuses("kind_unknown"):
        read(["t", "x", "f"])


@pytest.mark.parametrize("name", ["current", "motor_current", "iq", "actual current"])
def test_a_current_stays_in_ampere(name, read):
    log = read(["t", "x [m]", name])
    assert log.effort_unit == "A"
    assert column(log, "effort") == [2.0, 3.0, 5.0]
    assert any("seems to be a motor current" in each for each in log.source.assumptions)
    log = read(["t", "x [m]", f"{name} [mA]"])
    assert log.unit("effort") == "A"
    np.testing.assert_allclose(log.effort, [2e-3, 3e-3, 5e-3], rtol=1e-15)
    assert any("no torque constant is given" in each for each in log.source.assumptions)


def test_torque_constant_and_gear(read):
    header = ["t", "q [rad]", "current [A]"]
    log = read(header, LogSchema(torque_constant=0.5, kind="rotary"))
    assert (log.unit("effort"), column(log, "effort")) == ("N m", [1.0, 1.5, 2.5])
    assert log.source.side == ""
    log = read(header, LogSchema(torque_constant=0.5, gear_ratio=-10.0, kind="rotary"))
    assert column(log, "effort") == [-10.0, -15.0, -25.0]
    assert log.source.side == "joint"
    assert any("results are those of the joint" in each for each in log.source.assumptions)
    stated = LogSchema(gear_ratio=10.0, effort_side="joint", kind="rotary")
    log = read(["t", "q [rad]", "torque [N m]"], stated)
    assert column(log, "effort") == [2.0, 3.0, 5.0]


@pytest.mark.parametrize(
    ("effort", "schema", "code"),
    [
        ("torque [N m]", {"torque_constant": 0.5}, "torque_constant_without_current"),
        ("torque [N m]", {"gear_ratio": 10.0}, "gear_without_side"),
        ("torque [N m]", {"effort_side": "motor"}, "side_without_gear"),
    ],
)
def test_contradictory_conversions(effort, schema, code, read):
    with refuses(code):
        read(["t", "q [rad]", effort], LogSchema(kind="rotary", **schema))


@pytest.mark.parametrize(
    ("schema", "code"),
    [
        ({"gear_ratio": 0.0}, "gear_ratio_zero"),
        ({"gear_ratio": float("inf")}, "gear_ratio_zero"),
        ({"preset": "nonesuch"}, "preset_unknown"),
        ({"preset": "ur-rtde"}, "preset_does_not_fit"),
    ],
)
def test_bad_settings_of_a_schema(schema, code, read):
    with refuses(code):
        read(["t", "q [rad]", "torque [N m]"], LogSchema(**schema))


def test_stated_columns_leave_the_rest_alone(read):
    header = ["t", "x [m]", "v", "f", "extra"]
    log = read(header, LogSchema(kind="linear", position="x", effort="extra"))
    assert log.measured_velocity is None
    assert column(log, "effort") == [4.0, 5.0, 7.0]
    assert read(header, LogSchema(kind="linear")).measured_velocity is not None


def test_a_computed_channel_does_not_guess_its_unit(read):
    header = ["t", "motor [deg]", "drive [V]"]
    with refuses("unit_of_expression_unknown", needed="rad"):
        read(header, LogSchema(kind="rotary", position="motor / 2", effort="2 * drive"))
    stated = {"position": "deg"}
    log = read(header, LogSchema(position="motor / 2", effort="2 * drive", units=stated))
    np.testing.assert_allclose(log.measured_position, np.deg2rad([0.5, 1.0, 2.0]), rtol=1e-15)
    assert column(log, "effort") == [4.0, 6.0, 10.0]
    assert "effort: no unit is given, so it is taken in N m" in log.source.assumptions


def test_a_computed_channel_from_si_columns(read):
    log = read(["t", "q [rad]", "tau [N m]"], LogSchema(position="q / 2", effort="-tau"))
    assert column(log, "measured_position") == [0.5, 1.0, 2.0]
    assert column(log, "effort") == [-2.0, -3.0, -5.0]


def test_full_headers_name_columns_too(read):
    log = read(["t", "q [deg]", "tau [N m]"], LogSchema(position="q [deg]", effort="tau"))
    assert log.measured_position[0] == pytest.approx(np.pi / 180, rel=1e-15)


def test_a_statement_above_the_columns_is_reported(read):
    schema = LogSchema(sampling_time=0.5, units={"position": "mm"})
    assumptions = read(["t", "x [m]", "force [N]"], schema).source.assumptions
    assert any(
        each.startswith("time is the stated sampling of") and each.endswith("not column 't'")
        for each in assumptions
    )
    (position,) = (each for each in assumptions if each.startswith("position"))
    assert position.endswith("its unit is mm as stated, not m as in the file")


@pytest.mark.parametrize(
    ("header", "stated", "steps"),
    [
        ("t [s]", 2.0, " 't', with steps of 1 s"),
        ("t [ms]", 1.0, " 't', with steps of 0.001 s"),
        ("t [ms]", 0.001, " 't'"),
        ("t [s]", 1.009, " 't'"),
        ("t [s]", 1.011, " 't', with steps of 1 s"),
    ],
)
def test_a_stated_sampling_that_time_stamps_contradict_is_noted(read, header, stated, steps):
    log = read([header, "x [m]", "force [N]"], LogSchema(sampling_time=stated))
    (note,) = (each for each in log.source.assumptions if each.startswith("time is"))
    assert note == f"time is the stated sampling of {stated:.6g} s, not column{steps}"


def test_time_stamps_that_cannot_be_read_do_not_prevent_a_stated_sampling(tmp_path):
    path = tmp_path / "stage.csv"
    path.write_text("t,x [m],force [N]\n0,1,2\nlost,2,3\n1,4,5\n")
    log = read_log(path, LogSchema(sampling_time=0.5))
    assert "time is the stated sampling of 0.5 s, not column 't'" in log.source.assumptions


def test_what_is_stated_as_the_file_has_it_needs_no_words(read):
    schema = LogSchema(units={"position": "deg"})
    assumptions = read(["t", "x [°]", "torque [N m]"], schema).source.assumptions
    assert not any("as stated" in each for each in assumptions)


def test_the_case_of_the_name_of_an_axis_is_open(read):
    header = ["time", "X.pos [m]", "X.force [N]", "Y.pos [m]", "Y.force [N]"]
    assert column(read(header, axis="X"), "effort") == [2.0, 3.0, 5.0]
    with refuses("axis_not_found"):
        read(header, axis="Z")


@pytest.mark.parametrize("bits", [16, 32])
def test_signed_efforts_that_were_written_as_unsigned_are_read(tmp_path, bits):
    effort = np.rint(2000 * np.sin(0.3 * np.arange(100)))
    written = np.mod(effort, 2**bits)

    def log_of(values):
        path = tmp_path / "stage.csv"
        rows = [f"{k},{k * k},{int(value)}" for k, value in enumerate(values)]
        path.write_text("\n".join(["t [ms],position [um],force [N]", *rows, ""]))
        return read_log(path)

    log = log_of(written)
    np.testing.assert_array_equal(log.effort, effort)
    assert any("sign is restored" in each for each in log.source.assumptions)
    # An offset instead, or faults
    for other in (effort + 2 ** (bits - 1), np.where(np.arange(100) == 50, 2**bits - 1, 100)):
        np.testing.assert_array_equal(log_of(other).effort, other)
