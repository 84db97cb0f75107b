"""Named arrays as the columns of a log, and NPZ archives of them."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from stickslip.logs.table import Column, RateGroup, Table, groups_by_length, name_columns
from stickslip.records import InputError

NUMERIC = "biuf"  # kinds of NumPy types


def table_of_arrays(
    variables: Mapping[str, np.ndarray],
    label: str,
    *,
    counts_from: int,
    times: Mapping[str, str] | None = None,
    notes: Sequence[str] = (),
) -> Table:
    """Return arrays as a table: vectors are columns, matrices have several, numbers are constants.

    ``counts_from`` is the index of the first sample, as the users of the format count; ``times``
    names, by variable, the one that has its time stamps.
    """
    constants: dict[str, float] = {}
    columns: dict[str, Column] = {}
    said = list(notes)
    variables, times = _without_copies(variables, times or {})
    origin: dict[str, str] = {}  # by column, its variable
    for name, array in variables.items():
        values = np.squeeze(array)
        if values.size == 1:
            constants[name] = float(values)
        elif values.ndim == 1 and values.size > 0:
            columns[name] = values
        elif values.ndim == 2 and values.size > 0:
            if values.shape[0] < values.shape[1]:
                shape = f"{values.shape[0]} x {values.shape[1]}"
                said.append(f"{name} is {shape}; its longer side is taken as time")
                values = values.T
            parts = {f"{name}_{k + 1}": values[:, k] for k in range(values.shape[1])}
            columns |= parts
            origin |= dict.fromkeys(parts, name)
    if not columns:
        raise InputError("no_numbers_over_time", where=label)
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
        notes=tuple(said),
        groups=_groups(dict(zip(columns, headers, strict=True)), columns, origin, times),
    )


def _without_copies(
    variables: Mapping[str, np.ndarray], times: Mapping[str, str]
) -> tuple[Mapping[str, np.ndarray], Mapping[str, str]]:
    """Return the variables without time stamps that are those of another, and who has which."""
    kept: dict[str, str] = {}
    for time in dict.fromkeys(times.values()):
        stamps = variables[time]
        kept[time] = next((k for k in kept.values() if np.array_equal(variables[k], stamps)), time)
    copies = {time for time, own in kept.items() if time != own}
    variables = {name: array for name, array in variables.items() if name not in copies}
    return variables, {name: kept[time] for name, time in times.items()}


def _groups(
    names: Mapping[str, str],
    columns: Mapping[str, Column],
    origin: Mapping[str, str],
    times: Mapping[str, str],
) -> tuple[RateGroup, ...]:
    """Return the columns with time stamps of their own by these, and the others by length.

    ``names`` are those of the table by those of the columns, ``origin`` the variables of some.
    """
    stamped: dict[str, list[str]] = {}
    for column in columns:
        time = times.get(origin.get(column, column), "")
        if time in columns:
            stamped.setdefault(time, [time]).append(column)
    taken = {column for group in stamped.values() for column in group}
    rest = {names[column]: each.size for column, each in columns.items() if column not in taken}
    alone = len(stamped) == 1 and not rest
    return (
        *(
            RateGroup(
                columns=tuple(names[column] for column in group),
                time=names[time],
                name="" if alone else names[time],
            )
            for time, group in stamped.items()
        ),
        *groups_by_length(rest),
    )


def read_npz(path: Path) -> Table:
    """Read the numeric arrays of an NPZ file; nothing in it is run."""
    with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in archive.files}
    numeric = {name: array for name, array in arrays.items() if array.dtype.kind in NUMERIC}
    return table_of_arrays(numeric, path.name, counts_from=0)
