"""The columns of each axis of a log: as a schema states them, by a preset, or by their names."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from typing import Any, TypeVar

from stickslip.logs.columns.channels import stated_expression
from stickslip.logs.columns.discovery import Discovery, discover
from stickslip.logs.columns.presets import axes_by_preset, expanded, preset_for
from stickslip.logs.columns.words import Meaning, meaning, words_in
from stickslip.logs.schema import CHANNELS, AxisSchema, LogSchema, merged
from stickslip.logs.table import Table
from stickslip.logs.units import scale_to_si
from stickslip.records import InputError

Axis = TypeVar("Axis")

_NEEDED = ("position", "effort")
_LIKENESS = 0.75  # from 0 to 1; a column whose name is this similar to a known one is suggested

_KNOWN = {
    "time": ("time", "timestamp"),
    "position": ("position", "angle", "theta", "displacement"),
    "velocity": ("velocity", "speed"),
    "effort": ("effort", "force", "torque", "current"),
}


@dataclass(frozen=True, kw_only=True)
class Assignment:
    """Columns of one axis, and where they are from."""

    axis: str  # name of the axis; empty for the only one of a log
    schema: AxisSchema  # with every channel that the axis has
    #: Meaning of each channel that was found by its name or a preset; None for a preset's.
    found: Mapping[str, Meaning | None] = field(default_factory=dict[str, Meaning | None])
    notes: tuple[str, ...] = ()  # what was inferred beside single channels
    problem: InputError | None = None  # why the axis cannot be read

    def checked(self) -> "Assignment":
        """Return the assignment if it is complete; otherwise an InputError."""
        if self.problem is not None:
            raise self.problem
        return self


def assign(table: Table, schema: LogSchema) -> dict[str, Assignment]:
    """Return the columns of every axis of a log, by the name of the axis.

    What the schema states is taken. If it states neither position nor effort, a preset whose
    columns the log has is taken, or else every axis that the names of columns make. What is missing
    otherwise is looked for by name.
    """
    schema = expanded(table, schema)
    discovery = discover(table)
    if schema.axes:
        return {
            name: _filled(table, discovery, schema.for_axis(name), axis=name)
            for name in schema.axes
        }
    stated = AxisSchema(**merged(schema, AxisSchema()))
    if not stated.stated:
        preset = preset_for(table, schema.preset)
        axes = {} if preset is None else axes_by_preset(table, preset)
        if preset is not None and axes:
            reason = (
                ""
                if schema.preset
                else f"the columns are those of {preset.title} (preset {preset.name})",
            )
            return {
                name: _by_preset(table, discovery, own, stated, name, reason)
                for name, own in axes.items()
            }
        if schema.preset not in {None, "none"}:
            error = InputError(
                "preset_does_not_fit",
                where=table.label,
                preset=schema.preset,
                columns=list(table.headers),
            )
            return {"": Assignment(axis="", schema=stated, problem=error)}
        if len(discovery.axes) > 1:
            return {
                name: _filled(table, discovery, _named(stated, name), axis=name, key=name)
                for name in discovery.axes
            }
        if len(discovery.axes) == 1:
            (key,) = discovery.axes
            return {key: _filled(table, discovery, stated, axis=key, key=key)}
    return {"": _filled(table, discovery, stated, axis="", key=_key(table, stated, discovery))}


def one_axis(axes: Mapping[str, Axis], axis: str | int | None, *, label: str) -> Axis:
    """Return one axis of a log; without a name there must be only one."""
    named = [name for name in axes if name]
    if axis is None and len(axes) > 1:
        raise InputError(
            "axis_not_chosen", where=label, count=len(axes), axes=named, first=next(iter(axes))
        )
    if axis is None:
        return next(iter(axes.values()))
    if str(axis) in axes:
        return axes[str(axis)]
    if not named:
        raise InputError("axis_of_no_axes", where=label, axis=str(axis))
    alike = [name for name in named if name.casefold() == str(axis).casefold()]
    if len(alike) != 1:
        raise InputError("axis_not_found", where=label, axis=str(axis), axes=named)
    return axes[alike[0]]


def _named(stated: AxisSchema, name: str) -> AxisSchema:
    return stated if stated.name is None else replace(stated, name=f"{stated.name} {name}")


def _by_preset(
    table: Table,
    discovery: Discovery,
    preset: AxisSchema,
    stated: AxisSchema,
    name: str,
    reason: tuple[str, ...],
) -> Assignment:
    """Return an axis of a preset, in which what is stated takes precedence."""
    found: dict[str, Meaning | None] = {
        channel: discovery.by_column.get(column)
        for channel in CHANNELS
        if getattr(stated, channel) is None and (column := getattr(preset, channel)) is not None
    }
    units = {**preset.units, **stated.units}
    complete = replace(AxisSchema(**merged(preset, stated)), units=units)
    filled = _filled(table, discovery, complete, axis=name, key=None)
    return replace(filled, found={**found, **filled.found}, notes=tuple(filter(None, reason)))


def _key(table: Table, stated: AxisSchema, discovery: Discovery) -> str | None:
    """Return the axis that the stated columns belong to by their names; None if that is open."""
    keys: set[str] = set()
    for channel in ("position", "effort", "velocity"):
        text = getattr(stated, channel)
        if text is None:
            continue
        try:
            names = stated_expression(table, channel, text, table.label).names
        except InputError:
            continue  # raised where the channel is bound
        keys |= {discovery.by_column[each].axis for each in names if each in discovery.by_column}
    if len(keys) == 1:
        (key,) = keys
        if any(discovery.candidates(channel, key) for channel in _NEEDED):
            return key
    return None


def _filled(
    table: Table,
    discovery: Discovery,
    schema: AxisSchema,
    *,
    axis: str,
    key: str | None = None,
) -> Assignment:
    """Return a schema with the channels that it does not state, as far as their names show them."""
    if not _can_be_bound(table, schema):
        return Assignment(axis=axis, schema=schema)
    open_ended = not schema.stated
    sampled = schema.sampling_time is not None or schema.sampling_frequency is not None
    found: dict[str, Meaning | None] = {}
    entries: dict[str, Any] = {}
    notes: list[str] = []
    try:
        for channel in sorted(CHANNELS, key=lambda each: each != "position"):  # has the rate group
            if getattr(schema, channel) is not None:
                continue
            needed = channel in _NEEDED or (channel == "time" and not sampled)
            if not needed and (channel == "time" or not open_ended):
                continue
            meant = _column_for(table, discovery, channel, key, schema, entries)
            if meant is None and channel in schema.units:  # it replaces that in the file
                named = _by_name(table, discovery, channel)
                meant = named[0] if len(named) == 1 else None
            if meant is None:
                if needed:
                    raise _not_found(table, discovery, channel)
                continue
            found[channel] = meant
            entries[channel] = meant.column
            unused = discovery.unused(channel, meant.axis) if channel == "effort" else []
            if unused:
                listed = ", ".join(repr(each.column) for each in unused)
                notes.append(
                    f"effort is not read from {listed}, as {meant.column!r} is more direct"
                )
        position, effort = found.get("position"), found.get("effort")
        if position is not None and effort is not None and position.axis != effort.axis:
            raise _not_found(table, discovery, "effort")
    except InputError as error:
        return Assignment(axis=axis, schema=schema, found=found, problem=error)
    complete = replace(schema, **entries)
    return Assignment(axis=axis, schema=complete, found=found, notes=tuple(notes))


def _can_be_bound(table: Table, schema: AxisSchema) -> bool:
    """Return whether all stated columns are in the log; binding an absent one is an error."""
    try:
        for channel in CHANNELS:
            if (text := getattr(schema, channel)) is not None:
                stated_expression(table, channel, text, table.label)
    except InputError:
        return False
    return True


def _column_for(
    table: Table,
    discovery: Discovery,
    channel: str,
    key: str | None,
    schema: AxisSchema,
    entries: Mapping[str, str],
) -> Meaning | None:
    """Return the one column that is obviously the channel, or None."""
    candidates = discovery.candidates(channel, key)
    if channel == "time":
        motion = schema.position or entries.get("position")
        group = _group(table, motion)
        if group is not None:
            own = [each for each in candidates if table.group_of(each.column) == group]
            candidates = own or candidates
        stated = [each for each in candidates if table.group_of(each.column).time == each.column]
        candidates = stated or candidates
    if len(candidates) > 1:
        columns = [each.column for each in candidates]
        raise InputError(
            "columns_compete",
            where=table.label,
            channel=channel,
            columns=columns,
            option=_as_option(channel, columns[0]),
        )
    return candidates[0] if candidates else None


def _group(table: Table, text: str | None) -> object:
    """Return the rate group of a channel, or None if it is not known."""
    if text is None:
        return None
    try:
        names = stated_expression(table, "position", text, table.label).names
    except InputError:
        return None
    column = next((name for name in names if name in table.headers), None)
    return None if column is None else table.group_of(column)


def _by_name(table: Table, discovery: Discovery, channel: str) -> list[Meaning]:
    """Return the columns with a name of the channel and a unit of another quantity."""
    bare = replace(table, units={})
    found = [meaning(bare, name) for name in table.units if name not in discovery.by_column]
    return [each for each in found if each is not None and each.channel == channel]


def _not_found(table: Table, discovery: Discovery, channel: str) -> InputError:
    """Return the error that no column is obviously the channel, with similar names."""
    positions = dict.fromkeys(each.axis for each in discovery.candidates("position"))
    efforts = dict.fromkeys(each.axis for each in discovery.candidates("effort"))
    if channel in _NEEDED and positions and efforts:
        return InputError(
            "axis_incomplete",
            where=table.label,
            positions=[each or "unnamed" for each in positions],
            efforts=[each or "unnamed" for each in efforts],
            position=discovery.candidates("position")[0].column,
            effort=discovery.candidates("effort")[0].column,
        )
    near = [
        name
        for name in table.headers
        if name not in discovery.by_column
        and any(
            get_close_matches(word, _KNOWN[channel.removeprefix("load_")], n=1, cutoff=_LIKENESS)
            for word in words_in(name)
        )
    ]
    for each in _by_name(table, discovery, channel):
        try:  # the name is obvious, its unit is of another quantity
            scale_to_si(channel, table.units[each.column], "linear")
        except InputError as error:
            return error.at(table.label)
    remedy = f"say which it is: {_as_option(channel, 'NAME')}"
    if near:
        likely = " or ".join(map(repr, near))
        remedy = f"did you mean {likely}? say so, as in {_as_option(channel, near[0])}"
    if channel == "time":
        remedy += "; or say how long a sample is: sampling_time or --sampling-time SECONDS"
    return InputError(
        "column_not_found",
        where=table.label,
        channel=channel,
        columns=list(table.headers),
        remedy_text=remedy,
    )


def _as_option(channel: str, text: str) -> str:
    """Return how to state a channel, as a flag and in a schema."""
    flag = channel.replace("_", "-")
    return (
        f'--{flag} "{text}" on the command line, or {channel} = "{text}" in a schema or LogSchema'
    )
