"""Measurement files of test benches as columns: TDMS of LabVIEW, and ASAM MDF."""

import traceback
from collections.abc import Generator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.errors import RequiredExtra
from stickslip.logs.formats.arrays import NUMERIC
from stickslip.logs.table import Column, RateGroup, Table, name_titles
from stickslip.records import InputError

if TYPE_CHECKING:
    from asammdf import MDF


def read_tdms(path: Path) -> Table:
    """Read the numeric channels of a TDMS file; a waveform has a column of its time."""
    with RequiredExtra("tdms", f"{path.name} is a TDMS file; reading it"):
        from nptdms import TdmsFile
    units: dict[str, str] = {}
    places: dict[str, tuple[str, str] | None] = {}  # group and channel; None: a time column
    rates: dict[tuple[Any, ...], list[str]] = {}
    with path.open("rb") as stream, TdmsFile.open(stream) as file:
        for group in file.groups():
            for channel in group.channels():
                if channel.dtype is None or not len(channel):
                    continue
                kind = np.dtype(channel.dtype).kind
                if kind not in NUMERIC + "M":
                    continue
                name = f"{group.name}/{channel.name}"
                places[name] = (group.name, channel.name)
                unit = channel.properties.get("unit_string") or channel.properties.get(
                    "NI_UnitDescription"
                )
                unit = "s" if kind == "M" else unit
                if isinstance(unit, str) and unit.strip():
                    units[name] = unit.strip()
                step = channel.properties.get("wf_increment")
                offset = channel.properties.get("wf_start_offset", 0.0)
                key = (group.name, len(channel), step or None, offset if step else 0.0)
                rates.setdefault(key, []).append(name)
    if not places:
        raise InputError("no_numbers_over_time", where=path.name)
    groups: list[RateGroup] = []
    stamps: dict[str, tuple[int, float, float]] = {}
    for (group, length, step, offset), names in rates.items():
        time = None
        if step:
            time = f"{group}/time"
            while time in places or time in stamps:
                time += "_"
            stamps[time] = (length, float(step), float(offset))
            units[time] = "s"
        columns = tuple(names) if time is None else (time, *names)
        groups.append(RateGroup(columns=columns, time=time, name=f"{group} ({length} samples)"))

    def load(wanted: Sequence[str]) -> dict[str, Column]:
        loaded: dict[str, Column] = {}
        with path.open("rb") as stream, TdmsFile.open(stream) as file:
            for name in wanted:
                place = places.get(name)
                if place is None:
                    length, step, offset = stamps[name]
                    loaded[name] = offset + np.arange(length) * step
                else:
                    loaded[name] = _floats(file[place[0]][place[1]][:])
        return loaded

    ordered = [name for group in groups for name in group.columns]
    return Table(
        label=path.name,
        headers={name: name for name in ordered},
        units=units,
        load=load,
        place=lambda name, sample: f"{path.name}, {name} at index {sample}",
        groups=tuple(groups)
        if len(groups) > 1
        else (RateGroup(columns=groups[0].columns, time=groups[0].time),),
    )


def _floats(values: np.ndarray) -> Column:
    """Return values as floats, dates as seconds since the first."""
    if values.dtype.kind == "M":
        return (values - values[:1]).astype("timedelta64[ns]").astype(np.int64) / 1e9
    return np.array(values, dtype=np.float64)


@contextmanager
def _opened_mdf(path: Path) -> Generator["MDF"]:
    """Open an MDF file; where asammdf refuses it, close and delete what asammdf leaves.

    A refusal leaves a temporary file open, and of an unfinished log a copy in the temporary folder.
    """
    with RequiredExtra("mdf", f"{path.name} is an MDF file; reading it"):
        from asammdf import MDF
    try:
        file = MDF(path)
    except Exception as error:
        for frame, _ in traceback.walk_tb(error.__traceback__):
            refused: Any = frame.f_locals.get("self")
            if hasattr(refused, "_tempfile"):
                refused._file = None  # closed already, and in part deleted
                with suppress(Exception):
                    refused.close()
        raise
    with file:
        yield file


def read_mdf(path: Path) -> Table:
    """Read the numeric channels of an MDF file, in physical units, with the time of their group."""
    titles: list[str] = []
    places: list[tuple[int, int | None]] = []  # group, and channel or None for its time
    members: list[list[int]] = []
    sources: list[str] = []
    units: list[str] = []
    with _opened_mdf(path) as file:
        for number, group in enumerate(file.groups):
            master = file.masters_db.get(number)
            own: list[int] = []
            for index, channel in enumerate(group.channels):
                if index == master:
                    continue
                first = file.get(
                    group=number, index=index, record_count=1, ignore_invalidation_bits=True
                )
                if first.samples.dtype.kind not in NUMERIC or first.samples.ndim != 1:
                    continue
                own.append(len(titles))
                titles.append(channel.name)
                units.append(first.unit or "")
                places.append((number, index))
            if own:
                members.append(own)
                sources.append(getattr(group.channel_group, "acq_name", "") or f"group {number}")
                if master is not None:
                    own.insert(0, len(titles))
                    titles.append("time")
                    units.append("s")
                    places.append((number, None))
    if not titles:
        raise InputError("no_numbers_in_measurement", where=path.name)
    names = name_titles(titles)
    located = dict(zip(names, places, strict=True))

    def load(wanted: Sequence[str]) -> dict[str, Column]:
        loaded: dict[str, Column] = {}
        with _opened_mdf(path) as file:
            for name in wanted:
                group, index = located[name]
                if index is None:
                    loaded[name] = np.array(file.get_master(group), dtype=np.float64)
                else:
                    signal = file.get(group=group, index=index, ignore_invalidation_bits=True)
                    loaded[name] = np.array(signal.samples, dtype=np.float64)
        return loaded

    ordered = [names[k] for own in members for k in own]
    return Table(
        label=path.name,
        headers={name: titles[names.index(name)] for name in ordered},
        units={name: unit for name, unit in zip(names, units, strict=True) if unit},
        load=load,
        place=lambda name, sample: f"{path.name}, {name} at index {sample}",
        groups=tuple(
            RateGroup(
                columns=tuple(names[k] for k in own),
                time=names[own[0]] if located[names[own[0]]][1] is None else None,
                name=source if len(members) > 1 else "",
            )
            for own, source in zip(members, sources, strict=True)
        ),
        origins={
            names[k]: source for own, source in zip(members, sources, strict=True) for k in own
        },
    )
