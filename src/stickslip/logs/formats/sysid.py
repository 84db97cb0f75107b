"""Logs of WPILib SysId, in JSON, as columns."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from stickslip.logs.formats.arrays import table_of_arrays
from stickslip.logs.table import Table
from stickslip.records import InputError

_TESTS = ("slow-forward", "slow-backward", "fast-forward", "fast-backward")
_LARGEST = 500_000_000  # bytes: a JSON file is read as a whole

_COLUMNS: Mapping[int, tuple[str, ...]] = MappingProxyType(
    {
        4: ("time", "voltage", "position", "velocity"),
        9: (
            "time",
            "left_voltage",
            "right_voltage",
            "left_position",
            "right_position",
            "left_velocity",
            "right_velocity",
            "heading",
            "heading_rate",
        ),
    }
)
"""Columns of a row, by their number: of one mechanism, and of the two sides of a drivetrain."""

_UNITS: Mapping[str, str] = MappingProxyType(
    {
        "meters": "m",
        "feet": "ft",
        "inches": "in",
        "radians": "rad",
        "degrees": "deg",
        "rotations": "turn",
    }
)


def read_sysid(path: Path) -> Table:
    """Read the four tests of a SysId log, one after another as they were run.

    Positions and velocities are in rotations in the file; they are multiplied by its units per
    rotation, as SysId does.
    """
    if path.stat().st_size > _LARGEST:
        raise _no_log(path.name, "it is larger than such logs are")
    document = json.loads(path.read_bytes())
    if not isinstance(document, dict) or not any(test in document for test in _TESTS):
        raise _no_log(path.name, "it has none of their tests")
    tests = [_test(document, name, path.name) for name in _TESTS if document.get(name)]
    tests = [test for test in tests if test.size]
    if not tests or len({test.shape[1] for test in tests}) > 1:
        raise _no_log(path.name, "its tests have no common columns")
    tests.sort(key=lambda test: test[0, 0])
    rows = np.concatenate(tests)
    names = _COLUMNS[rows.shape[1]]
    factor = document.get("unitsPerRotation", 1.0)
    if not isinstance(factor, int | float):
        raise _no_log(path.name, "unitsPerRotation is no number")
    unit = _UNITS.get(str(document.get("units", "")).lower(), "")
    columns: dict[str, np.ndarray] = {}
    for k, name in enumerate(names):
        turned = name.endswith(("position", "velocity"))
        columns[_header(name, unit)] = rows[:, k] * (factor if turned else 1.0)
    return table_of_arrays(columns, path.name, counts_from=0)


def _no_log(label: str, reason: str) -> InputError:
    return InputError("no_sysid_log", where=label, reason=reason)


def _header(name: str, unit: str) -> str:
    """Return the name of a column with its unit in brackets."""
    if name == "time":
        return "time [s]"
    if name.endswith("voltage"):
        return f"{name} [V]"
    if name.startswith("heading") or not unit:
        return name
    return f"{name} [{unit}]" if name.endswith("position") else f"{name} [{unit}/s]"


def _test(document: Mapping[str, Any], name: str, label: str) -> np.ndarray:
    rows: Any = document[name]
    if not isinstance(rows, Sequence) or isinstance(rows, str):
        raise _no_log(label, f"{name} is no list of rows")
    widths = {len(row) if isinstance(row, list) else 0 for row in rows}
    try:
        values = np.array(rows, dtype=np.float64)
    except (TypeError, ValueError):
        widths, values = set[int](), np.empty((0, 0))
    if len(widths) != 1 or not widths <= _COLUMNS.keys() or values.ndim != 2:
        listed = " or ".join(map(str, _COLUMNS))
        raise _no_log(label, f"{name} has no rows of {listed} numbers")
    return values
