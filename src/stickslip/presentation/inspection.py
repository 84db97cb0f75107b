"""The contents of a log as tables."""

import math

from stickslip.presentation.table import Cell, Column, Table
from stickslip.presentation.words import NONE, or_none, prefixed
from stickslip.records import (
    AxisProposal,
    Inspection,
    LogColumn,
    parameter_label,
    share_text,
    unit_text,
)

_REPEATED = 0.01  # smallest share of the samples at an extreme that is shown [-]
_LARGE = 1e6  # value from which on all digits of a whole number are shown [unit of the column]


def column_table(found: Inspection) -> Table:
    """Return the columns of a log with unit and range; those that may be channels come first."""
    several = len(found.rates) > 1
    columns = [Column("Column", "left"), Column("Unit", "left")]
    columns += [Column("Group", "left"), Column("Samples")] if several else []
    columns += [Column("From"), Column("To"), Column("Remarks", "left")]
    rows = [
        [
            each.name,
            unit_text(each.unit) or NONE,
            *([each.group, str(each.samples)] if several else []),
            or_none(each.low, _number),
            or_none(each.high, _number),
            _remarks(each),
        ]
        for each in sorted(found.columns, key=lambda each: not each.meaning)
    ]
    return Table(columns=columns, rows=rows, what="columns")


def _number(value: float) -> str:
    # Large values are mostly time stamps and encoder counts, whose last digits matter
    return f"{value:.6g}" if abs(value) < _LARGE else f"{value:.9g}"


def _remarks(column: LogColumn) -> str:
    parts = [column.meaning] if column.meaning else []
    if column.low is not None and column.low == column.high:
        parts.append("constant")
    if column.missing:
        parts.append(f"{column.missing} missing")
    if column.repeated > _REPEATED:
        parts.append(f"{share_text(column.repeated)} at an extreme")
    if column.origin and column.origin != column.name:
        parts.append(column.origin)
    return "; ".join(parts)


def axis_table(found: Inspection) -> Table:
    """Return the proposed axes: columns, sampling, clipping and lag."""
    columns = [
        Column("Axis", "left"),
        Column("Samples"),
        Column("One every"),
        Column("Jitter"),
        Column("Gaps"),
        Column("Clipped"),
        Column("Lag of the effort", short="lag of\nthe effort"),
        Column("Position", "left"),
        Column("Effort", "left"),
    ]
    rows: list[list[str | Cell]] = []
    for each in found.axes:
        position, effort = (each.columns.get(name, NONE) for name in ("position", "effort"))
        unit = unit_text(each.units.get("effort", ""))
        if each.problem and not each.samples:
            rows.append([each.name, *[NONE] * 6, position, effort])
            continue
        rows.append(
            [
                each.name,
                str(each.samples),
                prefixed(each.sampling_time, "s"),
                share_text(each.jitter),
                str(each.segments - 1),
                share_text(each.clipped),
                lag_text(each),
                position,
                f"{effort} [{unit}]" if unit else effort,
            ]
        )
    return Table(columns=columns, rows=rows, what="axes")


def lag_text(axis: AxisProposal) -> str:
    """Return the lag of the effort with its standard error; a dash without one."""
    if axis.lag is None:
        return NONE
    error = axis.lag_resolution or 0.0
    return f"{1e3 * axis.lag:.2g} ± {1e3 * error:.1g} ms"


def check_table(found: Inspection) -> Table:
    """Return the expected precision, one row for each parameter."""
    columns = [
        Column("Axis", "left"),
        Column("Parameter", "left"),
        Column("About"),
        Column("± expected (95 %)"),
        Column("Verdict", "left"),
    ]
    rows: list[list[str | Cell]] = []
    for axis in found.axes:
        for each in axis.expected:
            known = each.relative is not None and math.isfinite(each.relative)
            verdict = Cell("sufficient", "good") if each.sufficient else Cell("insufficient", "bad")
            rows.append(
                [
                    axis.name,
                    parameter_label(each.parameter),
                    or_none(each.value, lambda value: f"{value:.3g}"),
                    share_text(each.relative or 0.0) if known else NONE,
                    verdict,
                ]
            )
    return Table(columns=columns, rows=rows, what="parameters")
