"""Data sets of LeRobot, folders of Parquet files, as columns."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.errors import RequiredExtra
from stickslip.logs.table import Column, RateGroup, Table
from stickslip.records import InputError

INFO = "meta/info.json"

_TIME = "timestamp"
_EPISODE = "episode_index"
_INDICES = frozenset({"frame_index", "index", "task_index", _EPISODE})
_NUMERIC = ("float", "int", "bool", "double")
_PAUSE = 1.0
"""Time [s] between the episodes, which all begin at zero: a gap, at any rate of a robot."""


def read_lerobot(path: Path) -> Table:
    """Read the signals of a LeRobot data set of version 2 or 3; pictures are left out.

    A vector has a column for each of its names in ``meta/info.json``, as in
    ``observation.state/elbow_flex.pos``. Episodes are put one after another.
    """
    with RequiredExtra("parquet", f"{path.name} is a LeRobot data set; reading it"):
        import pyarrow.parquet as pq

    features = _features(path)
    files = sorted(path.glob("data/**/*.parquet"))
    if not files or not features:
        raise InputError("no_lerobot_data", where=path.name)
    present = set(pq.read_schema(files[0]).names)
    columns = {
        name: place
        for feature, description in features.items()
        if feature in present
        for name, place in _columns(feature, description)
    }
    if _TIME not in present or not columns:
        raise InputError("no_lerobot_data", where=path.name)

    def load(names: Sequence[str]) -> dict[str, Column]:
        wanted = {columns[name][0] for name in names}
        read = sorted(wanted | ({_EPISODE} & present if _TIME in wanted else set()))
        tables = [pq.read_table(file, columns=read) for file in files]
        loaded: dict[str, Column] = {}
        for name in names:
            feature, index = columns[name]
            parts = [_values(table.column(feature), index, name, path.name) for table in tables]
            loaded[name] = np.concatenate(parts)
        if _TIME in loaded and _EPISODE in present:
            episodes = np.concatenate([table.column(_EPISODE).to_numpy() for table in tables])
            loaded[_TIME] = _one_after_another(loaded[_TIME], episodes)
        return loaded

    return Table(
        label=path.name,
        headers={name: name for name in columns},
        units={_TIME: "s"},
        load=load,
        place=lambda name, sample: f"{path.name}, {name} at row {sample}",
        notes=(f"the episodes are put one after another, {_PAUSE:g} s apart",),
        groups=(RateGroup(columns=tuple(columns), time=_TIME),),
    )


def _features(path: Path) -> Mapping[str, Any]:
    document = json.loads((path / INFO).read_bytes())
    features = document.get("features") if isinstance(document, dict) else None
    return features if isinstance(features, dict) else {}


def _columns(feature: str, description: Any) -> list[tuple[str, tuple[str, int | None]]]:
    """Return the columns of one feature, each with its index in the vector."""
    if not isinstance(description, dict) or feature in _INDICES:
        return []
    shape, kind = description.get("shape"), str(description.get("dtype"))
    if not kind.startswith(_NUMERIC) or not isinstance(shape, list) or len(shape) > 1:
        return []
    size = shape[0] if shape else 1
    if not isinstance(size, int) or not 0 < size <= 1000:
        return []
    if size == 1:
        return [(feature, (feature, None))]
    names = description.get("names")
    if isinstance(names, dict):  # {"motors": [...]}
        names = next((each for each in names.values() if isinstance(each, list)), None)
    if isinstance(names, list) and len(names) == 1 and isinstance(names[0], list):  # [[...]]
        names = names[0]
    if not isinstance(names, list) or len(names) != size:
        return [(f"{feature}[{k}]", (feature, k)) for k in range(size)]
    return [(f"{feature}/{name}", (feature, k)) for k, name in enumerate(names)]


def _values(column: Any, index: int | None, name: str, label: str) -> Column:
    """Return a column of a Parquet file, or one item of its vectors."""
    whole = column.combine_chunks()
    if hasattr(whole, "flatten") and "list" in str(column.type):
        flat = whole.flatten().to_numpy(zero_copy_only=False)
        width = flat.size // max(len(whole), 1)
        position = 0 if index is None else index
        if len(whole) and (flat.size != width * len(whole) or not 0 <= position < width):
            raise InputError("uneven_vectors", where=label, name=name)
        return flat.reshape(-1, max(width, 1))[:, position].astype(np.float64)
    return np.array(whole.to_numpy(zero_copy_only=False), dtype=np.float64)


def _one_after_another(time: Column, episodes: np.ndarray) -> Column:
    """Return time that goes on from episode to episode."""
    starts = np.flatnonzero(np.diff(episodes, prepend=episodes[:1] - 1))
    lengths = np.diff(starts, append=time.size)
    first, last = time[starts], time[starts + lengths - 1]
    begins = np.concatenate(([0.0], np.cumsum(last - first + _PAUSE)[:-1]))
    return time + np.repeat(begins - first, lengths)
