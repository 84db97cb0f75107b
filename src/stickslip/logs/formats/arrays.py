"""Named arrays as the columns of a log, and files of NumPy with them."""

import zipfile
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy

from stickslip.logs.table import Column, RateGroup, Table, groups_by_length, name_columns
from stickslip.records import InputError

NUMERIC = "biuf"  # kinds of NumPy types

_LONGEST_HEADER = 1_000_000  # bytes: some 10,000 fields; NumPy takes 10,000 bytes of unknown files


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
    noted = list(notes)
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
                noted.append(f"{name} is {shape}; its longer side is taken as time")
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
        notes=tuple(noted),
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
    """Read the numeric arrays of an NPZ file; objects in it are skipped, as nothing is run.

    A field has the name of its array before its own where another array has a field of that name.
    """
    arrays: dict[str, dict[str, np.ndarray]] = {}
    with zipfile.ZipFile(path) as archive:
        for member in (each for each in archive.namelist() if each.endswith(".npy")):
            name = member.removesuffix(".npy")
            with archive.open(member) as file:
                arrays[name] = _variables(file, name)
    count = Counter(field for fields in arrays.values() for field in fields)
    variables = {
        field if count[field] == 1 or field == name else f"{name}.{field}": values
        for name, fields in arrays.items()
        for field, values in fields.items()
    }
    return table_of_arrays(variables, path.name, counts_from=0)


def read_npy(path: Path) -> Table:
    """Read the array of an NPY file: fields, or the columns of a matrix; nothing in it is run."""
    with path.open("rb") as file:
        return table_of_arrays(_variables(file, "column"), path.name, counts_from=0)


def _variables(file: Any, name: str) -> dict[str, np.ndarray]:
    """Return a stored array under its name, or its fields under theirs; none of no numbers."""
    version = npy.read_magic(file)
    read_header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    _, _, dtype = read_header(file, max_header_size=_LONGEST_HEADER)
    file.seek(0)
    if dtype.hasobject:
        return {}
    array = npy.read_array(file, allow_pickle=False, max_header_size=_LONGEST_HEADER)
    names = array.dtype.names  # those of the header are no UTF-8 in version 3.0
    fields = {name: array} if names is None else {k: array[k] for k in names}
    return {each: values for each, values in fields.items() if values.dtype.kind in NUMERIC}
