"""Measurement files, HDF5 files and data sets as the libraries of their formats write them."""

import json
import warnings

import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from asammdf import MDF, Signal
from nptdms import ChannelObject, TdmsWriter

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # it sets an option of pandas that is deprecated
    from matio import save_to_mat
    from matio.utils.matclass import MatlabOpaque

ROTATION = 0.25
"""Metres per rotation in a SysId log."""


def write_hdf5(path, columns):
    """Write a dataset for each column."""
    with h5py.File(path, "w") as file:
        for name, values in columns.items():
            file[f"stage/{name}"] = values


def write_tdms(path, columns):
    """Write a channel for each column, the time stamps as a channel too."""
    with TdmsWriter(path) as writer:
        writer.write_segment(
            [ChannelObject("stage", name, values) for name, values in columns.items()]
        )


def write_tdms_waveforms(path, columns, step):
    """Write waveforms, which have a start and a step instead of time stamps."""
    properties = {"wf_increment": step, "wf_start_offset": 0.0, "unit_string": "V"}
    with TdmsWriter(path) as writer:
        writer.write_segment(
            [
                ChannelObject("stage", name, values, properties)
                for name, values in columns.items()
                if name != "time"
            ]
        )


def write_mdf(path, columns, units=None):
    """Write a group with the columns over time, version 4 or 3 by the ending."""
    signals = [
        Signal(values, columns["time"], name=name, unit=(units or {}).get(name, ""))
        for name, values in columns.items()
        if name != "time"
    ]
    with MDF(version="3.30" if path.suffix == ".mdf" else "4.10") as file:
        file.append(signals, acq_name="stage")
        file.save(path, overwrite=True)


def write_sysid(path, columns, step=30):
    """Write two tests of a mechanism; positions and velocities are in rotations."""
    rows = [
        [time, effort, position / ROTATION, velocity / ROTATION]
        for time, effort, position, velocity in zip(
            *(columns[name].tolist() for name in ("time", "effort", "position", "velocity")),
            strict=True,
        )
    ]
    document = {
        "sysid": True,
        "test": "Simple",
        "units": "Meters",
        "unitsPerRotation": ROTATION,
        "fast-forward": rows[:step],
        "slow-backward": rows[step:],
        "slow-forward": [],
        "fast-backward": [],
    }
    path.write_text(json.dumps(document))


def write_lerobot(folder, columns, episodes=1):
    """Write a data set of version 3, with an arm of two joints, in two files."""
    names = ["shoulder.pos", "elbow.pos"]
    n = columns["time"].size // episodes
    state = np.stack([columns["position"], columns["load_position"]], axis=1)
    features = {
        "observation.state": {"dtype": "float64", "shape": [2], "names": names},
        "observation.effort": {"dtype": "float64", "shape": [1], "names": None},
        "action": {"dtype": "float64", "shape": [2], "names": {"motors": names}},
        "observation.images.front": {"dtype": "video", "shape": [480, 640, 3], "names": None},
        "timestamp": {"dtype": "float32", "shape": [1], "names": None},
        "episode_index": {"dtype": "int64", "shape": [1], "names": None},
    }
    (folder / "meta").mkdir(parents=True)
    info = {"codebase_version": "v3.0", "fps": 100, "features": features}
    (folder / "meta/info.json").write_text(json.dumps(info))
    table = pa.table(
        {
            "observation.state": pa.array(list(state), pa.list_(pa.float64(), 2)),
            "observation.effort": pa.array(columns["effort"]),
            "action": pa.array(list(state + 1.0), pa.list_(pa.float64())),
            "timestamp": pa.array(np.tile(columns["time"][:n], episodes), pa.float32()),
            "episode_index": pa.array(np.repeat(np.arange(episodes), n)),
        }
    )
    (folder / "data/chunk-000").mkdir(parents=True)
    for k, part in enumerate((table[:25], table[25:])):
        pq.write_table(part, folder / f"data/chunk-000/file-{k:03d}.parquet")


def time_series(time, values, *, uniform=False, unit=""):
    """Return a time series of MATLAB, with the properties that its class stores."""
    stamps = {"Start": time[0], "Increment": time[1] - time[0], "Length": float(time.size)}
    info = {"Units": "seconds", **(stamps if uniform else {})}
    properties = {
        "Name": "",
        "Data_": values.reshape(-1, 1),
        "Time_": np.empty((0, 0)) if uniform else time.reshape(-1, 1),
        "DataInfo": MatlabOpaque({"Units": unit}, "tsdata.datametadata"),
        "TimeInfo": MatlabOpaque(info, "tsdata.timemetadata"),
    }
    return MatlabOpaque(properties, "timeseries")


def write_time_series(path, columns, version):
    """Write a time series for each column, one of them with equal steps."""
    save_to_mat(
        str(path),
        {
            name: time_series(columns["time"], values, uniform=name == "velocity")
            for name, values in columns.items()
            if name != "time"
        },
        version=version,
    )


def write_timetable(path, columns, version):
    """Write a timetable of the columns."""
    index = pd.Index((columns["time"] * 1e3).round().astype("timedelta64[ms]"), name="Time")
    values = {name: each for name, each in columns.items() if name != "time"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about the unit that MATLAB shows
        save_to_mat(str(path), {"stage": pd.DataFrame(values, index=index)}, version=version)


def write_simulink(path, columns, version):
    """Write a data set of Simulink: a signal for each column, its values a time series."""
    signals = np.empty((len(columns) - 1, 1), dtype=object)
    for k, (name, values) in enumerate(each for each in columns.items() if each[0] != "time"):
        series = time_series(columns["time"], values)
        signals[k, 0] = MatlabOpaque(
            {"Name": name, "Values": series, "BlockPath": ""}, "Simulink.SimulationData.Signal"
        )
    elements = MatlabOpaque({"Elements": signals}, "Simulink.SimulationData.Storage")
    dataset = {"Name": "logsout", "Storage_": elements}
    save_to_mat(
        str(path),
        {"logsout": MatlabOpaque(dataset, "Simulink.SimulationData.Dataset")},
        version=version,
    )
