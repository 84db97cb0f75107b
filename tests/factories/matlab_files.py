"""Files as MATLAB writes them."""

import h5py
import numpy as np


def write_matlab_73(path, variables):
    """Write what MATLAB writes: HDF5 behind a text header, matrices with their axes swapped."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in variables.items():
            if isinstance(value, dict):
                group = file.create_group(name)
                group.attrs["MATLAB_class"] = np.bytes_("struct")
                for key, inner in value.items():
                    group.create_dataset(key, data=np.atleast_2d(inner))
            else:
                data = file.create_dataset(name, data=np.atleast_2d(value))
                data.attrs["MATLAB_class"] = np.bytes_("double")
        text = file.create_dataset("comment", data=np.array([[104], [105]], dtype=np.uint16))
        text.attrs["MATLAB_class"] = np.bytes_("char")
        file.create_group("#refs#")
    header = (
        b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Fri Mar 01 2024 HDF5 schema 1.00 ."
    )
    with path.open("r+b") as file:
        file.write(header.ljust(124) + b"\x00\x02IM")
