"""Reading a CSV log of a million rows."""

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

__all__ = ["compare"]

_ROWS = 1_000_000
_SAMPLING_TIME = 0.001
_SECONDS = 2.0
"""A million rows are to be read in this time [s]."""

_DECIMALS = 9
_ROUNDING = 0.5 * 10.0**-_DECIMALS

pandas = cast("Any", _pandas)


def _write(path: Path) -> np.ndarray:
    """Write four columns of numbers with nine decimals; return the positions."""
    time = np.arange(_ROWS) * _SAMPLING_TIME
    position = 0.5 * np.sin(0.7 * time) + 0.1 * np.sin(31.0 * time)
    columns = {
        "time [s]": time,
        "effort [N]": 20.0 * np.sign(np.cos(0.7 * time)) + np.sin(5.0 * time),
        "position [m]": position,
        "velocity [m/s]": 0.35 * np.cos(0.7 * time) + 3.1 * np.cos(31.0 * time),
    }
    polars.DataFrame(columns).write_csv(path, float_precision=_DECIMALS)
    return position


def _by_stickslip(path: Path) -> Any:
    return read_log(path).measured_position


def _by_polars(path: Path) -> Any:
    return polars.read_csv(path)["position [m]"].to_numpy()


def _by_pandas(path: Path) -> Any:
    return pandas.read_csv(path)["position [m]"].to_numpy()


def _by_numpy(path: Path) -> Any:
    return np.loadtxt(path, delimiter=",", skiprows=1)[:, 2]


def compare(progress: Progress) -> list[Comparison]:
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
        )
    ]
