"""Logs that are given as such or by their paths, read and checked."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np

from stickslip.logs import AxisSchema, LogSchema, read_log
from stickslip.logs.reading import schema_at
from stickslip.records import AxisLog, InputError


def log_at(
    path: Path | str,
    schema: Path | str | LogSchema | None,
    axis: str | int | None,
    columns: AxisSchema | None,
) -> AxisLog:
    """Read a log as `stickslip.logs.read_log`; ``columns`` take precedence over the schema."""
    if columns is None or columns == AxisSchema():
        return read_log(path, schema, axis)
    stated, _ = schema_at(schema)
    return read_log(path, stated.overridden(axis, columns), None if stated.axes else axis)


def logs_at(
    given: Sequence[AxisLog | Path | str],
    schema: Path | str | LogSchema | None,
    axis: str | int | None,
    columns: AxisSchema | None,
) -> list[AxisLog]:
    """Return several logs of one rigid axis, each with a name of its own.

    A log that is read gets the name of its file without the ending; of files with the same name,
    with the name of the folder before it. The same log twice, the same name twice, different kinds
    of axis and a flexible arm are errors.
    """
    logs = [
        each if isinstance(each, AxisLog) else log_at(each, schema, axis, columns) for each in given
    ]
    paths = [None if isinstance(each, AxisLog) else Path(each) for each in given]
    logs = [
        replace(log, name=name) if path else log
        for log, path, name in zip(logs, paths, _names(paths), strict=True)
    ]
    called = [str(path) if path else log.name for path, log in zip(paths, logs, strict=True)]
    for (one, own), (other, its) in combinations(zip(logs, called, strict=True), 2):
        if _same(one, other):
            raise InputError("log_given_twice", where=its, other="" if own == its else own)
        if one.name == other.name:
            raise InputError("logs_of_one_name", where=its, name=one.name)
        if one.kind != other.kind:
            raise InputError(
                "logs_of_two_kinds", where=its, other=own, other_kind=one.kind, kind=other.kind
            )
    for log, name in zip(logs, called, strict=True):
        if log.measured_load_position is not None:
            raise InputError("joint_log_of_arm", where=name)
    return logs


def _names(paths: Sequence[Path | None]) -> list[str]:
    """Return the shortest distinct names of files: that of the file, or with its folder."""
    stems = ["" if path is None else path.stem for path in paths]
    return [
        f"{path.absolute().parent.name}/{stem}"
        if path is not None and stems.count(stem) > 1
        else stem
        for path, stem in zip(paths, stems, strict=True)
    ]


def _same(one: AxisLog, other: AxisLog) -> bool:
    """Return whether two logs hold the same samples."""
    pairs = (
        (one.time - one.time[0], other.time - other.time[0]),
        (one.effort, other.effort),
        (one.measured_position, other.measured_position),
    )
    return len(one) == len(other) and all(np.array_equal(a, b) for a, b in pairs)
