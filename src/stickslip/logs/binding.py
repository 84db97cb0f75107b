"""What each channel of an axis is computed from, and the unit that comes out in."""

from collections.abc import Iterable
from dataclasses import dataclass

from stickslip.logs.discovery import find_column, kind_of_name, not_found
from stickslip.logs.expressions import Expression, column_expression, parse_expression
from stickslip.logs.schema import CHANNELS, AxisSchema
from stickslip.logs.table import Table
from stickslip.logs.units import kind_of_unit, quantity_of, same_unit
from stickslip.records import AxisKind, InputError, unit_of

__all__ = ["Bound", "axis_kind", "bind"]

_NEEDED = ("position", "effort")


@dataclass(frozen=True, kw_only=True)
class Bound:
    """One channel of an axis, bound to columns.

    Attributes
    ----------
    channel
        Its name.
    expression
        What it is computed from.
    unit
        The unit that comes out in; None: not stated anywhere.
    note
        What was inferred; empty if everything was stated.
    kind_of_name
        The kind of axis that the name of a column that was found is said of.
    """

    channel: str
    expression: Expression
    unit: str | None
    note: str
    kind_of_name: AxisKind | None = None


def bind(table: Table, schema: AxisSchema, where: str) -> dict[str, Bound]:
    """Bind the channels of an axis to columns.

    What the schema states is taken. The needed channels that it does not state are looked for, and
    the others too if it states neither position nor effort.

    Raises
    ------
    InputError
        If a stated column is not there, or a needed one is neither stated nor found.
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
        name = find_column(table, channel)
        if name is not None:
            expression = column_expression(name)
            bound[channel] = _with_unit(table, schema, channel, expression, found=True)
        elif needed:
            raise not_found(table, channel)
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
        if " " in text or "-" in text:
            error = InputError(
                f"{error.what}, nor is it a column", where=error.where, remedy=error.remedy
            )
        raise error.at(f"{where}, {channel}") from None
    found = {name: table.find(name) for name in expression.names}
    for name, column in found.items():
        if column is None:
            raise table.missing(name, f"{channel} = {text!r}")
    if not any(column in table.headers for column in found.values()):
        raise InputError(
            f"{text!r} has no column in it, only numbers",
            where=f"{where}, {channel}",
            remedy="name a column",
        )
    columns = {name: str(column) for name, column in found.items()}
    return Expression(
        text=text,
        names=tuple(dict.fromkeys(columns.values())),
        evaluate=lambda values: expression.evaluate(
            {name: values[column] for name, column in columns.items()}
        ),
        is_column=expression.is_column,
    )


def _with_unit(
    table: Table, schema: AxisSchema, channel: str, expression: Expression, *, found: bool
) -> Bound:
    unit = schema.units.get(channel)
    origin = ""
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
        kind_of_name=kind_of_name(expression.names[0], table) if found else None,
    )


def _unit_in_file(table: Table, channel: str, expression: Expression) -> tuple[str | None, str]:
    """Return the unit that an expression comes out in, as its columns tell it, and a sentence.

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

    Units tell it, and so do names such as force and torque of columns that were found.

    Raises
    ------
    InputError
        If nothing states the kind, or if units and names contradict one another.
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
