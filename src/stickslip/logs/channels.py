"""The channels of an axis: the column or expression of each, stated or found by its name."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from types import MappingProxyType

from stickslip.logs.expressions import (
    Expression,
    Value,
    column_expression,
    parse_expression,
    quoted,
)
from stickslip.logs.schema import CHANNELS, AxisSchema
from stickslip.logs.table import Table
from stickslip.logs.units import header_unit, kind_of_unit, quantity_of, same_unit
from stickslip.records import AxisKind, InputError, unit_of

_NEEDED = ("position", "effort")
_NAMES = MappingProxyType(
    {
        "time": {"t", "time", "timestamp", "timestamps", "elapsed", "clock", "seconds"},
        "position": {"position", "pos", "x", "q", "angle", "theta", "displacement", "qm"},
        "velocity": {"velocity", "vel", "v", "dq", "qd", "qdot", "dx", "xdot", "speed", "omega"},
        "effort": {"effort", "force", "torque", "tau", "f", "current", "cur", "i", "iq"},
    }
)
"""Names of columns without their qualifiers, by channel."""

_QUALIFIERS = frozenset({"measured", "meas", "actual", "act", "motor", "joint", "axis", "stage"})
_COMMANDED = frozenset({"commanded", "command", "cmd", "applied", "drive", "input"})
"""Qualifiers of an effort only: a commanded position is not measured."""

_CURRENTS = frozenset({"current", "cur", "i", "iq"})
_WORDS_OF_KIND: Mapping[AxisKind, frozenset[str]] = {
    "linear": frozenset({"force", "displacement"}),
    "rotary": frozenset({"torque", "tau", "angle", "theta", "omega"}),
}
"""Words that are used of one kind of axis only."""

_LIKENESS = 0.75
"""From 0 to 1; a column whose name is this similar to a known one is suggested."""

_SHORTEST_LIKENESS = 4
"""Letters of a name that another can resemble: shorter ones are similar to too many."""


@dataclass(frozen=True, kw_only=True)
class Bound:
    """One channel of an axis, bound to columns."""

    channel: str
    expression: Expression
    unit: str | None  # in which the expression comes out; None if it is stated nowhere
    note: str  # what was inferred; empty if everything was stated
    kind_of_name: AxisKind | None = None  # what the name of a column that was found implies


def bind(table: Table, schema: AxisSchema, where: str) -> dict[str, Bound]:
    """Bind the channels of an axis to columns.

    What the schema states is taken. The needed channels that it does not state are looked for, and
    the others too if it states neither position nor effort.
    """
    sampled = schema.sampling_time is not None or schema.sampling_frequency is not None
    open_ended = schema.position is None and schema.effort is None
    bound: dict[str, Bound] = {}
    for channel in CHANNELS:
        text = getattr(schema, channel)
        if text is not None:
            expression = _stated(table, channel, text, where)
            bound[channel] = _with_unit(table, schema, channel, expression, found=False)
            continue
        needed = channel in _NEEDED or (channel == "time" and not sampled)
        if not needed and (channel == "time" or not open_ended):
            continue
        name = _find_column(table, channel)
        if name is not None:
            expression = column_expression(name)
            bound[channel] = _with_unit(table, schema, channel, expression, found=True)
        elif needed:
            raise _not_found(table, channel)
    return bound


def _stated(table: Table, channel: str, text: str, where: str) -> Expression:
    """Return the expression of a channel, over names as the table has them."""
    name = table.find(text)
    if name is not None and name in table.headers:
        return column_expression(name)
    if name is None and set(text).isdisjoint("+-*/()'\"`"):
        raise table.missing(text.strip(), channel)
    try:
        expression = parse_expression(text)
    except InputError as error:
        what = f"{error.what}, nor is it a column" if " " in text or "-" in text else error.what
        raise InputError(what, where=error.where, remedy=error.remedy).at(
            f"{where}, {channel}"
        ) from None
    columns: dict[str, str] = {}
    for name in expression.names:
        column = table.find(name)
        if column is None:
            raise table.missing(name, f"{channel} = {text!r}")
        columns[name] = column
    if table.headers.keys().isdisjoint(columns.values()):
        raise InputError(
            f"{text!r} has no column in it, only numbers",
            where=f"{where}, {channel}",
            remedy="name a column",
        )

    def evaluate(values: Mapping[str, Value]) -> Value:
        return expression.evaluate({name: values[column] for name, column in columns.items()})

    return replace(expression, names=tuple(dict.fromkeys(columns.values())), evaluate=evaluate)


def _with_unit(
    table: Table, schema: AxisSchema, channel: str, expression: Expression, *, found: bool
) -> Bound:
    unit, origin = schema.units.get(channel), ""
    if unit is None:
        unit, origin = _unit_in_file(table, channel, expression)
    elif expression.is_column:
        in_file = table.units.get(expression.names[0])
        if in_file is not None and not same_unit(in_file, unit):
            origin = f"its unit is {unit} as stated, not {in_file} as in the file"
    subject = channel.replace("_", " ")
    note = f"{subject} is read from column {expression.names[0]!r}" if found else ""
    if origin:
        note = f"{note}; {origin}" if note else f"{subject}: {origin}"
    return Bound(
        channel=channel,
        expression=expression,
        unit=unit,
        note=note,
        kind_of_name=_kind_of_name(expression.names[0], table) if found else None,
    )


def _unit_in_file(table: Table, channel: str, expression: Expression) -> tuple[str | None, str]:
    """Return the unit that an expression comes out in by its columns, and a sentence.

    A column has the unit that its header states. Numbers in an expression may change the unit: from
    columns in SI units, or in units of another quantity, it is to make SI units. From columns in
    another unit of the same quantity, this is not known.
    """
    for name in expression.names:
        unit = table.units.get(name)
        if unit is None:
            continue
        if expression.is_column:
            return unit, f"its unit {unit} is stated in the file"
        try:
            si = unit_of(quantity_of(channel), kind_of_unit(channel, unit) or "linear")
        except InputError:
            continue  # another quantity, such as volts
        if unit == si:
            return unit, f"its unit {unit} is that of column {name!r}"
        raise InputError(
            f"{channel} = {expression.text!r} uses column {name!r} in {unit}, and whether it comes "
            f"out in {unit} or {si} is not known",
            where=table.label,
            remedy=f"say which, as in --unit {channel}={unit} or under units in a schema",
        )
    return None, ""


def axis_kind(bound: Iterable[Bound], stated: AxisKind | None, label: str) -> tuple[AxisKind, str]:
    """Return the kind of the axis, and a sentence if it was not stated.

    Units imply it, and so do names such as force and torque of columns that were found; an error
    is raised if nothing does, or if they contradict one another.
    """
    reasons: dict[AxisKind, str] = {}
    if stated is not None:
        reasons[stated] = f"the axis is stated to be {stated}"
    for each in bound:
        subject = each.channel.replace("_", " ")
        if each.unit is not None and stated is None:
            kind = kind_of_unit(each.channel, each.unit)
            reason = f"{subject} is in {each.unit}"
        else:
            kind = each.kind_of_name if each.unit is None else None
            reason = f"{subject} is called {each.expression.text!r}"
        if kind is not None:
            reasons.setdefault(kind, reason)
    if len(reasons) > 1:
        raise InputError(
            f"{' and '.join(reasons.values())}, which do not go together on one axis",
            where=label,
            remedy="correct the units and the kind, or say with --unit (units in a schema) what "
            "the unit is",
        )
    if not reasons:
        raise InputError(
            "whether the axis is linear or rotary is not known: no units are given",
            where=label,
            remedy="say --kind linear or --kind rotary on the command line, or kind in a schema or "
            "LogSchema, or put units in the header",
        )
    ((kind, reason),) = reasons.items()
    return kind, "" if stated else f"the axis is taken as {kind} because {reason}"


def candidates(table: Table, channel: str) -> list[str]:
    """Return every column that may be the channel by its name."""
    names = _NAMES[channel.removeprefix("load_")]
    return [name for name in table.headers if _core(channel, name, table) in names]


def _find_column(table: Table, channel: str) -> str | None:
    """Return the one column that is obviously the channel, or None.

    Several such columns are an error, and so is a motor current without a unit.
    """
    found = candidates(table, channel)
    currents = [name for name in found if not _CURRENTS.isdisjoint(_words_of(name, table))]
    found = [name for name in found if name not in currents] or currents
    if len(found) > 1:
        listed = f"{', '.join(map(repr, found[:-1]))} and {found[-1]!r}"
        raise InputError(
            f"columns {listed} could each be the {channel.replace('_', ' ')}",
            where=table.label,
            remedy=f"say which, as in {_as_option(channel, found[0])}",
        )
    if found and found == currents and found[0] not in table.units:
        raise InputError(
            f"column {found[0]!r} seems to be a motor current, not a force or a torque",
            where=table.label,
            remedy=f"say its constant, as in {_as_option(channel, f'1.2 * {quoted(found[0])}')}",
        )
    return found[0] if found else None


def _not_found(table: Table, channel: str) -> InputError:
    """Return the error that no column is obviously the channel, with similar names."""
    taken = {name for each in _NAMES for name in candidates(table, each)}
    known = [word for word in _NAMES[channel] if len(word) >= _SHORTEST_LIKENESS]
    near = [
        name
        for name in table.headers
        if name not in taken
        and get_close_matches(_core(channel, name, table), known, n=1, cutoff=_LIKENESS)
    ]
    remedy = f"say which it is: {_as_option(channel, 'NAME')}"
    if near:
        likely = " or ".join(map(repr, near))
        remedy = f"did you mean {likely}? say so, as in {_as_option(channel, near[0])}"
    if channel == "time":
        remedy += "; or say how long a sample is: sampling_time or --sampling-time SECONDS"
    return InputError(
        f"no column is obviously the {channel}; the columns are: {', '.join(table.headers)}",
        where=table.label,
        remedy=remedy,
    )


def _kind_of_name(name: str, table: Table) -> AxisKind | None:
    """Return the kind of axis that a column's name implies, None where it may be either."""
    words = _words_of(name, table)
    kinds: list[AxisKind] = [
        kind for kind, own in _WORDS_OF_KIND.items() if not own.isdisjoint(words)
    ]
    return kinds[0] if len(kinds) == 1 else None


def _words_of(name: str, table: Table) -> list[str]:
    """Split a name into lower-case words, without the unit that may end it."""
    title, unit = header_unit(table.headers[name].rpartition(":")[2])
    title = title.removesuffix(f"_{unit}")
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", title)
    return [word for word in re.split(r"[^a-z0-9]+", spaced.lower()) if word]


def _core(channel: str, name: str, table: Table) -> str:
    """Return a name without its qualifiers; empty if it is of the other mass."""
    words = _words_of(name, table)
    if ("load" in words) != channel.startswith("load_"):
        return ""
    ignored = {"load", *_QUALIFIERS, *(_COMMANDED if channel == "effort" else ())}
    return "".join(word for word in words if word not in ignored)


def _as_option(channel: str, text: str) -> str:
    """Return how to state a channel, as a flag and in a schema."""
    flag = channel.replace("_", "-")
    return (
        f'--{flag} "{text}" on the command line, or {channel} = "{text}" in a schema or LogSchema'
    )
