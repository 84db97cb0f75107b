"""MATLAB files as columns, with time series, tables and data sets of Simulink."""

import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.errors import RequiredExtra
from stickslip.logs.formats.arrays import NUMERIC, table_of_arrays
from stickslip.logs.formats.hdf5 import h5py_for
from stickslip.logs.table import Table

_SIGNATURE_V73 = b"\x89HDF\r\n\x1a\n"
_USERBLOCK = 512  # bytes before the signature of HDF5
_SUBSYSTEM = slice(116, 124)
"""Place in the header of version 5 of the offset of the objects; blank or zero without any."""

_VERSION_73 = "a MATLAB 7.3 file"
_DEEPEST = 20  # levels of nested structures
_DATA, _TIME = ("Data_", "Data"), ("Time_", "Time")
_UNIFORM = ("Start", "Increment", "Length")
_DATA_UNITS, _DATA_INFO, _TIME_INFO = "Units", "DataInfo", "TimeInfo"

_Variable = tuple[str, np.ndarray]


def read_matlab(path: Path) -> Table:
    """Read the numeric variables of a MATLAB file, version 7.3 through h5py, others through scipy.

    Fields of structures are named ``structure.field``; the columns of a matrix ``name_1``,
    ``name_2`` and so on. Numbers are constants that expressions can use. Time series, timetables,
    tables and data sets of Simulink are read through mat-io.
    """
    with path.open("rb") as file:
        head = file.read(_USERBLOCK + len(_SIGNATURE_V73))
    is_73 = head[_USERBLOCK:] == _SIGNATURE_V73
    found = _Found()
    with_objects = _has_objects(path, head, is_73=is_73)
    read = _with_objects if with_objects else _version_73 if is_73 else _version_5
    for name, value in read(path):
        if not name.startswith("__"):
            found.visit(name, value, 0)
    return table_of_arrays(
        found.arrays, path.name, counts_from=1, times=found.times, notes=found.notes
    )


def _has_objects(path: Path, head: bytes, *, is_73: bool) -> bool:
    """Return whether a file holds objects of classes."""
    if not is_73:
        return head[:6] == b"MATLAB" and bool(head[_SUBSYSTEM].strip(b"\0 "))
    with h5py_for(path.name, _VERSION_73).File(path, "r") as file:
        return "#subsystem#" in file


def _with_objects(path: Path) -> Iterable[tuple[str, Any]]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about classes that have no counterpart in Python
        purpose = f"{path.name} holds time series, tables or other objects; reading it"
        with RequiredExtra("matlab", purpose):
            from matio import load_from_mat
        return load_from_mat(str(path)).items()


def _version_5(path: Path) -> Iterable[tuple[str, Any]]:
    import scipy.io

    return scipy.io.loadmat(str(path), simplify_cells=True).items()


def _version_73(path: Path) -> Iterator[_Variable]:
    with h5py_for(path.name, _VERSION_73).File(path, "r") as file:
        yield from _datasets(file, "", 0)


def _datasets(group: Any, prefix: str, depth: int) -> Iterator[_Variable]:
    for name, item in group.items():
        if name.startswith("#") or depth > _DEEPEST:
            continue
        if hasattr(item, "items"):
            yield from _datasets(item, f"{prefix}{name}.", depth + 1)
        elif (
            item.dtype.kind in NUMERIC
            and item.attrs.get("MATLAB_class") != b"char"
            and not item.attrs.get("MATLAB_empty", 0)
        ):
            # MATLAB stores columns first and HDF5 rows first.
            yield prefix + name, np.asarray(item[()]).T


class _Found:
    """Numeric arrays of a file by their names, and which of them are time stamps of which."""

    def __init__(self) -> None:
        self.arrays: dict[str, np.ndarray] = {}
        self.times: dict[str, str] = {}
        self.notes: list[str] = []

    def visit(self, name: str, value: Any, depth: int) -> None:
        """Add what a value holds: an array, a structure, a cell array, an object or a table."""
        if depth > _DEEPEST:
            return
        if hasattr(value, "properties") and hasattr(value, "classname"):
            self._object(name, value.properties, depth)
        elif hasattr(value, "columns") and hasattr(value, "index"):
            self._table(name, value)
        elif isinstance(value, Mapping):
            for field, each in value.items():
                self.visit(f"{name}.{field}", each, depth + 1)
        elif isinstance(value, np.ndarray) and value.dtype.names:
            for k, row in enumerate(value.ravel()):
                own = name if value.size == 1 else f"{name}_{k + 1}"
                for field in value.dtype.names:
                    self.visit(f"{own}.{field}", row[field], depth + 1)
        elif isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object):
            self._cells(name, value if isinstance(value, list) else list(value.ravel()), depth)
        elif (array := np.asarray(value)).dtype.kind in NUMERIC:
            self.arrays[name] = array

    def _cells(self, name: str, cells: Sequence[Any], depth: int) -> None:
        for k, each in enumerate(cells):
            title = _title(each)
            own = name if len(cells) == 1 else f"{name}_{k + 1}"
            self.visit(f"{name}.{title}" if title else own, each, depth + 1)

    def _object(self, name: str, properties: Any, depth: int) -> None:
        """Add an object: a time series has its data under its own name, others their properties."""
        if not isinstance(properties, Mapping):
            if isinstance(properties, np.ndarray):
                self._cells(name, list(properties.ravel()), depth)
            return
        data = next((properties[key] for key in _DATA if key in properties), None)
        data = None if data is None else np.asarray(data)
        time = None if data is None else _time_of(properties)
        if data is not None and time is not None and data.dtype.kind in NUMERIC:
            unit = _text(_parts(properties.get(_DATA_INFO)).get(_DATA_UNITS))
            own = f"{name} [{unit}]" if unit else name
            stamps = f"{name}.time"
            self.arrays[stamps] = time
            self.arrays[own] = _time_first(data, time.size)
            self.times[own] = stamps
            return
        for field, each in properties.items():
            # What holds the elements of a data set is no part of their names
            hidden = field.endswith("_") or field in {"Values", "Elements"}
            self.visit(name if hidden else f"{name}.{field}", each, depth + 1)

    def _table(self, name: str, frame: Any) -> None:
        """Add a table, or a timetable, whose rows have times."""
        stamps = None
        kind = frame.index.dtype.kind
        if kind in "mM":
            stamps = f"{name}.time"
            index = frame.index.to_numpy()
            steps = index - index[:1] if kind == "M" else index
            self.arrays[stamps] = steps.astype("timedelta64[ns]").astype(np.int64) / 1e9
            if kind == "M":
                self.notes.append(f"{stamps} is counted from its first date")
        for title in frame.columns:
            values = frame[title].to_numpy()
            if values.dtype.kind in NUMERIC:
                self.arrays[f"{name}.{title}"] = values
                if stamps is not None:
                    self.times[f"{name}.{title}"] = stamps


def _title(value: Any) -> str:
    """Return the name that an element of a data set has, or nothing."""
    if hasattr(value, "properties"):
        value = value.properties
    return _text(_parts(value).get("Name"))


def _parts(value: Any) -> Mapping[str, Any]:
    """Return the properties of an object or the fields of a structure; none of other values."""
    if isinstance(value, np.ndarray) and value.size == 1 and not value.dtype.names:
        value = value.item()
    value = getattr(value, "properties", value)
    if isinstance(value, np.ndarray) and value.dtype.names and value.size == 1:
        return {name: value[name].item() for name in value.dtype.names}
    return value if isinstance(value, Mapping) else {}


def _text(value: Any) -> str:
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.item()
    return value.strip() if isinstance(value, str) else ""


def _time_of(properties: Mapping[str, Any]) -> np.ndarray | None:
    """Return the time stamps of a time series, which may be stored as start, step and length."""
    sources = [properties, _parts(properties.get(_TIME_INFO))]
    for source in sources:
        for key in _TIME:
            stamps = np.asarray(source.get(key, []))
            if stamps.dtype.kind in NUMERIC and stamps.size > 1:
                return stamps.ravel().astype(np.float64)
    uniform = [np.asarray(sources[1].get(key, sources[1].get(f"{key}_", []))) for key in _UNIFORM]
    if any(each.size != 1 or each.dtype.kind not in NUMERIC for each in uniform):
        return None
    start, step, length = (float(each.item()) for each in uniform)
    if not 1 < length < 1e9 or not step > 0:
        return None
    return start + step * np.arange(int(length))


def _time_first(data: np.ndarray, samples: int) -> np.ndarray:
    """Return data with time as its first dimension; Simulink has it last in arrays of several."""
    squeezed = np.squeeze(data)
    if squeezed.ndim > 1 and squeezed.shape[0] != samples and squeezed.shape[-1] == samples:
        squeezed = np.moveaxis(squeezed, -1, 0)
    return squeezed if squeezed.ndim <= 2 else squeezed.reshape(samples, -1)
