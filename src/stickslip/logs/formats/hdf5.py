"""HDF5 files as columns, each named by its path and, in a matrix, by its slice."""

from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.errors import RequiredExtra
from stickslip.logs.formats.arrays import NUMERIC
from stickslip.logs.table import Column, Table, groups_by_length
from stickslip.records import InputError

_MOST_COLUMNS = 100  # columns of one dataset: what has more is an image or a scan

_DEEPEST = 20  # levels of nested groups


def read_hdf5(path: Path) -> Table:
    """Read the numeric datasets of an HDF5 file; the first dimension is time.

    A column of a matrix is called ``/group/data[:,3]``, counted from 0, a field of a compound
    dataset ``/group/data/field``. A unit is that of the attribute ``unit`` or ``units``.
    """
    h5py = h5py_for(path.name, "an HDF5 file")
    places: dict[str, tuple[str, Any]] = {}
    units: dict[str, str] = {}
    constants: dict[str, float] = {}
    sizes: dict[str, int] = {}
    skipped: list[str] = []
    with h5py.File(path, "r") as file:
        for name, dataset in _datasets(file, "", 0):
            if dataset.size == 1 and dataset.dtype.kind in NUMERIC:
                constants[name] = float(np.squeeze(dataset[()]))
                continue
            columns = _columns(name, dataset)
            if columns is None:
                skipped.append(name)
                continue
            unit = dataset.attrs.get("unit", dataset.attrs.get("units"))
            unit = unit.decode(errors="replace") if isinstance(unit, bytes) else unit
            for column, part in columns:
                places[column] = (name, part)
                if isinstance(unit, str) and unit.strip():
                    units[column] = unit.strip()
                sizes[column] = int(dataset.shape[0])
    if not places:
        raise InputError("no_numbers_over_time", where=path.name)

    def load(names: Sequence[str]) -> dict[str, Column]:
        with h5py.File(path, "r") as file:
            whole: dict[str, Any] = {}
            loaded: dict[str, Column] = {}
            for name in names:
                dataset, part = places[name]
                if dataset not in whole:  # once, as chunks hold all columns
                    whole[dataset] = file[dataset][()]
                values = whole[dataset]
                own = values if part is None else values[part]
                loaded[name] = np.array(own, dtype=np.float64)
            return loaded

    return Table(
        label=path.name,
        headers={name: name for name in places},
        units=units,
        constants=constants,
        load=load,
        place=lambda name, sample: f"{path.name}, {name} at index {sample}",
        notes=tuple(f"{name} has too many columns and is left out" for name in skipped),
        groups=groups_by_length(sizes),
    )


def h5py_for(label: str, kind: str) -> Any:
    """Return the library h5py, which a file of a kind needs."""
    with RequiredExtra("hdf5", f"{label} is {kind}; reading it"):
        import h5py
    return h5py


def _datasets(group: Any, path: str, depth: int) -> Iterator[tuple[str, Any]]:
    """Yield the datasets of numbers over time with their paths; links are not followed."""
    import h5py

    if depth > _DEEPEST:
        return
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        item = group[name]
        if isinstance(item, h5py.Group):
            yield from _datasets(item, f"{path}/{name}", depth + 1)
        elif _is_numeric(item):
            yield f"{path}/{name}", item


def _is_numeric(dataset: Any) -> bool:
    """Return whether a dataset holds numbers or rows of them; a data type of its own holds none."""
    if not getattr(dataset, "size", None):
        return False
    return dataset.dtype.kind in NUMERIC or bool(dataset.dtype.names)


def _columns(name: str, dataset: Any) -> list[tuple[str, Any]] | None:
    """Return the columns of a dataset, each with its part of the values; None if there are many."""
    if dataset.dtype.names:
        kinds = [(field, dataset.dtype[field]) for field in dataset.dtype.names]
        numeric = [field for field, kind in kinds if kind.kind in NUMERIC and dataset.ndim == 1]
        return [(f"{name}/{field}", field) for field in numeric]
    if dataset.ndim == 1:
        return [(name, None)]
    if int(np.prod(dataset.shape[1:])) > _MOST_COLUMNS:
        return None
    return [
        (f"{name}[:,{','.join(map(str, index))}]", (slice(None), *index))
        for index in product(*(range(size) for size in dataset.shape[1:]))
    ]
