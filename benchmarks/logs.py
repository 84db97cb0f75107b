"""Reading CSV logs of a million and of ten million rows, and an MCAP file of seven joints."""

import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np
import pandas as _pandas
import polars
from rich.progress import Progress

from benchmarks.measuring import Comparison, Row, Target, best_time
from stickslip.logs import read_log

_ROWS = 1_000_000
_SAMPLING_TIME = 0.001
_SECONDS = 2.0
"""A million rows are to be read in this time [s]."""

_MANY_ROWS = 10_000_000
_SECONDS_OF_MANY, _GIGABYTES_OF_MANY = 5.0, 1.5
"""Processor time [s] and memory [GB] in which ten million rows are to be read."""

MESSAGES = 100_000
"""Joint states of the bag; a file of 1 GB has 2.9 million."""

_AT_ONCE = 10_000
_SHARE_OF_ROSBAGS = 0.5
"""Speed of reading a bag, over that of decoding its messages alone [-]."""

_READING = """
import resource, sys, time
from stickslip.logs import LogSchema, read_axes
logs = read_axes(sys.argv[1], LogSchema(kind=sys.argv[2]))
own, of = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
taken = max(own.ru_maxrss, of.ru_maxrss) * 1024
print(own.ru_utime + own.ru_stime + of.ru_utime + of.ru_stime, taken)
"""
_DECODING = """
import sys, time
from pathlib import Path
from rosbags.highlevel import AnyReader
with AnyReader([Path(sys.argv[1])]) as reader:
    for connection, _, raw in reader.messages():
        reader.deserialize(raw, connection.msgtype)
print(time.process_time())
"""

_DECIMALS = 9
_ROUNDING = 0.5 * 10.0**-_DECIMALS

pandas = cast("Any", _pandas)


def _write(path: Path, first: int = 0) -> np.ndarray:
    """Append four columns of numbers with nine decimals; return the positions."""
    time = np.arange(first, first + _ROWS) * _SAMPLING_TIME
    position = 0.5 * np.sin(0.7 * time) + 0.1 * np.sin(31.0 * time)
    columns = {
        "time [s]": time,
        "effort [N]": 20.0 * np.sign(np.cos(0.7 * time)) + np.sin(5.0 * time),
        "position [m]": position,
        "velocity [m/s]": 0.35 * np.cos(0.7 * time) + 3.1 * np.cos(31.0 * time),
    }
    with path.open("ab") as file:
        polars.DataFrame(columns).write_csv(
            file, float_precision=_DECIMALS, include_header=first == 0
        )
    return position


def _write_bag(path: Path, messages: int) -> int:
    """Write joint states of seven joints at 1 kHz, and return the bytes of the file."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    kind = "sensor_msgs/msg/JointState"
    store = get_typestore(Stores.ROS2_HUMBLE)
    types: Any = store.types
    names = [f"joint_{k}" for k in range(7)]
    marks = -1.0 - np.arange(21.0).reshape(3, 7)
    message = types[kind](
        header=types["std_msgs/msg/Header"](
            stamp=types["builtin_interfaces/msg/Time"](sec=1, nanosec=2), frame_id=""
        ),
        name=names,
        position=marks[0],
        velocity=marks[1],
        effort=marks[2],
    )
    # All messages have one length: the numbers of the first are replaced, 20 times as fast
    first = bytes(store.serialize_cdr(message, kind))
    stamp = first.index(np.array([1, 2], np.int32).tobytes())
    numbers = [first.index(row.tobytes()) for row in marks]
    phases = np.arange(7.0)
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topic = writer.add_connection("/joint_states", kind, typestore=store)
        for begin in range(0, messages, _AT_ONCE):
            count = np.arange(begin, min(begin + _AT_ONCE, messages))
            raw = np.tile(np.frombuffer(first, np.uint8), (count.size, 1))
            stamps = np.column_stack([count // 1000, count % 1000 * 10**6]).astype(np.int32)
            raw[:, stamp : stamp + 8] = stamps.view(np.uint8)
            angle = 0.003 * count[:, None] + phases
            values = (np.sin(angle), np.cos(angle), np.cos(1.7 * angle))
            for place, each in zip(numbers, values, strict=True):
                raw[:, place : place + 56] = np.ascontiguousarray(each).view(np.uint8)
            for k, row in zip(count.tolist(), raw, strict=True):
                writer.write(topic, k * 10**6, row.tobytes())
    return sum(each.stat().st_size for each in path.glob("*.mcap"))


def _apart(code: str, *arguments: str) -> list[float]:
    """Return the numbers that code prints in a process of its own."""
    command = [sys.executable, "-c", code, *arguments]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return [float(word) for word in done.stdout.split()]


def _many_rows(folder: Path) -> Comparison:
    """Return processor time and memory of reading ten million rows, with all imports."""
    path = folder / "many.csv"
    for first in range(0, _MANY_ROWS, _ROWS):
        _write(path, first)
    seconds, memory = _apart(_READING, str(path), "linear")
    return Comparison(
        title="A CSV log of ten million rows, four columns, processor time with imports",
        item="row",
        error_name="",
        rows=(
            Row(
                name=f"stickslip, checked ({memory / 1e9:.2f} GB)",
                nanoseconds=seconds / _MANY_ROWS * 1e9,
                error=None,
                ours=True,
            ),
        ),
        targets=(
            Target(text="seconds for ten million rows", measured=seconds, limit=_SECONDS_OF_MANY),
            Target(text="GB of memory", measured=memory / 1e9, limit=_GIGABYTES_OF_MANY),
        ),
    )


def _bag(folder: Path, messages: int) -> Comparison:
    """Return processor times of reading a bag, with all imports."""
    path = folder / "robot"
    size = _write_bag(path, messages)
    (theirs,) = _apart(_DECODING, str(path))
    ours, memory = _apart(_READING, str(path), "rotary")
    return Comparison(
        title=f"An MCAP file of seven joints, {messages} messages, {size / 1e9:.2g} GB, processor "
        "time with imports",
        item="message",
        error_name="",
        rows=(
            Row(
                name=f"stickslip, logs of seven joints ({memory / 1e9:.2g} GB)",
                nanoseconds=ours / messages * 1e9,
                error=None,
                ours=True,
            ),
            Row(
                name="rosbags, decoded messages",
                nanoseconds=theirs / messages * 1e9,
                error=None,
            ),
        ),
        targets=(
            Target(text="times as long as rosbags", measured=ours / theirs,
                   limit=1.0 / _SHARE_OF_ROSBAGS),
        ),
    )  # fmt: skip


def _by_stickslip(path: Path) -> Any:
    return read_log(path).measured_position


def _by_polars(path: Path) -> Any:
    return polars.read_csv(path)["position [m]"].to_numpy()


def _by_pandas(path: Path) -> Any:
    return pandas.read_csv(path)["position [m]"].to_numpy()


def _by_numpy(path: Path) -> Any:
    return np.loadtxt(path, delimiter=",", skiprows=1)[:, 2]


def compare(progress: Progress, messages: int = MESSAGES) -> list[Comparison]:
    """Read the same file with this package (validated) and with others (as columns only)."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        task = progress.add_task("writing a million rows", total=5)
        position = _write(path)
        progress.advance(task)
        ways: list[tuple[str, Callable[[Path], Any], int]] = [
            ("stickslip, checked", _by_stickslip, 3),
            ("polars.read_csv, columns only", _by_polars, 3),
            ("pandas.read_csv, columns only", _by_pandas, 3),
            ("numpy.loadtxt, columns only", _by_numpy, 1),
        ]
        rows: list[Row] = []
        for name, read, repetitions in ways:
            progress.update(task, description=f"reading with {name}")
            seconds = best_time(partial(read, path), repetitions=repetitions)
            error = float(np.abs(read(path) - position).max())
            rows.append(
                Row(name=name, nanoseconds=seconds / _ROWS * 1e9, error=error, ours=not rows)
            )
            progress.advance(task)
        path.unlink()
        further: list[Comparison] = []
        for title, measured in (
            ("ten million rows", _many_rows),
            ("a bag", partial(_bag, messages=messages)),
        ):
            task = progress.add_task(f"reading {title}", total=1)
            further.append(measured(Path(folder)))
            progress.advance(task)
    return [
        Comparison(
            title=f"A CSV log of a million rows, four columns, rounded to {_ROUNDING:.0e}",
            item="row",
            error_name="error, m",
            rows=tuple(rows),
            targets=(
                Target(
                    text="seconds for a million rows",
                    measured=rows[0].nanoseconds * _ROWS * 1e-9,
                    limit=_SECONDS,
                ),
            ),
        ),
        *further,
    ]
