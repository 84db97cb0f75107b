"""Archives of named arrays, as the columns of a log: MATLAB files and NPZ files."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.logs.table import Column, Table, groups_by_length, name_columns
from stickslip.records import InputError, MissingExtraError

_NUMERIC = "biuf"  # kinds of NumPy types

_SIGNATURE_V73 = b"\x89HDF\r\n\x1a\n"
_USERBLOCK = 512


def table_of_arrays(variables: Mapping[str, np.ndarray], label: str, *, counts_from: int) -> Table:
    """Return arrays as a table: vectors are columns, matrices have several, numbers are constants.

    ``counts_from`` is the index of the first sample, as the users of the format count.
    """
    constants: dict[str, float] = {}
    columns: dict[str, Column] = {}
    notes: list[str] = []
    for name, array in variables.items():
        values = np.squeeze(array)
        if values.size == 1:
            constants[name] = float(values)
        elif values.ndim == 1 and values.size > 0:
            columns[name] = values
        elif values.ndim == 2 and values.size > 0:
            if values.shape[0] < values.shape[1]:
                shape = f"{values.shape[0]} x {values.shape[1]}"
                notes.append(f"{name} is {shape}; its longer side is taken as time")
                values = values.T
            columns |= {f"{name}_{k + 1}": values[:, k] for k in range(values.shape[1])}
    if not columns:
        raise InputError(
            "the file has no variables with numbers over time",
            where=label,
            remedy="save time, position and effort as numeric vectors (no tables or time series)",
        )
    headers, units = name_columns(list(columns))
    by_name = dict(zip(headers, columns.values(), strict=True))

    def load(names: Sequence[str]) -> dict[str, Column]:
        return {name: by_name[name].astype(np.float64) for name in names}

    return Table(
        label=label,
        headers=headers,
        units=units,
        constants=constants,
        load=load,
        place=lambda name, sample: f"{label}, {name} at index {sample + counts_from}",
        notes=tuple(notes),
        groups=groups_by_length({name: column.size for name, column in by_name.items()}),
    )


def read_npz(path: Path) -> Table:
    """Read the numeric arrays of an NPZ file; nothing in it is run."""
    with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in archive.files}
    numeric = {name: array for name, array in arrays.items() if array.dtype.kind in _NUMERIC}
    return table_of_arrays(numeric, path.name, counts_from=0)


def read_matlab(path: Path) -> Table:
    """Read the numeric variables of a MATLAB file, version 7.3 through h5py, others through scipy.

    Fields of structures are named ``structure.field``; the columns of a matrix ``name_1``,
    ``name_2`` and so on. Numbers are constants that expressions can use.
    """
    with path.open("rb") as file:
        head = file.read(_USERBLOCK + len(_SIGNATURE_V73))
    read = _version_73 if head[_USERBLOCK:] == _SIGNATURE_V73 else _version_5
    return table_of_arrays(dict(read(path)), path.name, counts_from=1)


def _version_5(path: Path) -> Iterator[tuple[str, np.ndarray]]:
    import scipy.io

    variables: Mapping[str, Any] = scipy.io.loadmat(str(path), simplify_cells=True)
    yield from _fields({k: v for k, v in variables.items() if not k.startswith("__")})


def _fields(variables: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, np.ndarray]]:
    for name, value in variables.items():
        if isinstance(value, Mapping):
            yield from _fields(value, f"{prefix}{name}.")
        elif (array := np.asarray(value)).dtype.kind in _NUMERIC:
            yield prefix + name, array


def _version_73(path: Path) -> Iterator[tuple[str, np.ndarray]]:
    try:
        import h5py
    except ImportError:
        raise MissingExtraError(
            f"{path.name} is a MATLAB 7.3 file; reading it", extra="hdf5"
        ) from None

    with h5py.File(path, "r") as file:
        yield from _datasets(file, "")


def _datasets(group: Any, prefix: str) -> Iterator[tuple[str, np.ndarray]]:
    for name, item in group.items():
        if name.startswith("#"):
            continue
        if hasattr(item, "items"):
            yield from _datasets(item, f"{prefix}{name}.")
        elif (
            item.dtype.kind in _NUMERIC
            and item.attrs.get("MATLAB_class") != b"char"
            and not item.attrs.get("MATLAB_empty", 0)
        ):
            # MATLAB stores columns first and HDF5 rows first.
            yield prefix + name, np.asarray(item[()]).T
