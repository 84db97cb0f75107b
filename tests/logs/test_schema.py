"""Schemas: of one axis, of several, from TOML and from Python."""

import numpy as np
import pytest
from refusals import refuses

from stickslip.logs import AxisSchema, LogSchema, read_log, read_schema

TWO_AXES = """
name = "gantry"
kind = "linear"
time = "t"
[units]
position = "mm"
[axes.x]
position = "px"
effort = "fx"
[axes.y]
name = "cross slide"
sampling_time = 0.5
position = "py"
effort = "2 * fx"
units = { position = "cm", effort = "kN" }
"""

DATA = "t,px,py,fx\n0,1,2,3\n1,2,3,4\n2,4,5,6\n"


@pytest.fixture
def two_axes(tmp_path):
    (tmp_path / "two.csv").write_text(DATA)
    (tmp_path / "two.toml").write_text(TWO_AXES)
    return tmp_path / "two.csv", tmp_path / "two.toml"


def test_one_axis_of_several(two_axes):
    log = read_log(*two_axes, axis="x")
    assert log.name == "gantry axis x"
    np.testing.assert_array_equal(log.time, [0.0, 1.0, 2.0])
    np.testing.assert_array_equal(log.measured_position, np.array([1.0, 2.0, 4.0]) * 1e-3)
    np.testing.assert_array_equal(log.effort, [3.0, 4.0, 6.0])


def test_what_an_axis_states_comes_before_what_all_have(two_axes):
    log = read_log(*two_axes, axis="y")
    assert log.name == "cross slide"
    np.testing.assert_array_equal(log.time, [0.0, 0.5, 1.0])
    np.testing.assert_array_equal(log.measured_position, np.array([2.0, 3.0, 5.0]) * 1e-2)
    np.testing.assert_array_equal(log.effort, np.array([3.0, 4.0, 6.0]) * 2e3)


def test_an_axis_must_be_chosen(two_axes):
    with refuses("axis_not_chosen", where="two.toml", first="x"):
        read_log(*two_axes)
    with refuses("axis_unknown", axis="z"):
        read_log(*two_axes, axis="z")
    with refuses("axis_of_no_axes", axis="1"):
        read_log(two_axes[0], None, 1)


def test_a_single_axis_needs_no_choice():
    schema = LogSchema(kind="rotary", axes={"1": AxisSchema(position="q")})
    assert schema.for_axis(None).position == "q"
    assert schema.for_axis(1) == schema.for_axis("1") == schema.for_axis(None)


def test_toml_and_python_make_the_same_schema(two_axes):
    assert read_schema(two_axes[1]) == LogSchema(
        name="gantry",
        kind="linear",
        time="t",
        units={"position": "mm"},
        axes={
            "x": AxisSchema(position="px", effort="fx"),
            "y": AxisSchema(
                name="cross slide",
                sampling_time=0.5,
                position="py",
                effort="2 * fx",
                units={"position": "cm", "effort": "kN"},
            ),
        },
    )


def test_schemas_are_frozen():
    schema = LogSchema(units={"position": "mm"})
    with pytest.raises(AttributeError):
        schema.kind = "linear"
    with pytest.raises(TypeError):
        schema.units["position"] = "m"


@pytest.mark.parametrize("sampling", [{"sampling_time": 0.002}, {"sampling_frequency": 500.0}])
def test_a_log_without_time_stamps(sampling, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("x,f\n1,2\n2,3\n4,5\n")
    log = read_log(path, LogSchema(kind="linear", position="x", effort="f", **sampling))
    np.testing.assert_array_equal(log.time, [0.0, 0.002, 0.004])
    assert not any("time" in each for each in log.source.assumptions)


def test_numbers_of_the_file_stand_in_expressions(tmp_path):
    path = tmp_path / "log.npz"
    np.savez(path, t=[0.0, 1.0], x=[0.0, 1.0], u=[1.0, 2.0], gain=np.array([[2.5]]))
    log = read_log(path, LogSchema(kind="linear", position="x", effort="gain * u"))
    np.testing.assert_array_equal(log.effort, [2.5, 5.0])


def test_a_folder_of_files(tmp_path):
    (tmp_path / "a.csv").write_text("t,q one\n0,1\n1,2\n")
    (tmp_path / "b.tsv").write_text("tau\tx\n5\t1\n7\t2\n")
    (tmp_path / "folder.toml").write_text(
        'kind = "rotary"\ntime = "m:t"\nposition = "m:q one"\neffort = "m:t + \'s:tau\'"\n'
        '[files]\nm = "a.csv"\ns = "b.tsv"\n'
    )
    log = read_log(tmp_path, tmp_path / "folder.toml")
    np.testing.assert_array_equal(log.measured_position, [1.0, 2.0])
    np.testing.assert_array_equal(log.effort, [5.0, 8.0])
    assert log.source.files == ("a.csv", "b.tsv")
    assert log.name == tmp_path.stem


def test_columns_stated_apart_replace_the_schemas_own() -> None:
    schema = LogSchema(
        kind="linear", sampling_frequency=10.0, position="x", units={"position": "mm"}
    )
    merged = schema.overridden(None, AxisSchema(time="t", units={"effort": "kN"}))
    assert (merged.time, merged.sampling_frequency, merged.position) == ("t", None, "x")
    assert dict(merged.units) == {"position": "mm", "effort": "kN"}


def test_a_part_of_a_log_that_begins_before_it_is_refused():
    with refuses("negative", name="start_time", value=-1.0):
        LogSchema(start_time=-1.0)
    assert LogSchema(start_time=0.0).start_time == 0.0
