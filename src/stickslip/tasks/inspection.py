"""Contents of a log and its reading, before an identification."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.logs import AxisSchema, LogSchema
from stickslip.logs.columns.assignment import Assignment, assign, one_axis
from stickslip.logs.columns.channels import axis_kind, bind
from stickslip.logs.columns.discovery import Discovery, discover
from stickslip.logs.columns.words import Meaning
from stickslip.logs.opening import open_log
from stickslip.logs.reading import logs_of_axes, schema_at
from stickslip.logs.schema import CHANNELS, toml_text
from stickslip.logs.table import Table, remembered
from stickslip.outputs import whole_file
from stickslip.records import (
    AxisLog,
    AxisProposal,
    ExpectedPrecision,
    InputError,
    Inspection,
    LogColumn,
    StickslipError,
)

_LARGEST_LAG = 0.05  # between effort and motion in the search [s]

_MOST_SAMPLES = 50_000  # for the estimate of the lag, which bounds its time [-]

_PRESUMED = (
    "check: the inertia is taken as constant, and gravity and other joints as absent; the joint of "
    "a robot needs a model of its links"
)

_EVEN = 0.01
"""Jitter up to which samples count as even [-]; others are interpolated first."""


def inspect(
    log: Path | str,
    *,
    schema: Path | str | LogSchema | None = None,
    axis: str | int | None = None,
    columns: AxisSchema | None = None,
    urdf: Path | str | None = None,
    joints: Sequence[str] = (),
    limit: float | None = None,
) -> Inspection:
    """Return the contents of a log, the axes that its columns make, and what is missing.

    Parameters
    ----------
    log
        Path of the log.
    schema
        Known part of its schema.
    axis
        Name of the only axis to return; None returns all.
    columns
        Definitions of single columns, which take precedence over the schema.
    urdf, joints
        Model of the robot whose joints the axes are, and the requested ones, as in
        `stickslip.tasks.axes_of_robot`: lag and prediction then include gravity, the other joints
        and the changes of inertia.
    limit
        Half width of a 95 % interval over its value, up to which a parameter counts as identifiable
        [-]; None predicts no precision.

    Returns
    -------
    Columns, rates and proposed axes.

    Raises
    ------
    InputError
        If the log cannot be read, it has no such axis, or the model does not fit it.
    MissingExtraError
        If a model is given and MuJoCo is not installed.
    """
    whole, where = schema_at(schema)
    if columns is not None:
        whole = whole.overridden(axis if whole.axes else None, columns)
    if urdf is not None:
        from stickslip.tasks.axes import kind_of_joints

        whole = replace(whole, kind=whole.kind or kind_of_joints(urdf, joints))
    table, source, name = open_log(log, whole.files, where)
    table = remembered(table)
    values, discovery = _values(table), discover(table)
    assigned = assign(table, whole)
    logs = logs_of_axes(table, assigned, where, source, name)
    if urdf is not None and any(isinstance(each, AxisLog) for each in logs.values()):
        from stickslip.tasks.axes import axes_of_robot

        logs = axes_of_robot(logs, urdf, joints)
    schemas = {each or name: own for each, own in assigned.items()}
    if axis is not None:
        own = one_axis(assigned, axis, label=table.label)
        logs = {each: log for each, log in logs.items() if schemas[each] is own}
    return Inspection(
        name=name,
        rates=_rates(table, discovery, values, _unit_of_time(assigned)),
        columns=tuple(
            _column(table, column, discovery.by_column.get(column), values[column])
            for column in table.headers
        ),
        axes=tuple(
            _proposal(each, schemas[each], log, limit, table.label) for each, log in logs.items()
        ),
        notes=table.notes,
        limit=limit,
    )


def write_schema(log: Path | str, path: Path | str, schema: LogSchema) -> Path:
    """Write the schema by which `inspect` would read a log.

    Parameters
    ----------
    log
        Path of the log.
    path
        TOML file to write.
    schema
        Known part of its schema.

    Raises
    ------
    InputError
        If the log cannot be read, or nothing can be written there.
    """
    table, _, _ = open_log(log, schema.files, "schema")
    assigned = assign(table, schema)
    axes = {
        axis: _with_kind(table, each) for axis, each in assigned.items() if each.problem is None
    }
    target = Path(path)
    with whole_file(target, what="the schema") as stream:
        stream.write(toml_text(axes, schema.files))
    return target


def _with_kind(table: Table, assigned: Assignment) -> AxisSchema:
    """Return the schema of an axis with its kind, which stated names of columns do not imply."""
    schema = assigned.schema
    try:
        bound = bind(table, schema, assigned.found, "schema")
        kind, _ = axis_kind(bound.values(), schema.kind, table.label)
    except InputError:  # to be stated by the user
        return schema
    return replace(schema, kind=kind)


def _values(table: Table) -> dict[str, Float[np.ndarray, " n"] | None]:
    """Return the values of every column, None for one that holds no numbers."""
    names = list(table.headers)
    try:
        return {name: np.asarray(each, np.float64) for name, each in table.load(names).items()}
    except StickslipError:  # one of them at least; a reader may load each alone
        return {name: _loaded(table, name) for name in names}


def _loaded(table: Table, column: str) -> Float[np.ndarray, " n"] | None:
    """Return the values of a column, or None if it holds no numbers."""
    try:
        return np.asarray(table.load([column])[column], dtype=np.float64)
    except StickslipError:
        return None


def _column(
    table: Table, name: str, found: Meaning | None, values: Float[np.ndarray, " n"] | None
) -> LogColumn:
    group, unit = table.group_of(name), table.units.get(name, "")
    meaning = ""
    if found is not None:
        words = [found.source, "current" if found.current else found.channel.replace("_", " ")]
        meaning = " ".join(word for word in words if word)
        meaning += f" of {found.axis}" if found.axis else ""
    finite = np.empty(0) if values is None else values[np.isfinite(values)]
    ends = (float(finite.min()), float(finite.max())) if finite.size else (None, None)
    repeated = 0.0
    if finite.size and ends[0] != ends[1]:
        times = max(int(np.sum(finite == end)) for end in ends)
        repeated = times / finite.size if times > 1 else 0.0
    return LogColumn(
        name=name,
        origin=table.origins.get(name, ""),
        group=group.name,
        unit=unit,
        samples=0 if values is None else values.size,
        low=ends[0],
        high=ends[1],
        missing=0 if values is None else values.size - finite.size,
        repeated=repeated,
        meaning=meaning if values is not None else "no numbers",
    )


def _unit_of_time(assigned: Mapping[str, Assignment]) -> str | None:
    """Return the unit of time that the schemas of all axes state; None if there is none."""
    units = {each.schema.units.get("time") for each in assigned.values()}
    return units.pop() if len(units) == 1 else None


def _rates(
    table: Table,
    discovery: Discovery,
    values: Mapping[str, Float[np.ndarray, " n"] | None],
    stated: str | None,
) -> dict[str, float]:
    """Return the sampling frequency of each group by its time stamps [Hz], if their unit is known.

    ``stated`` is the unit that the user states.
    """
    from stickslip.logs.columns.clock import unit_of_stamps
    from stickslip.logs.units import scale_to_si

    rates: dict[str, float] = {}
    times = [each.column for each in discovery.candidates("time")]
    for group in table.groups:
        own = [name for name in times if name in group.columns]
        column = group.time or (own[0] if len(own) == 1 else None)
        stamps = None if column is None else values[column]
        rates[group.name] = 0.0
        if column is None or stamps is None or stamps.size < 2:
            continue
        try:
            unit = stated or table.units.get(column)
            factor = (
                unit_of_stamps(stamps, column=column, label=table.label)[0]
                if unit is None
                else scale_to_si("time", unit, "linear")
            )
        except StickslipError:
            continue
        step = float(np.median(np.diff(stamps))) * factor
        rates[group.name] = 1.0 / step if step > 0.0 else 0.0
    return rates


def _proposal(
    name: str, assigned: Assignment, log: AxisLog | InputError, limit: float | None, label: str
) -> AxisProposal:
    """Return an axis with the result of its reading."""
    texts = {
        channel: text
        for channel in CHANNELS
        if (text := getattr(assigned.schema, channel)) is not None
    }
    if isinstance(log, InputError):
        problem = log.below(label)
        return AxisProposal(name=name, columns=texts, kind=assigned.schema.kind, problem=problem)
    from stickslip.estimation.prepare import PreparationTuning
    from stickslip.estimation.signals.arrival_times import ArrivalTuning, with_even_time

    reasons = () if log.source is None else log.source.assumptions
    log, arrival = with_even_time(log, ArrivalTuning())
    reasons = (*reasons, *arrival)
    lag, resolution = effort_lag(log)
    expected, problem = _expected(log, limit)
    if limit is not None and log.model_effort is None:
        reasons = (*reasons, _PRESUMED)
    extremes = np.isin(log.effort, [log.effort.min(), log.effort.max()])
    in_a_row = extremes[1:] & extremes[:-1]
    switched = np.unique(log.effort).size < PreparationTuning.fewest_levels
    return AxisProposal(
        name=name,
        columns=texts,
        kind=log.kind,
        units={"position": log.unit("position"), "effort": log.unit("effort")},
        reasons=reasons,
        problem=problem,
        samples=len(log),
        duration=log.duration,
        sampling_time=log.sampling_time,
        jitter=log.timing_jitter,
        segments=log.segment_starts.size,
        clipped=0.0 if switched else float(np.mean(in_a_row)),
        lag=lag,
        lag_resolution=resolution,
        expected=expected,
    )


def _expected(log: AxisLog, limit: float | None) -> tuple[tuple[ExpectedPrecision, ...], str]:
    """Return the expected precision, or why there is none."""
    if limit is None:
        return (), ""
    from stickslip.estimation.recorded_excitation import expected_precision

    try:
        return expected_precision(log, limit=limit), ""
    except StickslipError as error:
        return (), error.below(log.name)


def effort_lag(log: AxisLog) -> tuple[float | None, float | None]:
    """Return the time by which the effort acts later than logged, and its standard error [s].

    It is the shift at which acceleration, velocity, direction, a constant and the effort of a
    model of the links, if there is one, explain the effort best, by least squares over the faster
    half of the samples, refined by a parabola. None where the best shift is the largest one, or the
    log is too short.
    """
    from scipy.signal import savgol_filter

    longest = max(log.segments(), key=len, default=log)
    step, time = log.sampling_time, longest.time[:_MOST_SAMPLES]
    stated = longest.model_effort if longest.model_effort is not None else np.zeros(len(longest))
    every = [each[: time.size] for each in (longest.measured_position, longest.effort, stated)]
    if longest.timing_jitter > _EVEN:
        even = np.arange(time[0], time[-1], step)
        every = [np.interp(even, time, each) for each in every]
    position, effort, stated = every
    most = min(max(int(_LARGEST_LAG / step), 4), 60, position.size // 10)
    length = 2 * max(4, min(int(0.01 / step), 40)) + 1
    if position.size < 10 * length or most < 2:
        return None, None
    options: dict[str, Any] = {"window_length": length, "polyorder": 3, "delta": step}
    velocity = savgol_filter(position, deriv=1, **options)
    acceleration = savgol_filter(position, deriv=2, **options)
    effort = savgol_filter(effort, window_length=length, polyorder=3)
    inside = np.arange(most + length, position.size - most - length)
    speed = np.abs(velocity[inside])
    inside = inside[speed > np.median(speed)]
    if inside.size < 20:
        return None, None
    columns = [acceleration, velocity, np.sign(velocity), np.ones(velocity.size)]
    if np.any(stated):
        columns.append(savgol_filter(stated, window_length=length, polyorder=3))
    rows = np.column_stack(columns)[inside]
    basis, _ = np.linalg.qr(rows / np.linalg.norm(rows, axis=0))
    shifts = np.arange(-most, most + 1)
    left = np.empty(shifts.size)
    for k, shift in enumerate(shifts):
        target = effort[inside - shift]
        left[k] = float(target @ target - np.sum((basis.T @ target) ** 2))
    best = int(np.argmin(left))
    if best in {0, shifts.size - 1}:
        return None, None
    curvature = float(left[best - 1] - 2.0 * left[best] + left[best + 1])
    if curvature <= 0.0:
        return None, None
    offset = 0.5 * float(left[best - 1] - left[best + 1]) / curvature
    # The held effort of a sample acts half a step after its stamp
    lag = (float(shifts[best]) + offset - 0.5) * step
    least = max(float(left[best]) - 0.5 * curvature * offset**2, 0.0)
    independent = inside.size / length
    error = step * float(np.sqrt(2.0 * least / max(independent, 1.0) / curvature))
    return lag, error
