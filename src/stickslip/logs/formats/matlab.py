"""MATLAB files: version 5 and older through scipy, version 7.3 through h5py."""

import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.logs.formats.arrays import table_of_arrays
from stickslip.logs.table import Table
from stickslip.records import InputError, MissingExtraError

__all__ = ["read_matlab"]

_SIGNATURE_V73 = b"\x89HDF\r\n\x1a\n"
_USERBLOCK = 512

_TRUNCATED = (
    EOFError,
    IndexError,
    KeyError,
    MemoryError,
    NotImplementedError,
    OSError,
    OverflowError,
    RuntimeError,
    TypeError,
    ValueError,
    zlib.error,
)
"""What the libraries raise on files that are cut short or damaged."""


def read_matlab(path: Path) -> Table:
    """Read the numeric variables of a MATLAB file.

    Fields of structures are named ``structure.field``; the columns of a matrix ``name_1``,
    ``name_2`` and so on. Numbers are constants that expressions can use.

    Raises
    ------
    InputError
        If the file is damaged or holds no numeric variables.
    MissingExtraError
        If it is of version 7.3 and h5py is not installed.
    """
    with path.open("rb") as file:
        head = file.read(_USERBLOCK + len(_SIGNATURE_V73))
    read = _version_73 if head[_USERBLOCK:] == _SIGNATURE_V73 else _version_5
    try:
        variables = dict(read(path))
    except _TRUNCATED as error:
        if isinstance(error, MissingExtraError | InputError):
            raise
        raise InputError(
            "the file is no MATLAB file, or is cut short or damaged",
            where=path.name,
            remedy="save or copy it again",
        ) from error
    return table_of_arrays(variables, path.name, counts_from=1)


def _version_5(path: Path) -> Iterator[tuple[str, np.ndarray]]:
    import scipy.io

    try:
        variables: Mapping[str, Any] = scipy.io.loadmat(str(path), simplify_cells=True)
    except scipy.io.matlab.MatReadError as error:
        raise EOFError(str(error)) from error
    yield from _flat({k: v for k, v in variables.items() if not k.startswith("__")})


def _flat(variables: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, np.ndarray]]:
    for name, value in variables.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            array = np.asarray(value)
            if array.dtype.kind in "biuf":
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
            item.dtype.kind in "biuf"
            and item.attrs.get("MATLAB_class") != b"char"
            and not item.attrs.get("MATLAB_empty", 0)
        ):
            # MATLAB stores columns first and HDF5 rows first.
            yield prefix + name, np.asarray(item[()]).T
