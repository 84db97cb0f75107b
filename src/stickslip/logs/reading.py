"""From a file or a data frame to an `AxisLog` in SI units, checked for plausibility."""

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.logs.channels import Bound, axis_kind, bind, candidates
from stickslip.logs.expressions import Expression, Value
from stickslip.logs.formats.frames import table_of_frame
from stickslip.logs.opening import open_log
from stickslip.logs.schema import AxisSchema, LogSchema, read_schema
from stickslip.logs.table import Column, Table, check_lengths
from stickslip.logs.units import quantity_of, scale_to_si
from stickslip.records import AxisKind, AxisLog, InputError, LogSource, unit_of

_NOTICEABLE_JITTER = 1e-6
"""Time steps that deviate by less than this fraction are rounded numbers, not worth a sentence."""

_SMALLEST, _LARGEST = 1e-20, 1e20
"""Sizes [SI] between which products of several channels neither vanish nor overflow."""

_HUGE = 1e300
"""A value that even a tiny factor does not make zero."""


def read_log(
    path: str | Path, schema: str | Path | LogSchema | None = None, axis: str | int | None = None
) -> AxisLog:
    """Read one axis from a log file, or from a folder of files.

    Text (CSV and its relatives), Parquet, MATLAB (version 5 to 7.3) and NPZ files are recognised by
    their endings.

    Parameters
    ----------
    path
        The file; or a folder, with a schema that names its files.
    schema
        A `LogSchema`, or the path of a TOML file with one. Without it obvious columns are found.
    axis
        Which axis, if the schema has several.

    Returns
    -------
    The log in SI units. Its ``source.assumptions`` states everything that was inferred.

    Raises
    ------
    InputError
        If the log cannot be read or makes no sense; file, row and column are named.
    MissingExtraError
        If the format needs a library that is not installed.

    Examples
    --------
    >>> import os
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "stage.csv")
    ...     rows = ["time [s],pos [mm],force [N]", "0.0,0.0,1", "0.5,0.1,1", "1.0,0.4,1"]
    ...     _ = file.write_text(os.linesep.join(rows))
    ...     log = read_log(file)
    >>> log.kind, log.sampling_time, log.measured_position[-1].item()
    ('linear', 0.5, 0.0004)
    >>> log.source.assumptions[-1]
    'the axis is taken as linear because position is in mm'
    """
    try:
        Path(path)
    except TypeError:
        raise InputError(
            f"an object of type {type(path).__name__} is not the path of a log",
            remedy="give a path, or turn a data frame into a log with stickslip.log_from_frame",
        ) from None
    whole, chosen, where = _chosen(schema, axis)
    table, source, name = open_log(path, whole.files, where)
    return _axis_log(table, chosen, where, source, default_name=name)


def log_from_frame(
    frame: Any, schema: str | Path | LogSchema | None = None, axis: str | int | None = None
) -> AxisLog:
    """Take one axis from a data frame: pandas, polars, pyarrow or any other that narwhals knows.

    Parameters
    ----------
    frame
        The data frame.
    schema, axis
        As for `read_log`.

    Returns
    -------
    The log in SI units.

    Raises
    ------
    InputError
        If the frame cannot be used; row and column are named.

    Examples
    --------
    >>> import pandas as pd
    >>> frame = pd.DataFrame({"t": [0.0, 0.1, 0.2], "q": [0.0, 0.1, 0.3], "tau": [1.0, 1.0, 0.0]})
    >>> log = log_from_frame(frame, LogSchema(kind="rotary"))
    >>> log.unit("effort"), log.effort.tolist()
    ('N m', [1.0, 1.0, 0.0])
    """
    whole, chosen, where = _chosen(schema, axis)
    if whole.files:
        raise InputError(
            "the schema names files, and a data frame has none",
            where=where,
            remedy="leave [files] out",
        )
    label = "data frame"
    table = table_of_frame(frame, label)
    return _axis_log(table, chosen, where, None, default_name=label)


def _chosen(
    schema: str | Path | LogSchema | None, axis: str | int | None
) -> tuple[LogSchema, AxisSchema, str]:
    """Return the schema, that of the axis, and the schema's name in messages; empty for none."""
    if schema is None:
        whole, where = LogSchema(), ""
    elif isinstance(schema, LogSchema):
        whole, where = schema, "schema"
    else:
        whole, where = read_schema(schema), Path(schema).name
    try:
        return whole, whole.for_axis(axis), where
    except InputError as error:
        raise error.at(where) if where else error from None


def _axis_log(
    table: Table, schema: AxisSchema, where: str, source: LogSource | None, default_name: str
) -> AxisLog:
    bound = bind(table, schema, where or "schema")
    try:
        kind, note = axis_kind(bound.values(), schema.kind, table.label)
        channels, notes = _channels(table, bound, kind)
        assumed = tuple(
            (name, unit_of(quantity_of(name), kind)) for name in bound if bound[name].unit is None
        )
    except InputError as error:
        raise error if error.where else error.at(table.label) from None
    time = channels.pop("time", None)
    if time is None:  # the stated sampling
        time = np.arange(channels["position"].size, dtype=np.float64)
        frequency = schema.sampling_frequency
        time = time * (schema.sampling_time or 0.0) if frequency is None else time / frequency
    effort = channels["effort"]
    measured: dict[str, Any] = {
        f"measured_{name}": each for name, each in channels.items() if name != "effort"
    }
    try:
        log = AxisLog(
            name=schema.name or default_name, kind=kind, time=time, effort=effort, **measured
        )
    except InputError as error:
        backward = np.flatnonzero(np.diff(time) <= 0)
        place = table.label
        if "time" in bound and backward.size:
            place = table.place(bound["time"].expression.names[0], int(backward[0]) + 1)
        raise error.at(place) from None
    _check_motion(log, bound, table.label)
    source = source or _source_in_memory(table, time, channels)
    assumptions = (*table.notes, *notes, *([note] if note else []), *_timing(log, table, bound))
    return replace(log, source=replace(source, assumptions=assumptions, assumed_units=assumed))


def _channels(
    table: Table, bound: Mapping[str, Bound], kind: AxisKind
) -> tuple[dict[str, Column], list[str]]:
    """Return each channel in SI units, and the assumptions about it."""
    names = [name for each in bound.values() for name in each.expression.names]
    columns = table.load([name for name in dict.fromkeys(names) if name in table.headers])
    check_lengths(columns, table.label)
    for name, column in columns.items():
        _check_finite(table, name, column)
    values: dict[str, Value] = {**table.constants, **columns}
    channels: dict[str, Column] = {}
    notes: list[str] = []
    for channel, each in bound.items():
        with np.errstate(all="ignore"):  # what overflows is found by its result
            result = np.asarray(each.expression.evaluate(values), dtype=np.float64)
        factor, note = 1.0, each.note
        if each.unit is not None:
            factor = scale_to_si(channel, each.unit, kind)
        else:
            si = unit_of(quantity_of(channel), kind)
            taken = f"no unit is given, so it is taken in {si}"
            note = f"{note}; {taken}" if note else f"{channel.replace('_', ' ')}: {taken}"
        if note:
            notes.append(note)
        channels[channel] = _scaled(channel, each, result, factor, kind)
    return channels, notes


def _scaled(channel: str, bound: Bound, values: Column, factor: float, kind: AxisKind) -> Column:
    """Return a channel in SI units, if they are of a size that can be computed with."""
    with np.errstate(all="ignore"):
        result = values if factor == 1.0 else values * factor
        largest = float(np.max(np.abs(result), initial=0.0))
    vanished = largest == 0.0 and values.any()
    if not vanished and (largest == 0.0 or _SMALLEST <= largest <= _LARGEST):
        return result
    unit = unit_of(quantity_of(channel), kind)
    size = (
        "too large for a number"
        if not np.isfinite(largest)
        else f"{'at most' if largest < 1 else 'as large as'} {largest:.3g} {unit}"
    )
    raise InputError(
        f"the {channel.replace('_', ' ')} ({bound.expression.text}) is {size}, outside "
        f"{_SMALLEST:g} to {_LARGEST:g} {unit}",
        remedy="correct its unit or the factor in front of the column",
    )


def _check_finite(table: Table, name: str, column: Column) -> None:
    bad = np.flatnonzero(~np.isfinite(column))
    if bad.size:
        raise InputError(
            f"column {name!r} is {column[bad[0]]} ({bad.size} of {column.size} samples are not "
            "finite)",
            where=table.place(name, int(bad[0])),
            remedy="remove or repair those samples; nothing is interpolated silently",
        )


def _check_motion(log: AxisLog, bound: Mapping[str, Bound], label: str) -> None:
    """Refuse a recording in which nothing happens: most often the wrong column."""
    position = log.measured_position
    if (position == position[0]).all():
        raise InputError(
            f"the position ({bound['position'].expression.text}) is {position[0]:g} "
            f"{log.unit('position')} in all {len(log)} samples",
            where=label,
            remedy="name the column that moves, or record the axis in motion",
        )
    if not log.effort.any() and not _means_zero(bound["effort"].expression):
        raise InputError(
            f"the effort ({bound['effort'].expression.text}) is zero in all {len(log)} samples",
            where=label,
            remedy="name the column of the force or torque, or record it; that none acts, as in a "
            'free decay, is said by effort = "0 * position"',
        )


def _means_zero(expression: Expression) -> bool:
    """Return whether an expression is zero whatever its columns hold: then nothing acts indeed."""
    return not expression.evaluate(
        {name: _HUGE * (1 + index) for index, name in enumerate(expression.names, start=1)}
    )


def _source_in_memory(table: Table, time: Column, channels: Mapping[str, Column]) -> LogSource:
    digest = hashlib.sha256(np.ascontiguousarray(time).tobytes())
    for column in channels.values():
        digest.update(np.ascontiguousarray(column).tobytes())
    return LogSource(files=(table.label,), sha256=digest.hexdigest())


def _timing(log: AxisLog, table: Table, bound: Mapping[str, Bound]) -> list[str]:
    """Return sentences on the time stamps: that they are not used, jitter and gaps."""
    if "time" not in bound:
        unused = candidates(table, "time")
        listed = " and ".join(map(repr, unused))
        if not unused:
            return []
        return [f"time is the stated sampling of {log.sampling_time:.6g} s, not column {listed}"]
    notes: list[str] = []
    if log.timing_jitter > _NOTICEABLE_JITTER:
        notes.append(
            f"steps of the time stamps deviate by up to {100 * log.timing_jitter:.2g} % from the "
            f"sampling time of {log.sampling_time:.6g} s"
        )
    starts = log.segment_starts
    if starts.size > 1:
        first = int(starts[1])
        gap = log.time[first] - log.time[first - 1]
        count = "1 gap splits" if starts.size == 2 else f"{starts.size - 1} gaps split"
        notes.append(
            f"{count} the log into {starts.size} segments; the first is {gap:.6g} s long, before "
            f"{table.place(bound['time'].expression.names[0], first)}"
        )
    return notes
