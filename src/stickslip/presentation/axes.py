"""The identified axes of a log as one table and one page; nothing is estimated here."""

import re
from collections.abc import Iterable
from dataclasses import replace

from stickslip.presentation.drawing import Plot
from stickslip.presentation.identification import identification_page
from stickslip.presentation.page import (
    Block,
    Fact,
    Grid,
    Heading,
    Listed,
    Page,
    Section,
    Text,
    Verdict,
    headed_list,
)
from stickslip.presentation.table import Cell, Column, Table
from stickslip.presentation.words import NONE, or_none, reasons_of_status, value_with_half
from stickslip.records import AxesIdentification, Identification, parameter_label, unit_text

_IN_TABLE = ("mass", "inertia", "coulomb_friction", "viscous_friction", "static_friction", "offset")
"""Quantities with a column in the table of all axes, for both directions or each."""


def axes_table(found: AxesIdentification) -> Table:
    """Return one row for each axis: status, mass, friction and unexplained effort."""
    every = list(found.axes.items())
    names = [
        name
        for quantity in _IN_TABLE
        for name in (quantity, f"{quantity}_positive", f"{quantity}_negative")
        if any(name in each.estimate.parameters for _, each in every)
    ]
    units = {name: {each.log.unit(name) for _, each in every} for name in names}
    columns = [Column("Axis", "left"), Column("Status", "left")]
    for name in names:
        label = parameter_label(name)
        if len(units[name]) == 1:
            (unit,) = units[name]
            label += f" [{unit_text(unit)}]"
        short = "\n".join(label.replace(", ", " ").replace(" [", "\n[").split(" ", 1))
        columns.append(Column(label, short=short))
    validated = any(each.validation is not None for _, each in every)
    explained = any(each.residuals is not None for _, each in every)
    columns += [Column("Unexplained effort", short="unex-\nplained")] * explained
    columns += [Column("Error of prediction", short="error on\nother log")] * validated
    rows: dict[str, list[str | Cell]] = {}
    for axis, each in every:
        status = each.estimate.status
        row: list[str | Cell] = [axis, Cell(status.word, "good" if status.trusted else "bad")]
        for name in names:
            parameter = each.estimate.parameters.get(name)
            text = NONE if parameter is None else value_with_half(parameter)
            if parameter is not None and parameter.identified and len(units[name]) > 1:
                text = f"{text} {unit_text(parameter.unit)}"
            row.append(text)
        share = None if each.residuals is None else each.residuals.share
        error = None if each.validation is None else each.validation.error
        row += [or_none(share, "{:.2%}".format)] * explained
        row += [or_none(error, "{:.2%}".format)] * validated
        rows[axis] = row
    for axis in found.unread:
        cells = [NONE] * (len(columns) - 2)
        rows[axis] = [axis, Cell("Not identified", "bad"), *cells]
    return Table(columns=columns, rows=[rows[axis] for axis in _by_number(rows)], what="axes")


def _by_number(names: Iterable[str]) -> list[str]:
    """Return names in their order, but those that differ only in their numbers in that of these."""
    every = list(names)
    texts = [re.sub(r"\d+", "#", name) for name in every]
    ordered = sorted(every, key=lambda name: [int(each) for each in re.findall(r"\d+", name)])
    alike = {
        text: iter([name for name in ordered if re.sub(r"\d+", "#", name) == text])
        for text in texts
    }
    return [next(alike[text]) for text in texts]


def outcome(found: AxesIdentification) -> str:
    """Return how many of the axes are identified."""
    trusted = sum(each.estimate.status.trusted for each in found.axes.values())
    return f"{trusted} of {len(found.axes) + len(found.unread)} axes identified"


def axes_page(found: AxesIdentification) -> Page:
    """Return the page of all axes: the table, and a section for each axis."""
    logs = [each.log for each in found.axes.values()]
    unread = [f"{axis}: {why}" for axis, why in found.unread.items()]
    overview = [axes_table(found), *headed_list("Not identified", unread)]
    first = next(iter(found.axes.values()))
    return Page(
        title=f"Friction of {found.name}",
        kicker="friction identification · all axes of a log",
        name=found.name,
        verdict=Verdict(
            found.trusted,
            outcome(found),
            "The parameters of every axis are identified."
            if found.trusted
            else "The values of the others are not to be used as they stand.",
        ),
        facts=[
            Fact("Axes", str(len(found.axes) + len(found.unread))),
            Fact("Duration", f"{max(log.duration for log in logs):.4g}\u00a0s"),
            Fact("Estimator", first.estimate.estimator),
        ],
        sections=[
            Section("axes", "Axes", overview, "All axes"),
            *(
                Section(f"axis-{k}", f"Axis {axis}", _blocks(each, f"axis-{k}"), axis)
                for k, (axis, each) in enumerate(found.axes.items(), start=1)
            ),
        ],
        version=first.estimate.provenance.stickslip_version,
    )


def _blocks(found: Identification, anchor: str) -> list[Block]:
    """Return the sections of the page of one axis, each under a heading."""
    status, page = found.estimate.status, identification_page(found)
    blocks: list[Block] = [Text(status.text, "lead", f"{status.word}.")]
    reasons = reasons_of_status(found.estimate)
    if reasons:
        blocks.append(Listed(reasons))
    for section in page.sections:
        blocks += [Heading(section.name), *_renamed(section.blocks, anchor)]
    return blocks


def _renamed(blocks: Iterable[Block], anchor: str) -> list[Block]:
    """Return blocks with figure anchors that are unique on the page."""

    def renamed(plot: Plot) -> Plot:
        return replace(plot, anchor=f"{anchor}-{plot.anchor}")

    result: list[Block] = []
    for block in blocks:
        if isinstance(block, Plot):
            result.append(renamed(block))
        elif isinstance(block, Grid):
            result.append(block._replace(plots=[renamed(each) for each in block.plots]))
        else:
            result.append(block)
    return result
