"""The contract of every log format of the registry, on files that other libraries write."""

import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io
from matlab_files import write_matlab_73
from measurement_files import write_sysid
from message_files import JOINTS, joint_columns
from refusals import refuses
from sample_files import OF_A_MECHANISM, OF_ALL_CHANNELS, OF_JOINTS

from stickslip.logs import LogSchema, read_log, write_csv
from stickslip.logs.formats.registry import FORMATS, format_of
from stickslip.logs.isolation import read_guarded
from stickslip.records import InputError, MissingExtraError

LINEAR = LogSchema(kind="linear")


def read_here(path):
    """Read a file as the process of the readers does, but in this one, which is quicker."""
    return read_guarded(format_of(path), path)


def load_all(path):
    """Read all columns of a file."""
    table = read_here(path)
    return table.load(list(table.headers))


EVERY_WRITER = {**OF_ALL_CHANNELS, **OF_JOINTS, **OF_A_MECHANISM}

BY_ROWS = {"text"}  # formats of which the first rows of a file are a file
BY_BLOCKS = {"TDMS", "ROS bag"}  # of which the first blocks of a file are a file, or pages of zeros
WHOLE = [
    name for name in EVERY_WRITER if FORMATS[Path(name).suffix].name not in BY_ROWS | BY_BLOCKS
]


def last_segment(name):
    """Return the name of a column without its path."""
    return name.rpartition("/")[2]


@pytest.mark.parametrize("name", OF_ALL_CHANNELS)
def test_a_file_of_another_library_gives_its_columns(name, columns, expected, same, tmp_path):
    path = tmp_path / name
    OF_ALL_CHANNELS[name](path, columns)
    log = read_log(path, LINEAR)
    same(log, expected, name=False)
    assert log.name == Path(name).stem
    assert log.source is not None
    assert log.source.files == (name,)


@pytest.mark.parametrize("name", OF_JOINTS)
def test_joint_states_give_a_column_for_each_joint(name, columns, tmp_path):
    path = tmp_path / name
    OF_JOINTS[name](path, columns)
    table = read_here(path)
    loaded = table.load(list(table.headers))
    (group,) = table.groups
    assert group.time is not None
    np.testing.assert_array_equal(loaded[group.time], columns["time"])
    for quantity, values in zip(
        ("position", "velocity", "effort"), joint_columns(columns), strict=True
    ):
        for k, joint in enumerate(JOINTS):
            np.testing.assert_array_equal(loaded[f"/joint_states/{joint}/{quantity}"], values[:, k])
    assert table.origins["/joint_states/elbow/effort"] == "/joint_states (sensor_msgs/JointState)"


def test_a_sysid_log_gives_metres_and_volts(columns, tmp_path):
    path = tmp_path / "sysid.json"
    write_sysid(path, columns)
    table = read_here(path)
    assert table.units == {"time": "s", "voltage": "V", "position": "m", "velocity": "m/s"}
    loaded = table.load(list(table.headers))
    np.testing.assert_array_equal(loaded["time"], columns["time"])
    np.testing.assert_array_equal(loaded["position"], columns["position"])
    np.testing.assert_array_equal(loaded["voltage"], columns["effort"])


@pytest.mark.parametrize("ending", FORMATS)
def test_every_ending_in_either_case(ending, columns, tmp_path):
    written = [name for name in EVERY_WRITER if FORMATS[Path(name).suffix] is FORMATS[ending]]
    example = next((name for name in written if Path(name).suffix == ending), written[0])
    write = EVERY_WRITER[example]
    path = tmp_path / f"written{Path(example).suffix}"
    write(path, columns)
    for name in (f"log{ending}", f"log{ending.upper()}"):
        path = path.rename(tmp_path / name)
        table = read_here(path)
        assert table.label == name
        assert set(table.headers) == {column for group in table.groups for column in group.columns}
        chosen = list(table.headers)[:2]
        loaded = table.load(chosen)
        assert set(loaded) == set(chosen)
        assert all(values.dtype == np.float64 for values in loaded.values())
        assert table.place(chosen[0], 3).startswith(f"{name}, ")
        if example in OF_ALL_CHANNELS:
            assert {last_segment(column) for column in table.headers} == set(columns)


@pytest.mark.parametrize("ending", FORMATS)
def test_other_content_is_refused_with_the_name_of_the_file(ending, tmp_path):
    path = tmp_path / f"log{ending}"
    for content in (b"no such format " * 40, b"\x00", b"PK\x03\x04" + b"x" * 99):
        path.write_bytes(content)
        with pytest.raises(InputError) as caught:
            read_here(path)
        assert caught.value.where.startswith(path.name)
        assert caught.value.remedy


@pytest.mark.parametrize("name", WHOLE)
def test_a_file_cut_short_anywhere_is_refused(name, columns, tmp_path):
    path = tmp_path / name
    EVERY_WRITER[name](path, columns)
    content = path.read_bytes()
    for length in range(1, len(content), len(content) // 40):
        path.write_bytes(content[:length])
        with pytest.raises(InputError) as caught:
            load_all(path)
        assert caught.value.where
        assert caught.value.where.startswith(name)


def test_a_written_log_reads_back_without_a_schema(expected, same, tmp_path):
    path = tmp_path / "stage.csv"
    write_csv(expected, path)
    log = read_log(path)
    same(log, expected)


def test_the_source_has_the_hash_of_the_bytes(expected, tmp_path):
    import hashlib

    path = tmp_path / "stage.csv"
    write_csv(expected, path)
    log = read_log(path)
    assert log.source is not None
    assert log.source.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.parametrize("write", [scipy.io.savemat, write_matlab_73], ids=["5", "7.3"])
def test_matlab_structures_matrices_and_numbers(write, columns, tmp_path):
    path = tmp_path / "stage.mat"
    matrix = np.column_stack([columns["position"], columns["load_position"]])
    # HDF5 as MATLAB writes it holds the transpose.
    stored = matrix.T if write is write_matlab_73 else matrix
    write(path, {"log": {"t": columns["time"], "u": columns["effort"]}, "q": stored, "gain": 2.5})
    schema = LogSchema(
        kind="linear", time="log.t", position="q_1", load_position="q_2", effort="gain * log.u"
    )
    log = read_log(path, schema)
    np.testing.assert_array_equal(log.time, columns["time"])
    np.testing.assert_array_equal(log.measured_position, columns["position"])
    np.testing.assert_array_equal(log.measured_load_position, columns["load_position"])
    np.testing.assert_array_equal(log.effort, 2.5 * columns["effort"])


def test_a_matrix_with_samples_in_rows_is_reported(columns, tmp_path):
    path = tmp_path / "stage.npz"
    np.savez(
        path,
        time=columns["time"],
        q=np.stack([columns["position"], columns["load_position"]]),
        effort=columns["effort"],
    )
    log = read_log(path, LogSchema(kind="linear", position="q_1", effort="effort"))
    np.testing.assert_array_equal(log.measured_position, columns["position"])
    assert "q is 2 x 60; its longer side is taken as time" in log.source.assumptions


def test_arrays_of_numpy_with_objects_and_without_names(columns, tmp_path):
    one, two, three = (tmp_path / name for name in ("stage.npz", "stage.npy", "objects.npy"))
    np.savez(one, **columns, operator=np.array([{"name": "A"}, None], dtype=object))
    assert list(read_log(one, LINEAR).time) == list(columns["time"])
    np.save(two, np.column_stack([columns[name] for name in ("time", "position", "effort")]))
    log = read_log(
        two, LogSchema(kind="linear", time="column_1", position="column_2", effort="column_3")
    )
    np.testing.assert_array_equal(log.effort, columns["effort"])
    many = dict.fromkeys((f"τ of the channel {k}" for k in range(400)), columns["effort"])
    wide = np.rec.fromarrays([*columns.values(), *many.values()], names=[*columns, *many])
    with pytest.warns(UserWarning, match=r"format 3\.0"):  # names in UTF-8
        np.save(two, wide)
    log = read_log(two, LogSchema(kind="linear", effort="τ of the channel 399"))
    np.testing.assert_array_equal(log.effort, columns["effort"])
    half = {name: values / 2 for name, values in columns.items()}
    axes = (np.rec.fromarrays([*each.values()], names=[*each]) for each in (columns, half))
    np.savez(one, **dict(zip("ab", axes, strict=True)))
    for axis, each in (("a", columns), ("b", half)):
        names = {name: f"{axis}.{name}" for name in ("time", "position", "effort")}
        log = read_log(one, LogSchema(kind="linear", **names))
        np.testing.assert_array_equal(log.effort, each["effort"])
    np.save(three, np.array({"t": [0.0, 1.0]}, dtype=object))
    with refuses("no_numbers_over_time"):
        read_log(three)


def test_units_in_the_names_of_any_format(columns, tmp_path):
    path = tmp_path / "stage.parquet"
    table = {"time [ms]": columns["time"], "pos (mm)": columns["position"],
             "force [kN]": columns["effort"]}  # fmt: skip
    pq.write_table(pa.table(table), path)
    log = read_log(path)
    np.testing.assert_array_equal(log.time, columns["time"] * 1e-3)
    np.testing.assert_array_equal(log.measured_position, columns["position"] * 1e-3)
    np.testing.assert_array_equal(log.effort, columns["effort"] * 1e3)


def test_parquet_names_with_dots_and_other_types(columns, tmp_path):
    path = tmp_path / "stage.parquet"
    whole = np.arange(60)
    table = {"state": ["run"] * 60, "t": columns["time"], "axis.pos": whole.astype(np.int16),
             "tau": columns["effort"].astype(np.float32)}  # fmt: skip
    pq.write_table(pa.table(table), path)
    log = read_log(path, LogSchema(kind="rotary", position="axis.pos", effort="tau"))
    np.testing.assert_array_equal(log.measured_position, whole)
    np.testing.assert_array_equal(log.effort, columns["effort"].astype(np.float32))


@pytest.mark.parametrize(
    ("name", "library", "extra"),
    [
        ("parquet.parquet", "pyarrow", "parquet"),
        ("arrow.feather", "pyarrow", "parquet"),
        ("version-7.3.mat", "h5py", "hdf5"),
        ("datasets.h5", "h5py", "hdf5"),
        ("ros.mcap", "rosbags.highlevel", "ros"),
        ("version-1.bag", "rosbags.highlevel", "ros"),
        ("json.mcap", "mcap.reader", "ros"),
        ("protobuf.mcap", "mcap_protobuf.decoder", "ros"),
        ("measurement.tdms", "nptdms", "tdms"),
        ("version-4.mf4", "asammdf", "mdf"),
    ],
)
def test_a_missing_library_names_its_extra(name, library, extra, columns, tmp_path, monkeypatch):
    path = tmp_path / name
    EVERY_WRITER[name](path, columns)
    monkeypatch.setitem(sys.modules, library, None)
    with refuses("missing_extra", MissingExtraError, extra=extra):
        format_of(path).read(path)
