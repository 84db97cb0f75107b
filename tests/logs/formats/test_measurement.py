"""HDF5, TDMS, MDF, LeRobot and the objects of MATLAB beyond equal columns."""

import gc
import json
import tempfile

import h5py
import numpy as np
import pyarrow.parquet as pq
import pytest
from asammdf.blocks.utils import MdfException
from matlab_files import write_matlab_73
from measurement_files import (
    ROTATION,
    write_lerobot,
    write_mdf,
    write_simulink,
    write_sysid,
    write_tdms_waveforms,
    write_time_series,
    write_timetable,
)
from sample_files import read

from stickslip.logs import LogSchema, read_axes, read_log
from stickslip.records import InputError


def test_slices_fields_and_units_of_hdf5(columns, tmp_path):
    path = tmp_path / "arm.h5"
    with h5py.File(path, "w") as file:
        file["arm/q"] = np.stack([columns["position"], columns["load_position"]], axis=1)
        file["arm/q"].attrs["units"] = "deg"
        file["arm/t"] = columns["time"]
        file["arm/tensor"] = np.arange(60 * 4).reshape(60, 2, 2)
        file["arm/camera"] = np.zeros((60, 8, 16), np.uint8)
        file["slow/temperature"] = np.arange(6.0)
        rows = np.zeros(60, [("force", "f4"), ("name", "S4")])
        rows["force"] = columns["effort"]
        file["log"] = rows
        file["gain"] = 2.5
        file["elsewhere"] = h5py.ExternalLink("/etc/passwd", "/x")
    table, loaded = read(path)
    np.testing.assert_array_equal(loaded["/arm/q[:,1]"], columns["load_position"])
    np.testing.assert_array_equal(loaded["/arm/tensor[:,1,0]"], np.arange(2.0, 240.0, 4))
    np.testing.assert_array_equal(loaded["/log/force"], columns["effort"].astype(np.float32))
    assert table.units == {"/arm/q[:,0]": "deg", "/arm/q[:,1]": "deg"}
    assert table.constants == {"/gain": 2.5}
    assert table.notes == ("/arm/camera has too many columns and is left out",)
    assert table.group_of("/slow/temperature") is not table.group_of("/arm/t")
    log = read_log(
        path,
        LogSchema(kind="rotary", time="/arm/t", position="/arm/q[:, 1]", effort="/log/force"),
    )
    np.testing.assert_allclose(
        log.measured_position, np.deg2rad(columns["load_position"]), rtol=1e-15
    )


def test_a_waveform_has_its_time(columns, tmp_path):
    path = tmp_path / "wave.tdms"
    write_tdms_waveforms(path, columns, 0.01)
    table, loaded = read(path)
    (group,) = table.groups
    assert group.time == "stage/time"
    np.testing.assert_allclose(loaded["stage/time"], columns["time"], rtol=1e-14)
    assert table.units["stage/effort"] == "V"


def test_channels_of_mdf_have_units_and_a_group(columns, tmp_path):
    path = tmp_path / "bench.mf4"
    write_mdf(path, columns, {"position": "mm"})
    table, _ = read(path)
    assert table.units == {"position": "mm", "time": "s"}
    assert table.group_of("effort").time == "time"
    assert table.origins["effort"] == "stage"


@pytest.mark.parametrize(
    ("name", "unfinished"), [("arm.mf4", False), ("arm.mf4", True), ("arm.mdf", False)]
)
def test_a_refused_mdf_leaves_no_temporary_file(columns, tmp_path, monkeypatch, name, unfinished):
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    path = tmp_path / name
    write_mdf(path, columns)
    content = bytearray(path.read_bytes())
    content[60] = unfinished  # the first of the standard flags of an unfinished log
    content[64:] = bytes(len(content) - 64)
    path.write_bytes(content)
    with pytest.raises(MdfException):
        read(path)
    gc.collect()  # an object that is left half made would complain here, which fails a test
    assert not list(temporary.iterdir())


def test_rotations_of_sysid_are_multiplied_and_tests_sorted_by_time(columns, tmp_path):
    path = tmp_path / "log.json"
    write_sysid(path, columns)
    text = path.read_text()
    _, loaded = read(path)
    np.testing.assert_array_equal(loaded["velocity"], columns["velocity"] / ROTATION * ROTATION)
    np.testing.assert_array_equal(np.diff(loaded["time"]) > 0, np.ones(59, bool))
    for content, reason in [
        ("[1]", "it has none of their tests"),
        ('{"slow-forward": 3}', "slow-forward is no list of rows"),
        ('{"slow-forward": [[1, 2]]}', "slow-forward has no rows of 4 or 9 numbers"),
        ('{"slow-forward": [[1, 2, 3, 4], [1]]}', "slow-forward has no rows of 4 or 9 numbers"),
        (text.replace(f": {ROTATION},", ': "x",'), "unitsPerRotation is no number"),
    ]:
        path.write_text(content)
        with pytest.raises(InputError, match=reason):
            read(path)


def test_episodes_of_lerobot_follow_one_another(columns, tmp_path):
    write_lerobot(tmp_path / "pick", columns, episodes=3)
    table, loaded = read(tmp_path / "pick")
    assert list(table.headers) == [
        "observation.state/shoulder.pos",
        "observation.state/elbow.pos",
        "observation.effort",
        "action/shoulder.pos",
        "action/elbow.pos",
        "timestamp",
    ]
    np.testing.assert_array_equal(loaded["observation.state/elbow.pos"], columns["load_position"])
    np.testing.assert_array_equal(loaded["action/elbow.pos"], columns["load_position"] + 1.0)
    steps = np.diff(loaded["timestamp"])
    np.testing.assert_allclose(steps[[19, 39]], 1.0, rtol=1e-6)
    np.testing.assert_allclose(np.delete(steps, [19, 39]), 0.01, rtol=1e-4)
    log = read_log(
        tmp_path / "pick",
        LogSchema(
            kind="rotary", time="timestamp", position="observation.state/shoulder.pos",
            effort="observation.effort",
        ),
    )  # fmt: skip
    assert log.segment_starts.tolist() == [0, 20, 40]


@pytest.mark.parametrize("names", [{"motors": ["waist", "wrist"]}, [["waist", "wrist"]]])
def test_joints_of_lerobot_are_axes(names, columns, tmp_path):
    write_lerobot(tmp_path / "pick", columns)
    info = tmp_path / "pick/meta/info.json"
    document = json.loads(info.read_text())
    both = {"dtype": "float64", "shape": [2], "names": names}
    document["features"].update({"observation.state": both, "observation.effort": both})
    info.write_text(json.dumps(document))
    for file in tmp_path.glob("pick/data/**/*.parquet"):
        data = pq.read_table(file).drop_columns("observation.effort")
        pq.write_table(data.append_column("observation.effort", data["action"]), file)
    logs = read_axes(tmp_path / "pick", LogSchema(kind="rotary"))
    assert list(logs) == ["waist", "wrist"]
    np.testing.assert_array_equal(logs["wrist"].measured_position, columns["load_position"])
    np.testing.assert_array_equal(logs["wrist"].effort, columns["load_position"] + 1.0)
    np.testing.assert_array_equal(logs["waist"].measured_position, columns["position"])
    np.testing.assert_array_equal(logs["waist"].effort, columns["position"] + 1.0)
    assert "preset lerobot" in logs["waist"].source.assumptions[1]


@pytest.mark.parametrize("version", ["v7", "v7.3"])
@pytest.mark.parametrize(
    ("write", "prefix"),
    [(write_time_series, ""), (write_timetable, "stage."), (write_simulink, "logsout.")],
)
def test_objects_of_matlab_have_their_own_time(write, prefix, version, columns, tmp_path):
    path = tmp_path / "stage.mat"
    write(path, columns, version)
    table, loaded = read(path)
    for name, values in columns.items():
        if name != "time":
            time = table.group_of(prefix + name).time
            assert time is not None
            np.testing.assert_allclose(loaded[time], columns["time"], rtol=1e-14)
            np.testing.assert_array_equal(loaded[prefix + name], values)


def test_a_structure_with_time_of_simulink(columns, tmp_path):
    import scipy.io

    signals = np.zeros(2, dtype=[("values", object), ("label", object)])
    signals[0] = (columns["position"][:, None], "pos")
    signals[1] = (columns["effort"][:, None], "force")
    path = tmp_path / "out.mat"
    scipy.io.savemat(path, {"out": {"time": columns["time"], "signals": signals}})
    _, loaded = read(path)
    np.testing.assert_array_equal(loaded["out.time"], columns["time"])
    np.testing.assert_array_equal(loaded["out.signals_2.values"], columns["effort"])


def test_lengths_of_arrays_are_groups(columns, tmp_path):
    path = tmp_path / "two.mat"
    write_matlab_73(path, {**columns, "temperature": np.arange(7.0)})
    table, _ = read(path)
    assert [group.name for group in table.groups] == ["60 samples", "7 samples"]
    assert table.group_of("temperature").columns == ("temperature",)
