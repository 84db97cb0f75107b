"""One sample of every format, each written by a library of that format or by hand."""

import bz2
import gzip
import io
import lzma
import zipfile

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import scipy.io
from matlab_files import write_matlab_73
from measurement_files import (
    write_hdf5,
    write_mdf,
    write_simulink,
    write_sysid,
    write_tdms,
    write_time_series,
    write_timetable,
)
from message_files import write_mcap_json, write_mcap_protobuf, write_ros_1, write_ros_2_file
from pyarrow import feather
from rosbags.rosbag2 import StoragePlugin

from stickslip.logs.formats.registry import folder_format, format_of


def write_arrow_stream(path, columns):
    """Write columns as an Arrow IPC stream."""
    table = pa.table(columns)
    with pa.ipc.new_stream(path, table.schema) as stream:
        stream.write_table(table)


def motion(samples=60, seed=20):
    """Return, by channel, a motion in numbers of 17 digits."""
    generator = np.random.default_rng(seed)
    time = np.arange(samples) / 100  # which whole nanoseconds hold
    return {
        "time": time,
        "position": np.sin(5 * time) + generator.normal(scale=1e-3, size=samples),
        "velocity": 5 * np.cos(5 * time),
        "load_position": np.sin(5 * time - 0.1),
        "load_velocity": 5 * np.cos(5 * time - 0.1),
        "effort": generator.normal(size=samples) * 1e3,
    }


def text_of(columns, delimiter=",", decimal="."):
    """Return columns as text below their names."""
    rows = [delimiter.join(columns)]
    for row in zip(*columns.values(), strict=True):
        rows.append(delimiter.join(repr(float(each)).replace(".", decimal) for each in row))
    return "\n".join(rows) + "\n"


def write_text(path, columns, delimiter=",", decimal="."):
    """Write columns as text."""
    path.write_text(text_of(columns, delimiter, decimal))


def write_compressed(path, columns):
    """Write text in a compressed file, of the kind that the ending says."""
    compress = {".gz": gzip.compress, ".bz2": bz2.compress, ".xz": lzma.compress}
    content = text_of(columns).encode()
    if path.suffix == ".zip":
        archive = io.BytesIO()
        with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
            file.writestr("log.csv", content)
        path.write_bytes(archive.getvalue())
    else:
        path.write_bytes(compress[path.suffix](content))


def write_twincat(path, columns, *, delimiter="\t", decimal=",", slower=4, end=True):
    """Write an export of TwinCAT Scope with two rate groups.

    The fast one has position and effort, the slow one every ``slower``-th velocity.
    """

    def row(*cells):
        return delimiter.join(cells)

    names = row("Name", "axis pos", "axis torque", "Name", "axis vel")
    rows = [
        row("Name", path.stem),
        row("File", rf"C:\\exports\\{path.name}"),
        row("Starttime of export", "133500000000000000", "Friday, 1 March 2024", "12:00:00.000"),
        row("Endtime of export", "133500000006000000", "Friday, 1 March 2024", "12:00:00.600"),
        "",
        names,
        row("SymbolComment", "", "", "SymbolComment", ""),
        row("Data-Type", "REAL64", "REAL64", "Data-Type", "REAL64"),
        row("SampleTime[ms]", "10", "10", "SampleTime[ms]", str(10 * slower)),
        row("SymbolName", "MAIN.pos", "MAIN.torque", "SymbolName", "MAIN.vel"),
        row("Unit", "mm (Length)", "Nm (Torque)", "Unit", "(None)"),
        "",
    ]
    for k, time in enumerate(columns["time"]):
        cells = [time * 1e3, columns["position"][k], columns["effort"][k]]
        if k * slower < columns["time"].size:
            cells += [columns["time"][k * slower] * 1e3, columns["velocity"][k * slower]]
        text = [repr(float(each)).replace(".", decimal) for each in cells]
        rows.append(row(*text, *[" "] * (5 - len(text))))
    path.write_text("\n".join([*rows, *(["EOF"] if end else []), ""]))


OF_ALL_CHANNELS = {
    "comma.csv": write_text,
    "semicolon.csv": lambda path, columns: write_text(path, columns, ";"),
    "decimal-comma.csv": lambda path, columns: write_text(path, columns, ";", ","),
    "tab.tsv": lambda path, columns: write_text(path, columns, "\t"),
    "tab-decimal-comma.txt": lambda path, columns: write_text(path, columns, "\t", ","),
    "blanks.txt": lambda path, columns: write_text(path, columns, "   "),
    "structured.npy": lambda path, columns: np.save(
        path, np.rec.fromarrays([*columns.values()], names=[*columns])
    ),
    "arrow.feather": lambda path, columns: feather.write_feather(pa.table(columns), path),
    "stream.arrow": write_arrow_stream,
    "parquet.parquet": lambda path, columns: pq.write_table(pa.table(columns), path),
    "version-4.mat": lambda path, columns: scipy.io.savemat(path, columns, format="4"),
    "version-5.mat": scipy.io.savemat,
    "compressed.mat": lambda path, columns: scipy.io.savemat(path, columns, do_compression=True),
    "rows.mat": lambda path, columns: scipy.io.savemat(path, columns, oned_as="row"),
    "version-7.3.mat": write_matlab_73,
    "archive.npz": lambda path, columns: np.savez(path, **columns),
    "compressed.npz": lambda path, columns: np.savez_compressed(path, **columns),
    "datasets.h5": write_hdf5,
    "measurement.tdms": write_tdms,
    "version-4.mf4": write_mdf,
    "version-3.mdf": write_mdf,
    "json.mcap": write_mcap_json,
    "protobuf.mcap": write_mcap_protobuf,
}
"""Writers of all six channels, by a file's name."""

OF_JOINTS = {
    "version-1.bag": write_ros_1,
    "sqlite.db3": lambda path, columns: write_ros_2_file(path, columns, StoragePlugin.SQLITE3),
    "ros.mcap": lambda path, columns: write_ros_2_file(path, columns, StoragePlugin.MCAP),
}
"""Writers of joint states."""

OF_A_MECHANISM = {"sysid.json": write_sysid}
"""Writers of time, voltage, position and velocity."""

COMPRESSED = {f"log.csv{ending}": write_compressed for ending in (".gz", ".bz2", ".xz", ".zip")}

WITH_RATES = {
    "twincat.csv": write_twincat,
    "time-series-7.mat": lambda path, columns: write_time_series(path, columns, "v7"),
    "time-series-7.3.mat": lambda path, columns: write_time_series(path, columns, "v7.3"),
    "timetable-7.mat": lambda path, columns: write_timetable(path, columns, "v7"),
    "timetable-7.3.mat": lambda path, columns: write_timetable(path, columns, "v7.3"),
    "simulink-7.mat": lambda path, columns: write_simulink(path, columns, "v7"),
    "simulink-7.3.mat": lambda path, columns: write_simulink(path, columns, "v7.3"),
}
"""Writers of groups of columns with time stamps of their own."""

EVERY_FILE = {**OF_ALL_CHANNELS, **OF_JOINTS, **OF_A_MECHANISM, **COMPRESSED, **WITH_RATES}


def read(path):
    """Return the table of a file or folder, and all its columns."""
    entry = folder_format(path) if path.is_dir() else format_of(path)
    table = entry.read(path)
    return table, table.load(list(table.headers))
