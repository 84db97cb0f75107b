"""The channels of an axis: the column or expression of each, stated or found by its name."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from stickslip.logs.columns.words import Meaning, meaning, unread_unit
from stickslip.logs.expressions import Expression, Value, column_expression, parse_expression
from stickslip.logs.schema import CHANNELS, AxisSchema
from stickslip.logs.table import Table
from stickslip.logs.units import effort_unit, kind_of_unit, quantity_of, same_unit
from stickslip.records import AxisKind, InputError, unit_of


@dataclass(frozen=True, kw_only=True)
class Bound:
    """One channel of an axis, bound to columns."""

    channel: str
    expression: Expression
    unit: str | None  # in which the expression comes out; None if it is stated nowhere
    note: str  # what was inferred; empty if everything was stated
    kind_of_name: AxisKind | None = None  # what the name of a column that was found implies


def bind(
    table: Table, schema: AxisSchema, found: Mapping[str, Meaning | None], where: str
) -> dict[str, Bound]:
    """Bind the channels of a schema to columns; ``found`` are those that nobody stated."""
    bound: dict[str, Bound] = {}
    for channel in CHANNELS:
        text = getattr(schema, channel)
        if text is None:
            continue
        expression = stated_expression(table, channel, text, where)
        bound[channel] = _with_unit(table, schema, channel, expression, found)
    return bound


_NUMBERS = {"pi": math.pi}  # names that mean a number where the log has no column of the name


def stated_expression(table: Table, channel: str, text: str, where: str) -> Expression:
    """Return the expression of a channel, over names as the table has them."""
    name = table.find(text)
    if name is not None and name in table.headers:
        return column_expression(name)
    if name is None and set(text).isdisjoint("+-*/()'\"`"):
        raise table.missing(text.strip(), channel)
    try:
        expression = parse_expression(text)
    except InputError as error:
        raise error.at(f"{where}, {channel}") from None
    columns: dict[str, str] = {}
    numbers: dict[str, float] = {}
    for name in expression.names:
        column = table.find(name)
        if column is None and name in _NUMBERS:
            numbers[name] = _NUMBERS[name]
            continue
        if column is None:
            raise table.missing(name, f"{channel} = {text!r}")
        columns[name] = column
    if table.headers.keys().isdisjoint(columns.values()):
        raise InputError("expression_without_column", where=f"{where}, {channel}", text=text)

    def evaluate(values: Mapping[str, Value]) -> Value:
        own = {name: values[column] for name, column in columns.items()}
        return expression.evaluate({**numbers, **own})

    return replace(expression, names=tuple(dict.fromkeys(columns.values())), evaluate=evaluate)


def _with_unit(
    table: Table,
    schema: AxisSchema,
    channel: str,
    expression: Expression,
    found: Mapping[str, Meaning | None],
) -> Bound:
    unit, origin = schema.units.get(channel), ""
    column, meant = expression.names[0], found.get(channel)
    if unit is None:
        unit, origin = _unit_in_file(table, channel, expression)
        if unit is None and expression.is_column:
            _check_unread(table, channel, column)
        if unit is None and meant is not None and meant.current:
            unit, origin = "A", "it seems to be a motor current, and is taken in A"
    elif channel in found and expression.is_column and column not in table.units:
        origin = f"its unit is taken to be {unit}"
    elif expression.is_column:
        in_file = table.units.get(column)
        if in_file is not None and not same_unit(in_file, unit):
            origin = f"its unit is {unit} as stated, not {in_file} as in the file"
    subject = channel.replace("_", " ")
    note = f"{subject} is read from column {column!r}" if channel in found else ""
    if origin:
        note = f"{note}; {origin}" if note else f"{subject}: {origin}"
    return Bound(
        channel=channel,
        expression=expression,
        unit=unit,
        note=note,
        kind_of_name=None if meant is None else meant.kind,
    )


def _check_unread(table: Table, channel: str, column: str) -> None:
    """Check that the header of a column has no unit that is not known.

    A text in brackets that a position and an effort share is the name of an axis, unless it is
    that of values per unit.
    """
    text = unread_unit(table, column)
    if not text:
        return
    having = {
        meant.channel
        for name, header in table.headers.items()
        if text in header and unread_unit(table, name) == text
        if (meant := meaning(table, name)) is not None
    }
    if not {"position", "effort"} <= having or text.casefold().strip(".") in {"pu", "p.u"}:
        raise InputError(
            "unit_unread", where=table.label, channel=channel, column=column, text=text
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
            kind = kind_of_unit(channel, unit)
        except InputError:
            continue  # another quantity, such as volts
        if channel == "effort" and effort_unit(unit):
            continue  # a current, which the numbers turn into a torque
        si = unit_of(quantity_of(channel), kind or "linear")
        if unit == si:
            return unit, f"its unit {unit} is that of column {name!r}"
        raise InputError(
            "unit_of_expression_unknown",
            where=table.label,
            channel=channel,
            text=expression.text,
            name=name,
            unit=unit,
            needed=si,
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
        raise InputError("kinds_contradict", where=label, reasons=tuple(reasons.values()))
    if not reasons:
        raise InputError("kind_unknown", where=label)
    ((kind, reason),) = reasons.items()
    return kind, "" if stated else f"the axis is taken as {kind} because {reason}"
