"""Logs of public benchmarks."""

from collections.abc import Callable
from pathlib import Path

import scipy.io

from stickslip.records import AxisLog

Find = Callable[[str], Path]


def emps(find: Find, name: str = "DATA_EMPS") -> AxisLog:
    """Return a log of the EMPS stage as its authors process it; see `benchmark_data`."""
    data = scipy.io.loadmat(find(f"emps/{name}.mat"))
    return AxisLog(
        name=name,
        kind="linear",
        time=data["t"].ravel(),
        effort=data["vir"].ravel() * data["gtau"].item(),
        measured_position=data["qm"].ravel(),
    )
