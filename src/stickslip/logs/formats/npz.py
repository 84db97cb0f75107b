"""NumPy's archives of named arrays."""

import zipfile
import zlib
from pathlib import Path

import numpy as np

from stickslip.logs.formats.arrays import table_of_arrays
from stickslip.logs.table import Table
from stickslip.records import InputError

__all__ = ["read_npz"]

_DAMAGED = (
    EOFError,
    KeyError,
    NotImplementedError,
    OSError,
    SyntaxError,
    ValueError,
    zipfile.BadZipFile,
    zlib.error,
)
"""What reading an archive raises if it is cut short or damaged, or holds Python objects."""


def read_npz(path: Path) -> Table:
    """Read the numeric arrays of an NPZ file; nothing in it is run.

    Raises
    ------
    InputError
        If the file is damaged, holds Python objects, or has no numeric arrays.
    """
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            variables = {
                name: array
                for name in archive.files
                if (array := archive[name]).dtype.kind in "biuf"
            }
    except (AttributeError, TypeError, *_DAMAGED) as error:
        raise InputError(
            "the file is no NPZ archive of plain arrays, or is cut short or damaged",
            where=path.name,
            remedy="save it again with numpy.savez",
        ) from error
    return table_of_arrays(variables, path.name, counts_from=0)
