"""From assigned columns to an `AxisLog` in SI units, checked for plausibility."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from jaxtyping import Bool

from stickslip.logs.columns.assignment import Assignment
from stickslip.logs.columns.channels import Bound, axis_kind, bind
from stickslip.logs.columns.clock import continued, unit_of_stamps, unrounded
from stickslip.logs.columns.discovery import discover
from stickslip.logs.columns.rates import Sampled, together
from stickslip.logs.expressions import Expression, Value
from stickslip.logs.schema import AxisSchema, Side
from stickslip.logs.table import Column, RateGroup, Table, check_lengths, is_slower
from stickslip.logs.units import effort_unit, quantity_of, scale_to_si
from stickslip.records import (
    AxisKind,
    AxisLog,
    EffortUnit,
    InputError,
    LogSource,
    share_text,
    unit_of,
)

_NOTICEABLE_JITTER = 1e-6
"""Time steps that deviate by less than this fraction are rounded numbers, not worth a sentence."""

_SMALLEST, _LARGEST = 1e-20, 1e20
"""Sizes [SI] between which products of several channels neither vanish nor overflow."""

_HUGE = 1e300  # a value that even a tiny factor does not make zero

_BITS = (16, 32)  # sizes of signed numbers that may be written as unsigned ones

_NEAR_END = 1.5
"""Step between two samples, in halves of their range [-], that is one from end to end."""

_FEWEST_JUMPS = 3  # of such steps: fewer may be faults

_OTHER_SAMPLING = 0.01
"""Relative difference of a stated sampling time from the mean step of a column of time stamps [-]
from which it is noted: lost samples cause less."""

_DISTANT = 1e5
"""Stamps that begin later than this count from the first [s]: they are those of a calendar."""


def axis_log(
    table: Table,
    assigned: Assignment,
    where: str,
    source: LogSource | None,
    *,
    default_name: str,
) -> AxisLog:
    """Return the log of an axis from its columns."""
    schema = assigned.schema
    bound = bind(table, schema, assigned.found, where or "schema")
    try:
        kind, note = axis_kind(bound.values(), schema.kind, table.label)
        sampled, notes, in_seconds = _sampled(table, bound, schema, kind)
        assumed = tuple(
            (name, unit_of(quantity_of(name), kind))
            for name in bound
            if bound[name].unit is None and (name != "time" or in_seconds)
        )
        channels = dict(sampled.channels)
        channels["effort"], unit, side, converted = _acting(
            channels["effort"], bound["effort"], schema, kind, table.label
        )
    except InputError as error:
        raise error if error.where else error.at(table.label) from None
    if unit or schema.torque_constant is not None:
        assumed = tuple(each for each in assumed if each[0] != "effort")
    time, effort = sampled.time, channels.pop("effort")
    empty = _empty_velocities(channels)
    measured: dict[str, Any] = {
        f"measured_{name}": each for name, each in channels.items() if name not in empty
    }
    part, note_of_part = _part(time, schema, table.label)
    if part != slice(None):
        time, effort = time[part], effort[part]
        measured = {name: each[part] for name, each in measured.items()}
    try:
        log = AxisLog(
            name=schema.name or default_name,
            kind=kind,
            time=time,
            effort=effort,
            effort_unit=unit,
            **measured,
        )
    except InputError as error:
        backward = np.flatnonzero(np.diff(time) <= 0)
        place = table.label
        if "time" in bound and backward.size:
            place = table.place(
                bound["time"].expression.names[0], int(backward[0]) + 1 + (part.start or 0)
            )
        raise error.at(place) from None
    _check_motion(log, bound, table.label)
    unconverted = _unconverted(unit)
    source = source or _source_in_memory(table, time, {**channels, "effort": effort})
    assumptions = (
        *table.notes,
        *assigned.notes,
        *notes,
        *([unconverted] if unconverted else []),
        *converted,
        *note_of_part,
        *(f"{name}: 0 in all samples, so it is not used" for name in empty),
        *([note] if note else []),
        *_timing(log, table, bound),
    )
    return log.with_source(
        replace(
            source,
            assumptions=assumptions,
            assumed_units=assumed,
            side=side,
            unconverted=unconverted,
        )
    )


def _empty_velocities(channels: Mapping[str, Column]) -> list[str]:
    """Return the velocities that are 0 in all samples of a motion: the drive measures none."""
    return [
        name
        for name, values in channels.items()
        if name.endswith("velocity") and not np.any(values) and np.ptp(channels["position"]) > 0.0
    ]


def _unconverted(unit: EffortUnit) -> str:
    """Return a sentence on an effort that is left in the unit of the drive."""
    if not unit:
        return ""
    reason = "no torque constant is given" if unit == "A" else "its rated value is not known"
    return f"effort: {reason}, so all results are in units of {unit}"


def _part(time: Column, schema: AxisSchema, label: str) -> tuple[slice, list[str]]:
    """Return the samples between the stated times, and a sentence if these are not all."""
    start, end = schema.start_time, schema.end_time
    if start is None and end is None:
        return slice(None), []
    elapsed = time - time[0]
    first = 0 if start is None else int(np.searchsorted(elapsed, start, side="left"))
    last = time.size if end is None else int(np.searchsorted(elapsed, end, side="right"))
    if last - first < 2:
        duration = float(elapsed[-1]) if elapsed.size else 0.0
        raise InputError(
            "range_empty",
            where=label,
            start=0.0 if start is None else start,
            end=duration if end is None else end,
            duration=duration,
        )
    return slice(first, last), [
        f"of {elapsed[-1]:.6g} s, {elapsed[first]:.6g} s to {elapsed[last - 1]:.6g} s are read"
    ]


def _acting(
    effort: Column, bound: Bound, schema: AxisSchema, kind: AxisKind, label: str
) -> tuple[Column, EffortUnit, Side | Literal[""], list[str]]:
    """Return the effort with torque constant and gear, its unit, its side, and sentences."""
    unit: EffortUnit = "" if bound.unit is None else effort_unit(bound.unit)
    notes: list[str] = []
    constant, ratio, side = schema.torque_constant, schema.gear_ratio, schema.effort_side
    if constant is not None:
        if unit != "A" and bound.unit is not None:
            raise InputError(
                "torque_constant_without_current",
                where=label,
                effort=bound.expression.text,
                unit=bound.unit,
            )
        effort, unit = constant * effort, ""
        per = "N/A" if kind == "linear" else "N m/A"
        notes.append(f"effort: the current times the torque constant of {constant:g} {per}")
        side = side or ("motor" if ratio is not None else None)
    if ratio is not None and side is None:
        raise InputError("gear_without_side", where=label)
    if side == "motor":
        if ratio is None:
            raise InputError("side_without_gear", where=label)
        notes.append(
            f"effort: that of the motor times the gear ratio of {ratio:g}; results are those of "
            "the joint"
        )
        return ratio * effort, unit, "joint", notes
    return effort, unit, side or "", notes


def _sampled(
    table: Table, bound: Mapping[str, Bound], schema: AxisSchema, kind: AxisKind
) -> tuple[Sampled, list[str], bool]:
    """Return the channels in SI units at common time stamps, and the assumptions about them.

    The last is whether the unit of time is known from nothing.
    """
    groups = {channel: _group_of(table, each) for channel, each in bound.items()}
    values, notes = _channels(table, bound, kind)
    channels = {name: each for name, each in values.items() if name != "time"}
    if "time" not in bound:
        _check_same_length(table, bound)
        count = np.arange(channels["position"].size, dtype=np.float64)
        frequency = schema.sampling_frequency
        time = count * (schema.sampling_time or 0.0) if frequency is None else count / frequency
        return Sampled(time=time, channels=channels), notes, False
    first = bound["time"]
    column = first.expression.names[0] if first.expression.is_column else None
    values["time"], wraps = continued(values["time"])
    values["time"], even = unrounded(
        values["time"], column=first.expression.text, label=table.label
    )
    clock = _Clock.of(table, values["time"], first.unit, column)
    note = f"{first.note}; {clock.reason}" if first.note else f"time: {clock.reason}"
    notes = [note if clock.reason else first.note, *notes] if clock.reason or first.note else notes
    notes += [*wraps, *even]
    if clock.origin:
        notes.append(f"time counts from {clock.origin:.12g} s of the stamps")
    in_seconds = first.unit is None and clock.factor == 1.0
    stamps = _scaled("time", first, clock.seconds(values["time"]), 1.0, kind)
    if all(groups[channel] == groups["time"] for channel in channels):
        _check_same_length(table, bound)
        rows = {name: np.isfinite(values) for name, values in channels.items()}
        if all(each.all() for each in rows.values()):
            return Sampled(time=stamps, channels=channels), notes, in_seconds
        parts = _by_rows(stamps, channels, rows)
        sampled, resampled = together(parts, label=table.label)
        return sampled, [*notes, *resampled], in_seconds
    parts: dict[str, Sampled] = {}
    for group in dict.fromkeys(groups[channel] for channel in channels):
        time = stamps
        if group != groups["time"]:
            time, note = _time_of(table, group, bound, clock)
            notes.append(note)
        members = {name: channels[name] for name in channels if groups[name] == group}
        # The columns of a group that is cut off in a damaged file may differ in length
        check_lengths({"time": time, **members}, group.name or table.label)
        parts[group.name or table.label] = Sampled(time=time, channels=members)
    sampled, resampled = together(parts, label=table.label)
    return sampled, [*notes, *resampled], in_seconds


def _by_rows(
    stamps: Column, channels: Mapping[str, Column], rows: Mapping[str, Bool[np.ndarray, " n"]]
) -> dict[str, Sampled]:
    """Return channels that were sampled in the same rows together: their other cells are empty."""
    alike: dict[bytes, list[str]] = {}
    for name, own in rows.items():
        alike.setdefault(own.tobytes(), []).append(name)
    return {
        f"the rows with {' and '.join(names).replace('_', ' ')}": Sampled(
            time=stamps[rows[names[0]]],
            channels={name: channels[name][rows[name]] for name in names},
        )
        for names in alike.values()
    }


@dataclass(frozen=True, kw_only=True)
class _Clock:
    """Unit of time stamps, and where they are counted from."""

    factor: float  # s
    origin: float  # s; other than 0 for stamps of a calendar
    reason: str  # what was inferred of the unit; empty if it was stated

    @staticmethod
    def of(table: Table, stamps: Column, unit: str | None, column: str | None) -> "_Clock":
        """Return the clock of a column, or of an expression for None."""
        if unit is not None:
            factor, reason = scale_to_si("time", unit, "linear"), ""
        elif column is not None:
            factor, reason = unit_of_stamps(stamps, column=column, label=table.label)
        else:
            factor, reason = 1.0, "no unit is given, so it is taken in s"
        first = float(stamps[0]) * factor if stamps.size else 0.0
        origin = float(np.floor(first)) if np.isfinite(first) and abs(first) > _DISTANT else 0.0
        return _Clock(factor=factor, origin=origin, reason=reason)

    def seconds(self, stamps: Column) -> Column:
        """Return stamps in s; those of a calendar are shifted first, or digits would be lost."""
        if self.origin:
            stamps = stamps - self.origin / self.factor
        return stamps * self.factor if self.factor != 1.0 else stamps


def _group_of(table: Table, bound: Bound) -> RateGroup:
    """Return the rate group of a channel, whose columns are all of one."""
    names = [name for name in bound.expression.names if name in table.headers]
    groups = {name: table.group_of(name) for name in names}
    if any(group != groups[names[0]] for group in groups.values()):
        check_lengths(table.load(names), table.label)
    return groups[names[0]]


def _check_same_length(table: Table, bound: Mapping[str, Bound]) -> None:
    names = [n for each in bound.values() for n in each.expression.names if n in table.headers]
    check_lengths(table.load(list(dict.fromkeys(names))), table.label)


def _time_of(
    table: Table, group: RateGroup, bound: Mapping[str, Bound], first: _Clock
) -> tuple[Column, str]:
    """Return the time stamps [s] of a group that has none stated, and a sentence on them."""
    column = group.time
    if column is None:
        found = discover(table).candidates("time")
        own = [each.column for each in found if table.group_of(each.column) == group]
        if len(own) != 1:
            _check_same_length(table, bound)  # names both lengths
            raise InputError("group_without_time", where=table.label, group=group.name)
        column = own[0]
    stamps = table.load([column])[column]
    _check_finite(table, column, stamps)
    stamps, _ = unrounded(continued(stamps)[0], column=column, label=table.label)
    unit = table.units.get(column) or bound["time"].unit
    clock = replace(_Clock.of(table, stamps, unit, column), origin=first.origin)
    name = group.name or table.label
    reason = clock.reason or f"its unit is {unit}"
    return clock.seconds(stamps), f"time of {name} is read from column {column!r}; {reason}"


def _channels(
    table: Table, bound: Mapping[str, Bound], kind: AxisKind
) -> tuple[dict[str, Column], list[str]]:
    """Return each channel in SI units, but for the time, and the assumptions about it."""
    names = [name for each in bound.values() for name in each.expression.names]
    columns = dict(table.load([name for name in dict.fromkeys(names) if name in table.headers]))
    stamps = bound["time"].expression.names if "time" in bound else ()
    slower = {name for name, column in columns.items() if name not in stamps and is_slower(column)}
    for name, column in columns.items():
        full = np.where(np.isnan(column), 0.0, column) if name in slower else column
        _check_finite(table, name, full)
    notes: list[str] = []
    for name in bound["effort"].expression.names:
        if name in columns:
            columns[name], found = _signed(name, columns[name])
            notes += found
    values: dict[str, Value] = {**table.constants, **columns}
    channels: dict[str, Column] = {}
    for channel, each in bound.items():
        with np.errstate(all="ignore"):  # what overflows is found by its result
            result = np.asarray(each.expression.evaluate(values), dtype=np.float64)
        if channel == "time":  # in the unit of the file
            channels[channel] = result
            continue
        factor, note = 1.0, each.note
        if each.unit is not None:
            factor = scale_to_si(channel, each.unit, kind)
        else:
            si = unit_of(quantity_of(channel), kind)
            taken = f"no unit is given, so it is taken in {si}"
            note = f"{note}; {taken}" if note else f"{channel.replace('_', ' ')}: {taken}"
        if note:
            notes.append(note)
        empty = [np.isnan(columns[name]) for name in each.expression.names if name in slower]
        if not empty:
            channels[channel] = _scaled(channel, each, result, factor, kind)
            continue
        rows = ~np.any(empty, axis=0)
        channels[channel] = np.full(result.shape, np.nan)
        channels[channel][rows] = _scaled(channel, each, result[rows], factor, kind)
    return channels, notes


def _signed(name: str, column: Column) -> tuple[Column, list[str]]:
    """Return signed numbers that were read as unsigned ones as they are, and a note on it.

    Between two samples no effort goes from the one end of an unsigned range to the other.
    """
    whole = column[~np.isnan(column)]
    if not whole.size or whole.min() < 0.0 or np.any(whole != np.floor(whole)):
        return column, []
    for bits in _BITS:
        half = 2.0 ** (bits - 1)
        jumps = np.abs(np.diff(whole)) > _NEAR_END * half
        if whole.max() < 2.0 * half and np.sum(jumps) >= _FEWEST_JUMPS:
            signed = np.where(column >= half, column - 2.0 * half, column)
            return signed, [
                f"effort: column {name!r} has signed numbers of {bits} bits that were written as "
                "unsigned ones; their sign is restored"
            ]
    return column, []


def _scaled(channel: str, bound: Bound, values: Column, factor: float, kind: AxisKind) -> Column:
    """Return a channel in SI units, if they are of a size that can be computed with."""
    with np.errstate(all="ignore"):
        result = values if factor == 1.0 else values * factor
        largest = float(np.max(np.abs(result), initial=0.0))
    vanished = largest == 0.0 and values.any()
    if not vanished and (largest == 0.0 or _SMALLEST <= largest <= _LARGEST):
        return result
    unit = unit_of(quantity_of(channel), kind)
    raise InputError(
        "values_implausible",
        name=channel,
        text=bound.expression.text,
        size=largest,
        least=_SMALLEST,
        most=_LARGEST,
        unit=unit,
    )


def _check_finite(table: Table, name: str, column: Column) -> None:
    bad = np.flatnonzero(~np.isfinite(column))
    if bad.size:
        raise InputError(
            "column_not_finite",
            where=table.place(name, int(bad[0])),
            name=name,
            value=column[bad[0]],
            count=bad.size,
            samples=column.size,
        )


def _stated(channel: str, bound: Mapping[str, Bound]) -> str:
    """Return a channel in words, with what it was read from unless that has its name."""
    text = bound[channel].expression.text
    return f"the {channel}" if text == channel else f"the {channel} ({text})"


def _check_motion(log: AxisLog, bound: Mapping[str, Bound], label: str) -> None:
    """Refuse a recording in which nothing happens: most often the wrong column."""
    position = log.measured_position
    if (position == position[0]).all():
        raise InputError(
            "position_column_constant",
            where=label,
            channel=_stated("position", bound),
            value=position[0],
            unit=log.unit("position"),
            samples=len(log),
        )
    if not log.effort.any() and not _means_zero(bound["effort"].expression):
        raise InputError(
            "effort_column_zero",
            where=label,
            channel=_stated("effort", bound),
            samples=len(log),
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


def _mean_step(table: Table, column: str) -> float | None:
    """Return the mean step of a column of time stamps [s]; None if it is no clock."""
    unit = table.units.get(column)
    try:
        stamps = table.load([column])[column]
        clock = _Clock.of(table, stamps, unit, column)
    except InputError:  # a column that cannot be read is a reason to state a sampling time
        return None
    step = float(np.mean(np.diff(stamps))) if stamps.size > 1 else np.nan
    counts = unit is None and step == 1.0  # the column may count samples
    return step * clock.factor if np.isfinite(step) and step > 0.0 and not counts else None


def _timing(log: AxisLog, table: Table, bound: Mapping[str, Bound]) -> list[str]:
    """Return sentences on the time stamps: that they are not used, jitter and gaps."""
    if "time" not in bound:
        unused = [each.column for each in discover(table).candidates("time")]
        listed = " and ".join(map(repr, unused))
        if not unused:
            return []
        stated = log.sampling_time
        steps = [step for column in unused if (step := _mean_step(table, column)) is not None]
        others = [f"{step:.6g} s" for step in steps if abs(step / stated - 1.0) > _OTHER_SAMPLING]
        own = f", with steps of {' and '.join(others)}" if others else ""
        return [f"time is the stated sampling of {stated:.6g} s, not column {listed}{own}"]
    notes: list[str] = []
    if log.timing_jitter > _NOTICEABLE_JITTER:
        notes.append(
            f"steps of the time stamps deviate by up to {share_text(log.timing_jitter)} from the "
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
