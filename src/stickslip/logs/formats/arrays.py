"""Named arrays, as MATLAB and NPZ files hold them, as the columns of a log."""

from collections.abc import Mapping, Sequence

import numpy as np

from stickslip.logs.table import Column, Table, name_columns
from stickslip.records import InputError

__all__ = ["table_of_arrays"]


def table_of_arrays(variables: Mapping[str, np.ndarray], label: str, *, counts_from: int) -> Table:
    """Return arrays as a table: vectors are columns, matrices have several, numbers are constants.

    Parameters
    ----------
    variables
        Numeric arrays by name.
    label
        What the log is called in messages.
    counts_from
        The index of the first sample, as the users of the format count.

    Raises
    ------
    InputError
        If there is no column among them.
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
                notes.append(
                    f"{name} is {values.shape[0]} x {values.shape[1]}; its longer side is taken as "
                    "time"
                )
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
    )
